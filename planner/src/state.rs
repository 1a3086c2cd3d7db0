//! State of the lifted task: facts that hold, and values of functions.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::task::{Fact, FunctionId, GroundChange, GroundFluent, Init, ObjectId, PredicateId, Task};

/// Facts that hold, and values of numeric and object functions. Other facts are false, other
/// functions undefined.
///
/// Derived facts are included; [`Semantics`](crate::Semantics) keeps them up to date.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State {
    facts: Vec<FxHashSet<Box<[ObjectId]>>>,
    numbers: Vec<FxHashMap<Box<[ObjectId]>, f64>>,
    objects: Vec<FxHashMap<Box<[ObjectId]>, ObjectId>>,
}

impl State {
    /// State without facts and values.
    pub fn empty(task: &Task) -> State {
        State {
            facts: vec![FxHashSet::default(); task.predicates.len()],
            numbers: vec![FxHashMap::default(); task.functions.len()],
            objects: vec![FxHashMap::default(); task.functions.len()],
        }
    }

    /// Initial state of a task, without derived facts and timed changes.
    pub fn initial(task: &Task) -> State {
        let mut state = State::empty(task);
        for fact in &task.init.facts {
            state.facts[fact.predicate.index()].insert(fact.arguments.clone());
        }
        for (fluent, value) in &task.init.numbers {
            state.numbers[fluent.function.index()].insert(fluent.arguments.clone(), *value);
        }
        for (fluent, value) in &task.init.objects {
            state.objects[fluent.function.index()].insert(fluent.arguments.clone(), *value);
        }
        state
    }

    /// True if a fact holds.
    pub fn holds(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.facts[predicate.index()].contains(arguments)
    }

    /// Value of a numeric function; `None` if undefined.
    pub fn number(&self, function: FunctionId, arguments: &[ObjectId]) -> Option<f64> {
        self.numbers[function.index()].get(arguments).copied()
    }

    /// Value of an object function; `None` if undefined.
    pub fn object(&self, function: FunctionId, arguments: &[ObjectId]) -> Option<ObjectId> {
        self.objects[function.index()].get(arguments).copied()
    }

    /// Makes a fact true or false.
    pub fn set_fact(&mut self, predicate: PredicateId, arguments: &[ObjectId], holds: bool) {
        let facts = &mut self.facts[predicate.index()];
        if !holds {
            facts.remove(arguments);
        } else if !facts.contains(arguments) {
            facts.insert(arguments.into());
        }
    }

    /// Sets a numeric function; `None` makes it undefined.
    pub fn set_number(&mut self, function: FunctionId, arguments: &[ObjectId], value: Option<f64>) {
        let numbers = &mut self.numbers[function.index()];
        match (value, numbers.get_mut(arguments)) {
            (None, _) => {
                numbers.remove(arguments);
            }
            (Some(value), Some(place)) => *place = value,
            (Some(value), None) => {
                numbers.insert(arguments.into(), value);
            }
        }
    }

    /// Sets an object function; `None` makes it undefined.
    pub fn set_object(&mut self, function: FunctionId, arguments: &[ObjectId], value: Option<ObjectId>) {
        let objects = &mut self.objects[function.index()];
        match value {
            None => {
                objects.remove(arguments);
            }
            Some(value) => {
                objects.insert(arguments.into(), value);
            }
        }
    }

    /// Applies a change to the state.
    pub fn apply(&mut self, change: &GroundChange) {
        match change {
            GroundChange::Add(fact) => self.set_fact(fact.predicate, &fact.arguments, true),
            GroundChange::Delete(fact) => self.set_fact(fact.predicate, &fact.arguments, false),
            GroundChange::Number(fluent, value) => {
                self.set_number(fluent.function, &fluent.arguments, Some(*value))
            }
            GroundChange::Object(fluent, value) => {
                self.set_object(fluent.function, &fluent.arguments, Some(*value))
            }
        }
    }

    /// Arguments for which a predicate is true, unordered.
    pub fn instances(&self, predicate: PredicateId) -> impl Iterator<Item = &[ObjectId]> {
        self.facts[predicate.index()].iter().map(|arguments| &**arguments)
    }

    /// Arguments for which a numeric function is defined, each with its value, unordered.
    pub fn values(&self, function: FunctionId) -> impl Iterator<Item = (&[ObjectId], f64)> {
        self.numbers[function.index()].iter().map(|(arguments, value)| (&**arguments, *value))
    }

    /// Number of facts of a predicate that hold.
    pub fn count(&self, predicate: PredicateId) -> usize {
        self.facts[predicate.index()].len()
    }

    pub(crate) fn clear_predicate(&mut self, predicate: PredicateId) {
        self.facts[predicate.index()].clear();
    }

    /// Initial state with all facts of basic (not derived) predicates and all values, sorted;
    /// without timed changes.
    pub fn to_init(&self, task: &Task) -> Init {
        let mut init = Init::default();
        for (index, facts) in self.facts.iter().enumerate() {
            if task.predicates[index].stratum.is_none() {
                let predicate = PredicateId(index as u32);
                init.facts
                    .extend(facts.iter().map(|arguments| Fact { predicate, arguments: arguments.clone() }));
            }
        }
        let fluent = |index: usize, arguments: &[ObjectId]| GroundFluent {
            function: FunctionId(index as u32),
            arguments: arguments.into(),
        };
        for (index, numbers) in self.numbers.iter().enumerate() {
            init.numbers.extend(numbers.iter().map(|(arguments, value)| (fluent(index, arguments), *value)));
        }
        for (index, objects) in self.objects.iter().enumerate() {
            init.objects.extend(objects.iter().map(|(arguments, value)| (fluent(index, arguments), *value)));
        }
        init.facts.sort_unstable();
        init.numbers.sort_by(|one, other| one.0.cmp(&other.0));
        init.objects.sort_unstable();
        init
    }
}

impl Task {
    /// Copy of the task with another initial state. Timed initial literals are dropped, because
    /// their times refer to the former start.
    pub fn with_state(&self, state: &State) -> Task {
        Task { init: state.to_init(self), ..self.clone() }
    }

    /// Object of a name in any case; `None` if there is none.
    pub fn find_object(&self, name: &str) -> Option<ObjectId> {
        let by_name = &self.objects_by_name;
        by_name.get(name).or_else(|| by_name.get(&name.to_ascii_lowercase())).copied()
    }

    /// Predicate of a name in any case; `None` if there is none.
    pub fn find_predicate(&self, name: &str) -> Option<PredicateId> {
        let at = self.predicates.iter().position(|own| own.name.eq_ignore_ascii_case(name))?;
        Some(PredicateId(at as u32))
    }

    /// Function of a name in any case; `None` if there is none.
    pub fn find_function(&self, name: &str) -> Option<FunctionId> {
        let at = self.functions.iter().position(|own| own.name.eq_ignore_ascii_case(name))?;
        Some(FunctionId(at as u32))
    }
}
