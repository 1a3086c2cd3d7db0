//! Random small tasks.

use super::oracle::State;
use super::task::{Action, Change, Effect, Flow, Formula, Named, Number, Rule, Task, Term};

/// Numbers by chance (splitmix64; Steele, Lea and Flood 2014).
pub struct Chance(pub u64);

impl Chance {
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) % limit as u64) as usize
    }

    pub fn percent(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    pub fn of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}

/// Language features of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Classical,
    Numeric,
    Temporal,
    /// With timed literals, which the goal speaks of.
    Given,
    /// Timed literals, durations that are chosen, numbers among their bounds, and numbers that change at rates.
    Mixed,
}

struct Maker<'c> {
    chance: &'c mut Chance,
    task: Task,
    kind: Kind,
    /// Types of the variables in scope, by number; those that were left are `usize::MAX`.
    scope: Vec<usize>,
    /// Predicates from here on may not be mentioned.
    limit: usize,
    /// For each function, the kinds of changes by the action at hand.
    families: [&'static [&'static str]; 4],
}

/// A random task.
pub fn task(chance: &mut Chance, kind: Kind) -> Task {
    let objects = 1 + chance.below(3);
    let mut predicates = vec![vec![], vec![], vec![0], vec![chance.below(2)]];
    if chance.percent(40) {
        predicates.push(vec![0, chance.below(2)]);
    }
    let derived = predicates.len();
    for _ in 0..[0, 0, 0, 1, 2][chance.below(5)] {
        predicates.push(if chance.percent(50) { vec![] } else { vec![0] });
    }
    let functions = match kind {
        Kind::Numeric => vec![vec![], vec![0]],
        Kind::Temporal | Kind::Given if chance.percent(40) => vec![vec![], vec![0]],
        // The first two flow; the others bound durations, and are rates.
        Kind::Mixed => vec![vec![], vec![0], vec![], vec![0]],
        _ => vec![],
    };
    let task = Task {
        objects,
        special: chance.below(objects + 1),
        predicates,
        derived,
        functions,
        rules: Vec::new(),
        actions: Vec::new(),
        facts: Vec::new(),
        numbers: Vec::new(),
        timed: Vec::new(),
        goal: Formula::And(Vec::new()),
        metric: None,
    };
    let mut maker = Maker { chance, task, kind, scope: Vec::new(), limit: 0, families: [&[]; 4] };
    maker.fill();
    maker.task
}

impl Maker<'_> {
    fn fill(&mut self) {
        self.rules();
        self.limit = self.task.predicates.len();
        for _ in 0..2 + self.chance.below(3) {
            let action = self.action();
            self.task.actions.push(action);
        }
        self.initial();
        self.scope.clear();
        self.task.goal = match self.kind {
            Kind::Given => self.goal_of_given(),
            _ => self.formula(2),
        };
        if !self.task.functions.is_empty() && self.chance.percent(30) {
            self.task.metric = Some(Number::Fluent(Named { index: 0, terms: Vec::new() }));
        }
    }

    /// A goal about one or two of the facts that are given or taken away at a time, and something else.
    fn goal_of_given(&mut self) -> Formula {
        let mut parts = Vec::new();
        if self.chance.percent(60) {
            parts.push(self.formula(1));
        }
        for _ in 0..1 + self.chance.below(2) {
            let given = self.task.timed.len();
            let Some((_, index, arguments, adds)) =
                self.task.timed.get(self.chance.below(given.max(1))).cloned()
            else {
                break;
            };
            let terms = arguments.into_iter().map(Term::Object).collect();
            let atom = Formula::Atom(Named { index, terms });
            let holds = if self.chance.percent(70) { adds } else { !adds };
            parts.push(if holds { atom } else { Formula::Not(Box::new(atom)) });
        }
        Formula::And(parts)
    }

    /// Rules may use their own predicate, and the negation of those before it.
    fn rules(&mut self) {
        for predicate in self.task.derived..self.task.predicates.len() {
            for _ in 0..1 + self.chance.below(2) {
                self.scope = self.task.predicates[predicate].clone();
                self.limit = predicate;
                let mut body = self.formula(1);
                if self.chance.percent(50) {
                    let own = self.named(predicate, &self.task.predicates[predicate].clone());
                    body = Formula::And(vec![body, self.atom_of_basic(), Formula::Atom(own)]);
                }
                self.task.rules.push(Rule { predicate, body });
            }
        }
    }

    fn atom_of_basic(&mut self) -> Formula {
        let index = self.chance.below(self.task.derived);
        let kinds = self.task.predicates[index].clone();
        Formula::Atom(self.named(index, &kinds))
    }

    fn action(&mut self) -> Action {
        let parameters: Vec<usize> = (0..self.chance.below(3)).map(|_| self.chance.below(2)).collect();
        self.scope = parameters.clone();
        let durative = self.is_temporal() && self.chance.percent(80);
        let all: [&[&str]; 4] =
            [&["increase", "increase", "decrease"], &["increase"], &["assign"], &["scale-up"]];
        for family in 0..if self.kind == Kind::Mixed { 4 } else { 2 } {
            self.families[family] = self.chance.of::<&[&str]>(&all);
        }
        let duration = durative.then(|| self.duration());
        let flows = if durative && self.kind == Kind::Mixed { self.flows() } else { Vec::new() };
        let mut condition = [None, None, None];
        condition[0] = self.chance.percent(75).then(|| self.formula(2));
        if durative {
            for part in &mut condition[1..] {
                *part = self.chance.percent(30).then(|| self.formula(1));
            }
        }
        let effects = (0..1 + self.chance.below(3)).map(|_| self.effect(durative)).collect();
        Action { parameters, duration, condition, effects, flows }
    }

    fn duration(&mut self) -> [Option<Number>; 2] {
        if self.kind == Kind::Mixed {
            return self.chosen_duration();
        }
        let least = 1 + self.chance.below(3);
        let most = if self.chance.percent(25) { least + 1 + self.chance.below(2) } else { least };
        [least, most].map(|seconds| Some(Number::Constant(seconds as f64)))
    }

    /// Bounds of a duration that are numbers or given by a fluent, mostly with room between them.
    fn chosen_duration(&mut self) -> [Option<Number>; 2] {
        let least = 1 + self.chance.below(2);
        let least = match self.chance.below(4) {
            0 => self.steady(),
            _ => Number::Constant(least as f64),
        };
        let more = Number::Constant(self.chance.of(&[0.5, 1.0, 2.0, 4.0]));
        let longer = Number::Binary('+', Box::new([least.clone(), more]));
        let most = match self.chance.below(8) {
            0 => None,
            1 => Some(self.steady()),
            2 | 3 => Some(least.clone()),
            _ => Some(longer),
        };
        [Some(least), most]
    }

    /// A fluent that nothing flows into.
    fn steady(&mut self) -> Number {
        let index = 2 + self.chance.below(2);
        let kinds = self.task.functions[index].clone();
        Number::Fluent(self.named(index, &kinds))
    }

    fn flows(&mut self) -> Vec<Flow> {
        let many = self.chance.of(&[0, 0, 1, 1, 2]);
        let flow = |_| {
            let index = self.chance.below(2);
            let kinds = self.task.functions[index].clone();
            let per_second = match self.chance.below(20) {
                0 => Number::Fluent(Named { index: 0, terms: Vec::new() }),
                1..=6 => self.steady(),
                _ => Number::Constant(self.chance.of(&[0.5, 1.0, 2.0])),
            };
            Flow { increases: self.chance.percent(70), fluent: self.named(index, &kinds), per_second }
        };
        (0..many).map(flow).collect()
    }

    fn effect(&mut self, durative: bool) -> Effect {
        let before = self.scope.len();
        let forall = self.chance.percent(20).then(|| {
            let of = self.chance.below(2);
            self.scope.push(of);
            (before, of)
        });
        let at_end = durative && self.chance.percent(60);
        let mut when = [None, None, None];
        if self.chance.percent(30) {
            let first = if at_end { self.chance.below(3) } else { 0 };
            when[first] = Some(self.formula(1));
            if at_end && self.chance.percent(30) {
                when[2] = Some(self.formula(1));
            }
        }
        let change = if !self.task.functions.is_empty() && self.chance.percent(45) {
            self.numeric_change(durative)
        } else {
            let index = self.chance.below(self.task.derived);
            let kinds = self.task.predicates[index].clone();
            let atom = self.named(index, &kinds);
            if self.chance.percent(60) { Change::Add(atom) } else { Change::Delete(atom) }
        };
        self.scope.truncate(before);
        Effect { forall, when, at_end, change }
    }

    fn numeric_change(&mut self, durative: bool) -> Change {
        let steady = self.kind == Kind::Mixed && self.chance.percent(80);
        let index = self.chance.below(if steady { 2 } else { self.task.functions.len() });
        let kinds = self.task.functions[index].clone();
        // What effects of one action make of a number must not depend on their order.
        let how = self.chance.of(self.families[index]);
        let amount = match how {
            "assign" => Number::Constant(1.0),
            "scale-up" => Number::Constant(2.0),
            _ if durative && self.chance.percent(20) => match self.kind {
                Kind::Mixed if self.chance.percent(50) => {
                    Number::Binary('*', Box::new([Number::Constant(2.0), Number::Duration]))
                }
                _ => Number::Duration,
            },
            _ if self.chance.percent(70) => Number::Constant(self.chance.of(&[1.0, 2.0, 0.1])),
            _ => self.number(1),
        };
        Change::Number(how, self.named(index, &kinds), amount)
    }

    fn initial(&mut self) {
        for predicate in 0..self.task.derived {
            for arguments in tuples(&self.task, &self.task.predicates[predicate].clone()) {
                if self.chance.percent(35) {
                    self.task.facts.push((predicate, arguments));
                }
            }
        }
        for function in 0..self.task.functions.len() {
            for arguments in tuples(&self.task, &self.task.functions[function].clone()) {
                if self.chance.percent(85) {
                    let value = match function {
                        0 | 1 => self.chance.of(&[0.0, 0.0, 1.0, 2.0, 0.3]),
                        _ => self.chance.of(&[0.5, 1.0, 2.0, 3.0]),
                    };
                    self.task.numbers.push((function, arguments, value));
                }
            }
        }
        if !self.is_temporal() {
            return;
        }
        let counts = match self.kind {
            Kind::Given => [1, 2, 2, 3, 4],
            Kind::Mixed => [0, 1, 1, 2, 3],
            _ => [0, 0, 0, 1, 2],
        };
        for index in 0..counts[self.chance.below(5)] {
            let predicate = self.chance.below(self.task.derived);
            let all = tuples(&self.task, &self.task.predicates[predicate].clone());
            if all.is_empty() {
                continue;
            }
            let arguments = all[self.chance.below(all.len())].clone();
            let time_s = (1 + self.chance.below(6)) as f64 + 0.003 * (1 + index) as f64;
            self.task.timed.push((time_s, predicate, arguments, self.chance.percent(50)));
        }
    }

    fn is_temporal(&self) -> bool {
        matches!(self.kind, Kind::Temporal | Kind::Given | Kind::Mixed)
    }

    /// Arguments that fit as far as there are any; else the nullary predicate or function 0.
    fn named(&mut self, index: usize, kinds: &[usize]) -> Named {
        let mut terms = Vec::with_capacity(kinds.len());
        for &kind in kinds {
            let mut choices: Vec<Term> = self.task.of(kind).map(Term::Object).collect();
            for (variable, &own) in self.scope.iter().enumerate() {
                if own != usize::MAX && (kind == 0 || own == 1) {
                    choices.extend([Term::Variable(variable); 3]);
                }
            }
            if choices.is_empty() {
                return Named { index: 0, terms: Vec::new() };
            }
            terms.push(self.chance.of(&choices));
        }
        Named { index, terms }
    }

    fn formula(&mut self, depth: usize) -> Formula {
        if depth == 0 || self.chance.percent(35) {
            return self.leaf();
        }
        match self.chance.below(10) {
            0..=3 => Formula::And((0..1 + self.chance.below(3)).map(|_| self.formula(depth - 1)).collect()),
            4..=5 => Formula::Or((0..1 + self.chance.below(3)).map(|_| self.formula(depth - 1)).collect()),
            6 => Formula::Not(Box::new(self.formula(depth - 1))),
            7 => Formula::Imply(Box::new([self.formula(depth - 1), self.formula(depth - 1)])),
            _ => {
                let (variable, of) = (self.scope.len(), self.chance.below(2));
                self.scope.push(of);
                let body = Box::new(self.formula(depth - 1));
                self.scope[variable] = usize::MAX;
                let all = self.chance.percent(50);
                Formula::Quantified { all, variable, of, body }
            }
        }
    }

    fn leaf(&mut self) -> Formula {
        let chosen = self.chance.below(100);
        let objects: Vec<Term> = (0..self.scope.len())
            .filter(|&variable| self.scope[variable] != usize::MAX)
            .map(Term::Variable)
            .chain((0..self.task.objects).map(Term::Object))
            .collect();
        let leaf = match chosen {
            0..=7 => Formula::Same(self.chance.of(&objects), self.chance.of(&objects)),
            8..=40 if !self.task.functions.is_empty() => {
                let relation = self.chance.of(&["<", "<=", "=", ">=", ">"]);
                Formula::Compare(relation, self.number(1), self.number(0))
            }
            _ => {
                let index = self.chance.below(self.limit.max(self.task.derived));
                let kinds = self.task.predicates[index].clone();
                Formula::Atom(self.named(index, &kinds))
            }
        };
        if self.chance.percent(30) { Formula::Not(Box::new(leaf)) } else { leaf }
    }

    fn number(&mut self, depth: usize) -> Number {
        if depth > 0 && self.chance.percent(35) {
            let operator = match self.kind {
                // Sums of numbers that flow are linear in time.
                Kind::Mixed => self.chance.of(&['+', '-', '+']),
                _ => self.chance.of(&['+', '-', '*', '/', '+']),
            };
            return Number::Binary(operator, Box::new([self.number(depth - 1), self.number(depth - 1)]));
        }
        match self.chance.below(20) {
            0..=7 => Number::Constant(self.chance.of(&[0.0, 1.0, 2.0, 3.0, 0.3])),
            8 => Number::Negative(Box::new(Number::Constant(1.0))),
            _ => {
                let index = self.chance.below(self.task.functions.len());
                let kinds = self.task.functions[index].clone();
                Number::Fluent(self.named(index, &kinds))
            }
        }
    }
}

/// A goal that holds in a state, made of some of what is otherwise at first.
pub fn goal_in(task: &Task, first: &State, last: &State, chance: &mut Chance) -> Formula {
    let (mut turned, mut same) = (Vec::new(), Vec::new());
    let fits = |kinds: &[usize], arguments: &[usize]| {
        kinds.iter().zip(arguments).all(|(&kind, object)| task.of(kind).contains(object))
    };
    let mut bit = 0;
    for (index, kinds) in task.predicates.iter().enumerate() {
        for arguments in all_tuples(task.objects, kinds.len()) {
            let (was, holds) = (first.facts >> bit & 1 != 0, last.facts >> bit & 1 != 0);
            bit += 1;
            if !fits(kinds, &arguments) {
                continue;
            }
            let terms = arguments.into_iter().map(Term::Object).collect();
            let atom = Formula::Atom(Named { index, terms });
            let part = if holds { atom } else { Formula::Not(Box::new(atom)) };
            if was == holds { same.push(part) } else { turned.push(part) }
        }
    }
    let mut place = 0;
    for (index, kinds) in task.functions.iter().enumerate() {
        for arguments in all_tuples(task.objects, kinds.len()) {
            let (before, value) = (first.numbers[place], last.numbers[place]);
            place += 1;
            if value.is_nan() || !fits(kinds, &arguments) {
                continue;
            }
            let (relation, bound) = match chance.below(6) {
                0 => ("=", value),
                1 => (">=", value),
                2 => ("<=", value),
                3 => (">=", value - 0.25),
                4 => (">", value - 0.5),
                _ => ("<", value + 0.25),
            };
            let terms = arguments.into_iter().map(Term::Object).collect();
            let part =
                Formula::Compare(relation, Number::Fluent(Named { index, terms }), Number::Constant(bound));
            if before == value { same.push(part) } else { turned.push(part) }
        }
    }
    let mut parts = Vec::new();
    for _ in 0..1 + chance.below(3) {
        let from = if turned.is_empty() || chance.percent(20) { &mut same } else { &mut turned };
        if !from.is_empty() {
            parts.push(from.swap_remove(chance.below(from.len())));
        }
    }
    Formula::And(parts)
}

/// All tuples of so many objects, in the order of their bits in a state.
fn all_tuples(objects: usize, length: usize) -> Vec<Vec<usize>> {
    let count = objects.pow(length as u32);
    let digit = |number: usize, place: usize| number / objects.pow((length - 1 - place) as u32) % objects;
    (0..count).map(|number| (0..length).map(|place| digit(number, place)).collect()).collect()
}

/// All arguments of these types.
pub fn tuples(task: &Task, kinds: &[usize]) -> Vec<Vec<usize>> {
    kinds.iter().fold(vec![Vec::new()], |all, &kind| {
        let longer = |tuple: &Vec<usize>| {
            let tuple = tuple.clone();
            task.of(kind).map(move |object| tuple.iter().copied().chain([object]).collect())
        };
        all.iter().flat_map(longer).collect()
    })
}
