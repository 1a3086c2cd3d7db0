//! Compiles preferences and constraints of PDDL3 away, for searches that know only a goal and
//! costs.
//!
//! - A constraint becomes an automaton ([`Automaton`]) with flag facts as its state. An action that
//!   may change the constraint's conditions updates the flags from the state right before its
//!   effects; the goal checks the last state.
//! - A `within` constraint becomes a witness action, which must be applied while the condition
//!   holds and before the deadline.
//! - A preference becomes two actions: a free one for a satisfied preference, and one that pays for
//!   a violated one (Keyder and Geffner 2009, "Soft goals can be compiled away"). They follow the
//!   last action of the plan, preference by preference in a fixed order, so that their order needs
//!   no search.
//! - An action with preferences of its own becomes several copies: in a copy, each preference is
//!   either a condition or paid for.

pub(super) mod conditions;
mod touch;

use rustc_hash::FxHashMap;

use crate::diagnostic::Span;
use crate::model::automaton::{AT_END, Automaton, Cases, Literal};
use crate::model::walk::{self, Part};
use crate::plan::EPSILON_S;
use crate::task::{
    Action, Assignment, Atom, Change, Condition, Effect, Expression, Fact, Fluent, Function, FunctionId,
    GroundChange, GroundFluent, Modal, Object, ObjectId, Parameter, Predicate, PredicateId, PreferenceId,
    PreferredGoal, Quantified, Rule, Task, Term, Timed, TimedInitial, Trajectory, TypeId,
};

use conditions::{Fixed, all, any, each_binding, is_false, negated, words};
use touch::Mentioned;

/// Name of the action that observes the condition of a `within` constraint before the deadline; its
/// span is the constraint's.
pub(crate) const WITNESS: &str = "see it";
/// Maximum number of preferences of one action that are compiled into copies of the action.
const MOST_OF_AN_ACTION: usize = 3;

/// Task whose preferences and constraints are compiled away.
pub(crate) struct Compiled {
    /// Compiled task. Actions with a blank in their names are bookkeeping, no steps of a plan.
    pub task: Task,
    /// True if a preference that the metric counts could not be compiled and was left out.
    pub forgets: bool,
    /// True if there are preferences and the metric counts none of them.
    pub uncounted: bool,
}

/// Compiles the preferences and constraints of a task away; `None` if the task has neither.
pub(crate) fn compile(task: &Task) -> Option<Compiled> {
    if task.constraints.is_empty() && task.preferences.is_empty() {
        return None;
    }
    let mut compiler = Compiler::new(task);
    for (action, own) in task.actions.iter().enumerate() {
        compiler.action_preferences(action, own);
    }
    for constraint in &task.constraints {
        let Trajectory { operator, times_s, preference, .. } = constraint;
        let asked = match (Automaton::of(*operator), operator, &times_s[..]) {
            (Some(automaton), ..) => Asked::States(automaton),
            (None, Modal::Within, [time_s]) if task.is_temporal() => Asked::Within(*time_s),
            _ => {
                compiler.forget(*preference);
                continue;
            }
        };
        let Trajectory { forall, conditions, slots, span, .. } = constraint;
        compiler.instances(asked, *span, (forall, *slots), conditions, *preference);
    }
    for (preference, own) in (0..).map(PreferenceId).zip(&task.preferences) {
        for PreferredGoal { forall, condition, slots, .. } in &own.goals {
            let conditions = std::slice::from_ref(condition);
            compiler.instances(
                Asked::States(&AT_END),
                Span::default(),
                (forall, *slots),
                conditions,
                Some(preference),
            );
        }
    }
    Some(compiler.finish())
}

/// Demand of a constraint on the states of a plan.
#[derive(Debug, Clone, Copy)]
enum Asked {
    /// The sequence of states is accepted by an automaton.
    States(&'static Automaton),
    /// The condition is true at some time up to this one, seconds.
    Within(f64),
}

/// Constraint or preference whose quantified variables are bound to objects.
struct Stated {
    asked: Asked,
    span: Span,
    conditions: Vec<Condition>,
    preference: Option<PreferenceId>,
}

/// Bound constraint or preference that is compiled into an automaton with flag facts.
struct Instance {
    automaton: &'static Automaton,
    /// The two conditions that the automaton reads. Where numbers are compared, each is replaced by
    /// a derived fact.
    conditions: [Condition; 2],
    /// Facts that hold the automaton's state, then one that records a violation if violations are
    /// allowed.
    flags: Vec<Condition>,
    preference: Option<PreferenceId>,
}

impl Instance {
    fn literal(&self, literal: &Literal) -> Condition {
        let (condition, wanted) = match *literal {
            Literal::First(wanted) => (&self.conditions[0], wanted),
            Literal::Second(wanted) => (&self.conditions[1], wanted),
            Literal::Flag(flag, wanted) => (&self.flags[flag], wanted),
        };
        if wanted { condition.clone() } else { negated(condition) }
    }

    fn case(&self, case: &[Literal]) -> Condition {
        all(case.iter().map(|literal| self.literal(literal)))
    }

    fn cases(&self, cases: Cases) -> Condition {
        any(cases.iter().map(|case| self.case(case)))
    }

    /// Fact that records a violation of the instance; `None` if violations are forbidden or
    /// impossible before the last state.
    fn was_broken(&self) -> Option<&Condition> {
        self.flags.get(self.automaton.flags)
    }

    /// Condition on the last state under which the instance is satisfied.
    fn kept(&self) -> Condition {
        let broken = any([self.cases(self.automaton.broken), self.cases(self.automaton.open)]);
        all(self.was_broken().map(negated).into_iter().chain([negated(&broken)]))
    }
}

struct Compiler<'t> {
    task: &'t Task,
    made: Task,
    fixed: Fixed,
    /// Function that counts the violations of each preference; `None` if the metric does not
    /// mention it.
    counters: Vec<Option<FunctionId>>,
    /// Index of each distinct instance in `instances`, by its canonical text and preference.
    said: FxHashMap<(String, Option<PreferenceId>), usize>,
    instances: Vec<(Stated, f64)>,
    /// Preferences to be decided in the last state: the weight of a violation, and the condition
    /// under which there is none.
    kept: Vec<(PreferenceId, f64, Condition)>,
    /// Number of unavoidable violations, by preference.
    lost: FxHashMap<PreferenceId, f64>,
    goal: Vec<Condition>,
    forgets: bool,
}

impl<'t> Compiler<'t> {
    fn new(task: &'t Task) -> Compiler<'t> {
        let mut made = task.clone();
        made.constraints.clear();
        made.preferences.clear();
        for action in &mut made.actions {
            action.preferences.clear();
        }
        let mut compiler = Compiler {
            task,
            made,
            fixed: Fixed::new(task),
            counters: vec![None; task.preferences.len()],
            said: FxHashMap::default(),
            instances: Vec::new(),
            kept: Vec::new(),
            lost: FxHashMap::default(),
            goal: vec![task.goal.body.clone()],
            forgets: false,
        };
        compiler.count_violations();
        compiler
    }

    /// Adds a counter function for each preference in the metric, and replaces the violation counts
    /// in the metric by these.
    fn count_violations(&mut self) {
        let Some(metric) = &self.task.metric else { return };
        walk::expression(&metric.value, &mut |part| {
            if let Part::Expression(Expression::Violated(id)) = part
                && self.counters[id.index()].is_none()
            {
                let name = format!("violations of {}", self.task.preferences[id.index()].name);
                self.counters[id.index()] = Some(function(&mut self.made, name));
            }
        });
        let counters = &self.counters;
        if let Some(metric) = &mut self.made.metric {
            let counted = walk::replaced(&metric.value, &|part| match part {
                Expression::Violated(id) => counters[id.index()].map(counted),
                _ => None,
            });
            // Violations are costs.
            metric.value = if metric.minimise { counted } else { Expression::Negative(Box::new(counted)) };
            metric.minimise = true;
        }
    }

    /// Records that a preference of the metric was left out.
    fn forget(&mut self, preference: Option<PreferenceId>) {
        self.forgets |= preference.is_some_and(|id| self.counters[id.index()].is_some());
    }

    fn predicate(&mut self, name: &str, parameters: Vec<Parameter>) -> PredicateId {
        let id = PredicateId(self.made.predicates.len() as u32);
        let (name, span) = (name.to_string(), Span::default());
        self.made.predicates.push(Predicate { name, parameters, stratum: None, span });
        id
    }

    fn fact(&mut self, name: &str) -> Condition {
        Condition::Atom(atom(self.predicate(name, Vec::new()), &[]))
    }

    /// Adds all instances of a constraint or preference; equal ones are merged and counted.
    fn instances(
        &mut self,
        asked: Asked,
        span: Span,
        (forall, slots): (&[Quantified], usize),
        conditions: &[Condition],
        preference: Option<PreferenceId>,
    ) {
        if preference.is_some_and(|id| self.counters[id.index()].is_none()) {
            return;
        }
        each_binding(forall, &mut vec![None; slots], &mut |binding| {
            let ground = |condition| self.fixed.ground(condition, binding);
            let conditions: Vec<Condition> = conditions.iter().map(ground).collect();
            let words: Vec<String> = conditions.iter().map(words).collect();
            let key = (format!("{asked:?}{words:?}"), preference);
            let number = *self.said.entry(key).or_insert(self.instances.len());
            match self.instances.get_mut(number) {
                Some((_, times)) => *times += 1.0,
                None => self.instances.push((Stated { asked, span, conditions, preference }, 1.0)),
            }
        });
    }

    fn instance(&mut self, Stated { asked, span, conditions, preference }: Stated, times: f64) {
        let task = self.task;
        // What comes about by itself may still do so after the last action of a plan.
        if preference.is_some() && !task.init.timed.is_empty() {
            return self.forget(preference);
        }
        let automaton = match asked {
            Asked::States(automaton) => automaton,
            Asked::Within(time_s) => {
                let kept = self.witnessed(time_s, span, all(conditions));
                return self.ask(kept, preference, times);
            }
        };
        let mentioned = Mentioned::of(task, &conditions);
        if mentioned.opaque || mentioned.drifts(task) {
            return self.forget(preference);
        }
        let mut conditions = conditions.into_iter().chain([Condition::TRUE, Condition::TRUE]);
        let mut next = || conditions.next().unwrap_or_default();
        let mut conditions = [next(), next()];
        if mentioned.compares {
            conditions = conditions.map(|condition| self.derived(condition));
        }
        let may_break = !automaton.broken.is_empty() && preference.is_some();
        let flags = 0..automaton.flags + usize::from(may_break);
        let flags = flags.map(|_| self.fact("seen on the way")).collect();
        let instance = Instance { automaton, conditions, flags, preference };
        if automaton.flags > 0 || !automaton.broken.is_empty() {
            for index in 0..task.actions.len() {
                self.watch(&instance, &mentioned, index);
            }
        }
        self.ask(instance.kept(), preference, times);
    }

    /// Requires the condition `kept` of the last state: as a goal, or as a preference that counts
    /// `times`.
    fn ask(&mut self, kept: Condition, preference: Option<PreferenceId>, times: f64) {
        match preference {
            None => self.goal.push(kept),
            Some(id) if is_false(&kept) => *self.lost.entry(id).or_default() += times,
            Some(_) if kept.is_true() => {}
            Some(id) => self.kept.push((id, times, kept)),
        }
    }

    /// Fact that a witness action has observed the condition by the time `time_s`, seconds; adds
    /// that action.
    fn witnessed(&mut self, time_s: f64, span: Span, condition: Condition) -> Condition {
        let (seen, early) = (self.fact("seen in time"), self.fact("early"));
        let (Condition::Atom(own), Condition::Atom(early_atom)) = (&seen, &early) else { return seen };
        let early_fact = Fact { predicate: early_atom.predicate, arguments: Box::new([]) };
        let init = &mut self.made.init;
        init.facts.push(early_fact.clone());
        // Who sees what comes about at the very last moment does so after it, and before it is too late.
        let time_s = time_s + 2.0 * EPSILON_S;
        let late = TimedInitial { time_s, change: GroundChange::Delete(early_fact), span: Span::default() };
        init.timed.insert(init.timed.partition_point(|timed| timed.time_s <= time_s), late);
        let effects = vec![effect(Change::Add(own.clone()), Condition::TRUE, false)];
        let witness = bookkeeping(WITNESS, all([early, condition]), effects);
        self.made.actions.push(Action { span, ..witness });
        seen
    }

    /// Derived fact that stands for a condition, whose negation cannot be expressed directly.
    fn derived(&mut self, condition: Condition) -> Condition {
        if condition.is_true() {
            return condition;
        }
        let predicate = self.predicate("holds", Vec::new());
        let stratum = self.made.predicates.iter().filter_map(|own| own.stratum).max();
        self.made.predicates[predicate.index()].stratum = Some(stratum.map_or(0, |top| top + 1));
        let (parameters, span) = (Vec::new(), Span::default());
        self.made.rules.push(Rule { predicate, parameters, slots: 0, body: condition, span });
        Condition::Atom(atom(predicate, &[]))
    }

    /// Adds the automaton's transitions to an action, evaluated right before the action's effects.
    fn watch(&mut self, instance: &Instance, mentioned: &Mentioned, index: usize) {
        let own = &self.task.actions[index];
        let start = mentioned.touched(own, &own.effects.start);
        let end = mentioned.touched(own, &own.effects.end);
        let copies =
            self.made.actions.iter_mut().filter(|made| made.span == own.span && made.name == own.name);
        for made in copies {
            look(instance, &start, &mut made.condition.start, &mut made.effects.start, false);
            look(instance, &end, &mut made.condition.end, &mut made.effects.end, true);
        }
    }
}

/// Adds to an action's start or end the conditions and effects that an instance needs where the
/// action affects it.
fn look(
    instance: &Instance,
    touched: &Condition,
    condition: &mut Condition,
    effects: &mut Vec<Effect>,
    at_end: bool,
) {
    if is_false(touched) {
        return;
    }
    let mut set = |fact: &Condition, raised: bool, when: Condition| {
        let Condition::Atom(fact) = fact else { return };
        if !is_false(&when) {
            let change = if raised { Change::Add(fact.clone()) } else { Change::Delete(fact.clone()) };
            effects.push(effect(change, when, at_end));
        }
    };
    for (flag, raised, case) in instance.automaton.changes {
        set(&instance.flags[*flag], *raised, all([touched.clone(), instance.case(case)]));
    }
    let broken = instance.cases(instance.automaton.broken);
    match (instance.was_broken(), instance.preference) {
        (Some(fact), _) => set(fact, true, all([touched.clone(), broken])),
        (None, None) => {
            let kept = any([negated(touched), negated(&broken)]);
            *condition = all([std::mem::take(condition), kept]);
        }
        (None, Some(_)) => {}
    }
}

impl Compiler<'_> {
    /// Replaces an action with preferences by copies, one for each choice of preferences that it
    /// violates.
    fn action_preferences(&mut self, index: usize, own: &Action) {
        let mut parts: Vec<(FunctionId, bool, &Condition)> = Vec::new();
        for (id, Timed { start, over_all, end }) in &own.preferences {
            let Some(counter) = self.counters[id.index()] else { continue };
            let mut exact = over_all.is_true();
            for (condition, at_end) in [(start, false), (end, true)].into_iter().filter(|p| !p.0.is_true()) {
                walk::condition(condition, &mut |part| {
                    exact &= !matches!(part, Part::Condition(Condition::Compare(..)));
                });
                parts.push((counter, at_end, condition));
            }
            self.forgets |= !exact;
            parts.retain(|part| exact || part.0 != counter);
        }
        if parts.len() > MOST_OF_AN_ACTION {
            self.forgets = true;
            return;
        }
        let plain = self.made.actions[index].clone();
        for paid in 0..1usize << parts.len() {
            let mut copy = plain.clone();
            for (number, &(counter, at_end, condition)) in parts.iter().enumerate() {
                let pays = paid >> number & 1 == 1;
                let asked = if pays { negated(condition) } else { condition.clone() };
                let place = if at_end { &mut copy.condition.end } else { &mut copy.condition.start };
                *place = all([std::mem::take(place), asked]);
                if pays {
                    let effects = if at_end { &mut copy.effects.end } else { &mut copy.effects.start };
                    effects.push(pay(counter, 1.0, at_end));
                }
            }
            match paid {
                0 => self.made.actions[index] = copy,
                _ => self.made.actions.push(copy),
            }
        }
    }

    fn finish(mut self) -> Compiled {
        for (stated, times) in std::mem::take(&mut self.instances) {
            self.instance(stated, times);
        }
        self.steps_for_time();
        if !self.kept.is_empty() || !self.lost.is_empty() {
            self.last_stage();
        }
        self.made.goal.body = all(self.goal);
        let uncounted = self.counters.iter().all(Option::is_none) && !self.counters.is_empty();
        Compiled { task: self.made, forgets: self.forgets, uncounted }
    }

    /// Adds the bookkeeping actions that follow the last action of a plan.
    fn last_stage(&mut self) {
        let at_work = self.fact("at work");
        for action in &mut self.made.actions {
            let start = std::mem::take(&mut action.condition.start);
            action.condition.start = all([at_work.clone(), start]);
            if action.is_durative() {
                let end = std::mem::take(&mut action.condition.end);
                action.condition.end = all([at_work.clone(), end]);
            }
        }
        if let Condition::Atom(at_work) = &at_work {
            let fact = Fact { predicate: at_work.predicate, arguments: Box::new([]) };
            self.made.init.facts.push(fact);
        }
        let turns = self.turns();
        let mut lost: Vec<_> = std::mem::take(&mut self.lost).into_iter().collect();
        lost.sort_unstable_by_key(|(id, _)| *id);
        let paid = lost.into_iter().filter_map(|(id, times)| Some((self.counters[id.index()]?, times)));
        let paid: Vec<Effect> = paid.map(|(counter, times)| pay(counter, times, false)).collect();
        let condition = all([at_work.clone()].into_iter().chain(self.goal.iter().cloned()));
        let effects = from_to(&at_work, &turns[0]).into_iter().chain(paid).collect();
        let end = Action { slots: self.task.goal.slots, ..bookkeeping("end of plan", condition, effects) };
        // From the last one: so grounding goes back from the goal in one go.
        let kept = std::mem::take(&mut self.kept);
        for (turn, (id, times, kept)) in turns.windows(2).zip(kept).rev() {
            let step = from_to(&turn[0], &turn[1]);
            let violated = all([turn[0].clone(), negated(&kept)]);
            let kept = all([turn[0].clone(), kept]);
            self.made.actions.push(bookkeeping("keep it", kept, step.clone()));
            let paid = self.counters[id.index()].map(|counter| pay(counter, times, false));
            let step = step.into_iter().chain(paid).collect();
            self.made.actions.push(bookkeeping("give it up", violated, step));
        }
        self.made.actions.push(end);
        self.goal.extend(turns.last().cloned());
    }

    /// Facts that mark the stages of bookkeeping: one before each preference and one after the
    /// last. Exactly one holds at a time.
    fn turns(&mut self) -> Vec<Condition> {
        let (types, objects, span) = (vec![TypeId(0)], Vec::new().into(), Span::default());
        let parameter = Parameter { name: "?stage".to_string(), types: types.clone(), objects, span };
        let turn = self.predicate("turn", vec![parameter]);
        let stage = |number: usize| {
            let id = ObjectId(self.made.objects.len() as u32);
            self.made.objects.push(Object { name: format!("stage {number}"), types: types.clone(), span });
            Condition::Atom(atom(turn, &[id]))
        };
        (0..=self.kept.len()).map(stage).collect()
    }

    /// Replaces the total time in the metric by the number of steps, for tasks without durations;
    /// bookkeeping actions do not count.
    fn steps_for_time(&mut self) {
        let mut timed = false;
        let metric = self.made.metric.iter();
        metric.for_each(|metric| {
            walk::expression(&metric.value, &mut |part| {
                timed |= matches!(part, Part::Expression(Expression::TotalTime));
            });
        });
        if !timed || self.task.is_temporal() {
            return;
        }
        let steps = function(&mut self.made, "steps".to_string());
        for action in &mut self.made.actions {
            action.effects.start.push(pay(steps, 1.0, false));
        }
        if let Some(metric) = &mut self.made.metric {
            let count = |part: &Expression| matches!(part, Expression::TotalTime).then(|| counted(steps));
            metric.value = walk::replaced(&metric.value, &count);
        }
    }
}

/// Adds a numeric function without parameters and with initial value 0.
fn function(task: &mut Task, name: String) -> FunctionId {
    let function = FunctionId(task.functions.len() as u32);
    task.functions.push(Function { name, parameters: Vec::new(), result: None, span: Span::default() });
    task.init.numbers.push((GroundFluent { function, arguments: Box::new([]) }, 0.0));
    function
}

fn fluent(function: FunctionId) -> Fluent {
    Fluent { function, arguments: Vec::new(), span: Span::default() }
}

fn counted(function: FunctionId) -> Expression {
    Expression::Fluent(fluent(function))
}

fn atom(predicate: PredicateId, arguments: &[ObjectId]) -> Atom {
    let arguments = arguments.iter().map(|&object| Term::Object(object)).collect();
    Atom { predicate, arguments, span: Span::default() }
}

fn effect(change: Change, when: Condition, at_end: bool) -> Effect {
    let (start, end) = if at_end { (Condition::TRUE, when) } else { (when, Condition::TRUE) };
    let when = Timed { start, over_all: Condition::TRUE, end };
    Effect { forall: Vec::new(), when, change, span: Span::default() }
}

fn pay(counter: FunctionId, times: f64, at_end: bool) -> Effect {
    let change = Change::Number(Assignment::Increase, fluent(counter), Expression::Number(times));
    effect(change, Condition::TRUE, at_end)
}

/// Effects that replace one fact by another.
fn from_to(from: &Condition, to: &Condition) -> Vec<Effect> {
    let (Condition::Atom(from), Condition::Atom(to)) = (from, to) else { return Vec::new() };
    let changes = [Change::Delete(from.clone()), Change::Add(to.clone())];
    changes.map(|change| effect(change, Condition::TRUE, false)).into()
}

fn bookkeeping(name: &str, condition: Condition, effects: Vec<Effect>) -> Action {
    Action {
        name: name.to_string(),
        parameters: Vec::new(),
        slots: 0,
        duration: None,
        condition: Timed { start: condition, ..Timed::default() },
        effects: Timed { start: effects, ..Timed::default() },
        continuous: Vec::new(),
        grounding: Vec::new(),
        preferences: Vec::new(),
        span: Span::default(),
    }
}
