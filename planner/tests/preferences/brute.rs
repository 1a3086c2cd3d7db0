//! Random tasks of four facts, and every plan of a few steps judged by the words of Gerevini and Long (2005).

use std::fmt::Write;

use descry_planner::{Attachments, Options, Outcome, Plan, Source, Task, plan};

/// Steps of the plans that are tried.
const MOST_STEPS: usize = 5;
const OBJECTS: [&str; 3] = ["a", "b", "c"];

/// Random numbers (xorshift).
struct Chance(u64);

impl Chance {
    fn below(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as usize % count
    }
}

/// A condition over `(p a)`, `(p b)`, `(p c)` and `(q)`, or over `(p ?x)`.
#[derive(Debug, Clone)]
enum Formula {
    P(usize, bool),
    /// Atom of the action's or constraint's own variable.
    Own(bool),
    Q(bool),
    And(Vec<Formula>),
    Or(Vec<Formula>),
    All,
    Some,
}

impl Formula {
    fn random(chance: &mut Chance, depth: usize, own: bool) -> Formula {
        match chance.below(if depth == 0 { 4 } else { 8 }) {
            0 => Formula::Q(chance.below(2) == 0),
            1 if own => Formula::Own(chance.below(2) == 0),
            2 if own => Formula::Own(true),
            1..=3 => Formula::P(chance.below(3), chance.below(2) == 0),
            4 => Formula::All,
            5 => Formula::Some,
            kind => {
                let parts = (0..2).map(|_| Formula::random(chance, depth - 1, own)).collect();
                if kind == 6 { Formula::And(parts) } else { Formula::Or(parts) }
            }
        }
    }

    fn holds(&self, state: u8, own: usize) -> bool {
        let bit = |number: usize| state >> number & 1 == 1;
        match self {
            Formula::P(object, wanted) => bit(*object) == *wanted,
            Formula::Own(wanted) => bit(own) == *wanted,
            Formula::Q(wanted) => bit(3) == *wanted,
            Formula::And(parts) => parts.iter().all(|part| part.holds(state, own)),
            Formula::Or(parts) => parts.iter().any(|part| part.holds(state, own)),
            Formula::All => state & 7 == 7,
            Formula::Some => state & 7 != 0,
        }
    }

    fn text(&self) -> String {
        let literal = |text: String, wanted: bool| if wanted { text } else { format!("(not {text})") };
        let list = |parts: &[Formula]| parts.iter().map(Formula::text).collect::<Vec<_>>().join(" ");
        match self {
            Formula::P(object, wanted) => literal(format!("(p {})", OBJECTS[*object]), *wanted),
            Formula::Own(wanted) => literal("(p ?x)".into(), *wanted),
            Formula::Q(wanted) => literal("(q)".into(), *wanted),
            Formula::And(parts) => format!("(and {})", list(parts)),
            Formula::Or(parts) => format!("(or {})", list(parts)),
            Formula::All => "(every)".into(),
            Formula::Some => "(exists (?y - thing) (p ?y))".into(),
        }
    }
}

/// An action with one parameter, or none where nothing mentions it.
#[derive(Debug)]
struct Action {
    condition: Formula,
    /// Condition of the action's preference, which is violated where it does not hold.
    preferred: Option<Formula>,
    /// Literals that become true, each under a condition.
    effects: Vec<(Formula, Formula)>,
}

#[derive(Debug)]
struct Constraint {
    operator: &'static str,
    conditions: Vec<Formula>,
    /// Index of its preference, if it is one.
    preference: Option<usize>,
    forall: bool,
}

const OPERATORS: [&str; 6] =
    ["at end", "always", "sometime", "at-most-once", "sometime-after", "sometime-before"];
const PREFERENCES: usize = 3;

#[derive(Debug)]
struct Made {
    initial: u8,
    actions: Vec<Action>,
    goal: Formula,
    constraints: Vec<Constraint>,
    /// Weight of each preference, the last being that of actions.
    weights: [usize; PREFERENCES + 1],
    per_step: usize,
}

fn literal(chance: &mut Chance) -> Formula {
    Formula::random(chance, 0, true)
}

fn make(chance: &mut Chance) -> Made {
    let action = |chance: &mut Chance| Action {
        condition: Formula::random(chance, 1, true),
        preferred: (chance.below(4) == 0).then(|| Formula::random(chance, 1, true)),
        effects: (0..1 + chance.below(2))
            .map(|_| {
                let always = Formula::And(Vec::new());
                let when = if chance.below(4) == 0 { Formula::random(chance, 0, true) } else { always };
                (when, literal(chance))
            })
            .collect(),
    };
    let constraint = |chance: &mut Chance| {
        let operator = OPERATORS[chance.below(OPERATORS.len())];
        let forall = chance.below(3) == 0;
        let two = matches!(operator, "sometime-after" | "sometime-before");
        Constraint {
            operator,
            conditions: (0..1 + usize::from(two)).map(|_| Formula::random(chance, 1, forall)).collect(),
            preference: (chance.below(3) > 0).then(|| chance.below(PREFERENCES)),
            forall,
        }
    };
    Made {
        initial: chance.below(16) as u8,
        actions: (0..2 + chance.below(2)).map(|_| action(chance)).collect(),
        goal: Formula::random(chance, 1, false),
        constraints: (0..1 + chance.below(4)).map(|_| constraint(chance)).collect(),
        weights: [0; PREFERENCES + 1].map(|_| chance.below(5)),
        per_step: chance.below(2),
    }
}

impl Made {
    fn texts(&self) -> (String, String) {
        let mut domain =
            "(define (domain d) (:requirements :adl :preferences :constraints :derived-predicates)
  (:types thing) (:constants a b c - thing) (:predicates (p ?x - thing) (q) (every))
  (:derived (every) (forall (?y - thing) (p ?y)))"
                .to_string();
        for (number, action) in self.actions.iter().enumerate() {
            let preferred =
                action.preferred.iter().map(|preferred| format!("(preference own {})", preferred.text()));
            let effects =
                action.effects.iter().map(|(when, then)| format!("(when {} {})", when.text(), then.text()));
            let (preferred, effects): (String, String) = (preferred.collect(), effects.collect());
            let condition = action.condition.text();
            let _ = write!(
                domain,
                "\n  (:action a{number} :parameters (?x - thing) :precondition (and {condition} {preferred}) :effect (and {effects}))"
            );
        }
        let mut facts: String = (0..3)
            .filter(|bit| self.initial >> bit & 1 == 1)
            .map(|bit| format!("(p {})", OBJECTS[bit]))
            .collect();
        if self.initial & 8 != 0 {
            facts.push_str("(q)");
        }
        let constraints: String = self.constraints.iter().map(Constraint::text).collect();
        let own = self.actions.iter().any(|action| action.preferred.is_some());
        let used = |name: usize| match name {
            PREFERENCES => own,
            name => self.constraints.iter().any(|constraint| constraint.preference == Some(name)),
        };
        let names = ["p0", "p1", "p2", "own"];
        let violated = (0..=PREFERENCES)
            .filter(|&name| used(name))
            .map(|name| format!("(* {} (is-violated {}))", self.weights[name], names[name]));
        let violated: String = violated.collect();
        let problem = format!(
            "(define (problem p) (:domain d) (:init {facts}) (:goal {}) (:constraints (and {constraints}))
  (:metric minimize (+ (* {} (total-time)) {violated})))",
            self.goal.text(),
            self.per_step
        );
        (domain + ")", problem)
    }

    fn next(&self, state: u8, (action, own): (usize, usize)) -> Option<u8> {
        let action = &self.actions[action];
        let (mut adds, mut deletes) = (0u8, 0u8);
        for (_, then) in action.effects.iter().filter(|(when, _)| when.holds(state, own)) {
            let (bit, added) = match then {
                Formula::P(object, added) => (*object, *added),
                Formula::Own(added) => (own, *added),
                Formula::Q(added) => (3, *added),
                other => unreachable!("{other:?} is no literal"),
            };
            *(if added { &mut adds } else { &mut deletes }) |= 1 << bit;
        }
        action.condition.holds(state, own).then_some(state & !deletes | adds)
    }

    /// Value of a plan; `None` where it is no plan.
    fn value(&self, steps: &[(usize, usize)]) -> Option<f64> {
        let mut states = vec![self.initial];
        let mut value = steps.len() * self.per_step;
        for &step in steps {
            let state = states[states.len() - 1];
            states.push(self.next(state, step)?);
            let violated =
                self.actions[step.0].preferred.as_ref().is_some_and(|own| !own.holds(state, step.1));
            value += usize::from(violated) * self.weights[PREFERENCES];
        }
        for constraint in &self.constraints {
            for own in 0..if constraint.forall { 3 } else { 1 } {
                match constraint.preference {
                    _ if constraint.kept(&states, own) => {}
                    Some(name) => value += self.weights[name],
                    None => return None,
                }
            }
        }
        self.goal.holds(states[states.len() - 1], 0).then_some(value as f64)
    }

    /// Best value of the plans that begin so and have at most so many steps more.
    fn best(&self, steps: &mut Vec<(usize, usize)>, state: u8, left: usize) -> Option<f64> {
        let mut best = self.value(steps);
        if left == 0 {
            return best;
        }
        for action in 0..self.actions.len() {
            for own in 0..3 {
                let Some(next) = self.next(state, (action, own)) else { continue };
                steps.push((action, own));
                let found = self.best(steps, next, left - 1);
                steps.pop();
                best = best.into_iter().chain(found).reduce(f64::min);
            }
        }
        best
    }
}

impl Constraint {
    fn text(&self) -> String {
        let conditions: Vec<String> = self.conditions.iter().map(Formula::text).collect();
        let inner = format!("({} {})", self.operator, conditions.join(" "));
        let inner = match self.preference {
            Some(name) => format!("(preference p{name} {inner})"),
            None => inner,
        };
        if self.forall { format!("(forall (?x - thing) {inner})") } else { inner }
    }

    /// True if the constraint holds on a sequence of states.
    fn kept(&self, states: &[u8], own: usize) -> bool {
        let first = |at: usize| self.conditions[0].holds(states[at], own);
        let second = |at: usize| self.conditions[1].holds(states[at], own);
        let (last, mut all) = (states.len() - 1, 0..states.len());
        match self.operator {
            "at end" => first(last),
            "always" => all.all(first),
            "sometime" => all.any(first),
            "at-most-once" => all.filter(|&at| first(at) && (at == 0 || !first(at - 1))).count() <= 1,
            "sometime-after" => all.all(|at| !first(at) || (at..=last).any(second)),
            _ => all.all(|at| !first(at) || (0..at).any(second)),
        }
    }
}

/// Counts of the results of the tasks that were compared.
#[derive(Debug, Default)]
pub struct Tally {
    pub tasks: u64,
    pub solved: u64,
    pub unsolvable: u64,
    /// Proven best.
    pub optimal: u64,
}

fn steps(plan: &Plan) -> Vec<(usize, usize)> {
    let object = |name: &str| OBJECTS.iter().position(|own| *own == name).expect("one of three");
    let number = |name: &str| name[1..].parse().expect("a number after the letter");
    plan.steps.iter().map(|step| (number(&step.action), object(&step.arguments[0]))).collect()
}

fn compare(seed: u64, tally: &mut Tally) {
    let mut chance = Chance(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    // The first ones of neighbouring seeds are alike.
    (0..8).for_each(|_| chance.0 ^= chance.below(2) as u64);
    let made = make(&mut chance);
    let (domain, problem) = made.texts();
    let task = Task::read(&Source::new("domain", domain.as_str()), &Source::new("problem", problem.as_str()));
    let task = task.unwrap_or_else(|findings| panic!("{seed}: {}", findings.render(false)));
    let options = Options { anytime: chance.below(4) > 0, ..Options::default() };
    let outcome = plan(&task, &Attachments::new(), &options, &|| false, &mut |_| {});
    let outcome = outcome.unwrap_or_else(|error| panic!("{seed}: {error}\n{domain}\n{problem}"));
    let best = made.best(&mut Vec::new(), made.initial, MOST_STEPS);
    let said = || format!("{seed}: best {best:?}, {outcome:?}\n{domain}\n{problem}");
    tally.tasks += 1;
    match &outcome {
        Outcome::Solved { plan, statistics } => {
            let own = made.value(&steps(plan));
            assert_eq!(own, plan.cost, "the value of the plan, {}", said());
            let short = plan.steps.len() <= MOST_STEPS;
            let sure = statistics.optimal || options.anytime;
            assert!(!sure || short && own == best || !short && (best.is_none() || own <= best), "{}", said());
            tally.solved += 1;
            tally.optimal += u64::from(statistics.optimal);
        }
        Outcome::Unsolvable { .. } => {
            assert_eq!(best, None, "{}", said());
            tally.unsolvable += 1;
        }
        _ => panic!("neither: {}", said()),
    }
}

pub fn compare_all(seeds: impl Iterator<Item = u64>) -> Tally {
    let mut tally = Tally::default();
    seeds.for_each(|seed| compare(seed, &mut tally));
    tally
}
