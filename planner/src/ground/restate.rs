//! Reuse of a grounded task for another initial state or another goal.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::model::relation::Relation;
use crate::task::{Condition, Expression, Fact, Fluent, GroundFluent, Init, ObjectId, Scoped, Task, Term};
use crate::task::{FunctionId, PredicateId, TimedInitial};

use super::assemble::derive_initial;
use super::task::{Conjunction, GroundComparison, GroundExpression, GroundFact, GroundTask, Meaning, Values};

/// Reason why a changed problem had to be grounded again.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Regrounded {
    /// There was no grounded task yet.
    #[error("it was not grounded before")]
    First,
    /// This fact is not part of the grounded task (no action changes it, or it was unreachable) and
    /// has changed.
    #[error("{0} was taken for granted or was out of reach")]
    Fact(String),
    /// This number is not part of the grounded task and has changed, or has become defined or
    /// undefined.
    #[error("the value of {0} was taken for granted")]
    Number(String),
    /// The object function has changed to a value that was unreachable, or is not part of the
    /// grounded task.
    #[error("the value of {0} was taken for granted or was out of reach")]
    Object(String),
    /// The present facts contradict a mutex group of the grounded task, or a variable without a
    /// "none" value has none of its values.
    #[error("facts hold together, or are all false, that never were")]
    Exclusive,
    /// Timed literals have changed.
    #[error("other things happen by themselves at a time")]
    Timed,
    /// The new goal asks for more than a conjunction of facts and numeric comparisons of the
    /// grounded task.
    #[error("the goal asks for more than facts and numbers that are part of the grounded task")]
    Goal,
    /// The task has constraints or preferences, which are compiled into the grounded actions.
    #[error("it has constraints or preferences")]
    Soft,
    /// No plan was found; explanations need a task grounded for the present state.
    #[error("there was no plan, and the reason is sought anew")]
    NoPlan,
}

/// Grounded task that can be moved to other states of the lifted task.
pub(crate) struct Restated {
    pub ground: GroundTask,
    facts: FxHashMap<Fact, GroundFact>,
    objects: FxHashMap<GroundFluent, FxHashMap<ObjectId, GroundFact>>,
    numbers: FxHashMap<GroundFluent, u32>,
    /// Initial facts that are not part of the grounded task and must stay as they are.
    granted_facts: FxHashSet<Fact>,
    /// Initial numbers that are not part of the grounded task and must stay as they are.
    granted_numbers: FxHashMap<GroundFluent, f64>,
    /// Initial values of object functions that are not part of the grounded task and must stay as they
    /// are.
    granted_objects: FxHashMap<GroundFluent, ObjectId>,
    timed: Vec<TimedInitial>,
    goal: Scoped<Condition>,
}

fn ids(arguments: &[u32]) -> Box<[ObjectId]> {
    arguments.iter().map(|&object| ObjectId(object)).collect()
}

impl Restated {
    /// Takes a task that was grounded with [`super::Keep::All`].
    pub fn new(task: &Task, ground: GroundTask) -> Restated {
        let (mut facts, mut objects) = (FxHashMap::default(), FxHashMap::default());
        for (variable, own) in (0..).zip(&ground.variables) {
            for (value, meaning) in (0..).zip(&own.values) {
                let fact = GroundFact { variable, value };
                match meaning {
                    Meaning::Atom { predicate, arguments } => {
                        let predicate = PredicateId(*predicate);
                        facts.insert(Fact { predicate, arguments: ids(arguments) }, fact);
                    }
                    Meaning::Object { fluent, arguments, value: Some(value) } => {
                        let fluent =
                            GroundFluent { function: FunctionId(*fluent), arguments: ids(arguments) };
                        let values: &mut FxHashMap<_, _> = objects.entry(fluent).or_default();
                        values.insert(ObjectId(*value), fact);
                    }
                    _ => {}
                }
            }
        }
        let fluents = ground
            .numerics
            .iter()
            .map(|own| GroundFluent { function: FunctionId(own.function), arguments: ids(&own.arguments) });
        let numbers: FxHashMap<GroundFluent, u32> = fluents.zip(0..).collect();
        let Init { facts: held, numbers: valued, objects: named, .. } = &task.init;
        let granted_facts = held.iter().filter(|fact| !facts.contains_key(fact)).cloned().collect();
        let granted_numbers = valued.iter().filter(|(own, _)| !numbers.contains_key(own)).cloned().collect();
        let granted_objects = named.iter().filter(|(own, _)| !objects.contains_key(own)).cloned().collect();
        let (timed, goal) = (task.init.timed.clone(), task.goal.clone());
        Restated {
            ground,
            facts,
            objects,
            numbers,
            granted_facts,
            granted_numbers,
            granted_objects,
            timed,
            goal,
        }
    }

    /// Gives the grounded task the present initial state and goal of the lifted task.
    pub fn restate(&mut self, task: &Task) -> Result<(), Regrounded> {
        let same = |(one, other): (&TimedInitial, &TimedInitial)| {
            one.time_s == other.time_s && one.change == other.change
        };
        let timed = &task.init.timed;
        if self.timed.len() != timed.len() || !self.timed.iter().zip(timed).all(same) {
            return Err(Regrounded::Timed);
        }
        self.ground.initial = self.state(task)?;
        if self.goal.body != task.goal.body {
            self.ground.goal = self.conjunction(&task.goal.body).ok_or(Regrounded::Goal)?;
            self.goal = task.goal.clone();
        }
        derive_initial(&mut self.ground);
        Ok(())
    }

    fn state(&self, task: &Task) -> Result<Values, Regrounded> {
        let unknown = u32::MAX;
        let none = |variable: &super::task::Variable| match variable.values.last() {
            _ if variable.stratum.is_some() => 1,
            Some(Meaning::NoneOfThose | Meaning::Object { value: None, .. }) => {
                variable.values.len() as u32 - 1
            }
            _ => unknown,
        };
        let mut values: Vec<u32> = self.ground.variables.iter().map(none).collect();
        let mut is_set = vec![false; values.len()];
        let mut set = |fact: GroundFact| {
            values[fact.variable as usize] = fact.value;
            !std::mem::replace(&mut is_set[fact.variable as usize], true)
        };
        let mut granted = 0;
        for fact in &task.init.facts {
            match self.facts.get(fact) {
                Some(&own) if set(own) => {}
                Some(_) => return Err(Regrounded::Exclusive),
                None if self.granted_facts.contains(fact) => granted += 1,
                None => return Err(Regrounded::Fact(fact_text(task, fact))),
            }
        }
        if granted < self.granted_facts.len() {
            let is_gone = |fact: &&Fact| !task.init.facts.contains(fact);
            let gone = self.granted_facts.iter().find(is_gone);
            return Err(gone.map_or(Regrounded::Exclusive, |fact| Regrounded::Fact(fact_text(task, fact))));
        }
        for (fluent, value) in &task.init.objects {
            let known = self.objects.get(fluent).map(|values| values.get(value));
            let fits = match known {
                Some(Some(&own)) => set(own),
                Some(None) => false,
                None => self.granted_objects.get(fluent) == Some(value),
            };
            fits.then_some(()).ok_or_else(|| Regrounded::Object(fluent_text(task, fluent)))?;
        }
        let is_valued = |fluent: &GroundFluent| task.init.objects.iter().any(|(own, _)| own == fluent);
        if let Some((fluent, _)) = self.granted_objects.iter().find(|(fluent, _)| !is_valued(fluent)) {
            return Err(Regrounded::Object(fluent_text(task, fluent)));
        }
        let numbers = self.numbers_now(task)?;
        let holds = |fact: &&GroundFact| values[fact.variable as usize] == fact.value;
        let excluded = self.ground.mutex_groups.iter().any(|group| group.iter().filter(holds).count() > 1);
        if excluded || values.contains(&unknown) {
            return Err(Regrounded::Exclusive);
        }
        Ok(Values { values, numbers })
    }

    fn numbers_now(&self, task: &Task) -> Result<Vec<f64>, Regrounded> {
        let mut numbers = vec![f64::NAN; self.numbers.len()];
        let mut granted = 0;
        for (fluent, value) in &task.init.numbers {
            match self.numbers.get(fluent) {
                Some(&number) => numbers[number as usize] = *value,
                None if self.granted_numbers.get(fluent) == Some(value) => granted += 1,
                None => return Err(Regrounded::Number(fluent_text(task, fluent))),
            }
        }
        let before = &self.ground.initial.numbers;
        let turned = self
            .numbers
            .iter()
            .find(|&(_, &number)| numbers[number as usize].is_nan() != before[number as usize].is_nan());
        match turned {
            Some((fluent, _)) => Err(Regrounded::Number(fluent_text(task, fluent))),
            None if granted < self.granted_numbers.len() => Err(Regrounded::Number("a function".into())),
            None => Ok(numbers),
        }
    }

    /// Ground goal; `None` if the goal is more than a conjunction of known facts and comparisons,
    /// or contradicts itself.
    fn conjunction(&mut self, goal: &Condition) -> Option<Conjunction> {
        let mut made = Conjunction::default();
        self.conjoin(goal, &mut made)?;
        made.facts.sort_unstable();
        made.facts.dedup();
        let excludes = |pair: &[GroundFact]| pair[0].variable == pair[1].variable;
        (!made.facts.windows(2).any(excludes)).then_some(made)
    }

    fn conjoin(&mut self, goal: &Condition, made: &mut Conjunction) -> Option<()> {
        match goal {
            Condition::And(parts) => parts.iter().try_for_each(|part| self.conjoin(part, made)),
            Condition::Atom(atom) => {
                let fact = Fact { predicate: atom.predicate, arguments: constants(&atom.arguments)? };
                match self.facts.get(&fact) {
                    Some(&own) => made.facts.push(own),
                    None => self.granted_facts.contains(&fact).then_some(())?,
                }
                Some(())
            }
            Condition::Compare(comparison, sides, _) => {
                let [left, right] = [self.number(&sides[0])?, self.number(&sides[1])?];
                let own = GroundComparison { left, relation: Relation::of(*comparison, true), right };
                let known = self.ground.comparisons.iter().position(|known| *known == own);
                made.comparisons.push(known.unwrap_or(self.ground.comparisons.len()) as u32);
                if known.is_none() {
                    self.ground.comparisons.push(own);
                }
                Some(())
            }
            _ => None,
        }
    }

    fn number(&self, expression: &Expression) -> Option<GroundExpression> {
        match expression {
            Expression::Number(value) => Some(GroundExpression::Constant(*value)),
            Expression::Fluent(Fluent { function, arguments, .. }) => {
                let fluent = GroundFluent { function: *function, arguments: constants(arguments)? };
                let granted = || self.granted_numbers.get(&fluent).copied().map(GroundExpression::Constant);
                self.numbers.get(&fluent).map(|&number| GroundExpression::Fluent(number)).or_else(granted)
            }
            _ => None,
        }
    }
}

fn constants(terms: &[Term]) -> Option<Box<[ObjectId]>> {
    let constant = |term: &Term| if let Term::Object(object) = term { Some(*object) } else { None };
    terms.iter().map(constant).collect()
}

fn fact_text(task: &Task, fact: &Fact) -> String {
    text(task, &task.predicate(fact.predicate).name, &fact.arguments)
}

fn fluent_text(task: &Task, fluent: &GroundFluent) -> String {
    text(task, &task.function(fluent.function).name, &fluent.arguments)
}

fn text(task: &Task, name: &str, arguments: &[ObjectId]) -> String {
    let names: String = arguments.iter().map(|&own| format!(" {}", task.object(own).name)).collect();
    format!("`({name}{names})`")
}
