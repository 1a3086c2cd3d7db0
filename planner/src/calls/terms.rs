//! State variables, numbers and constants from which the values of a call's readings are taken.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::attachment::{FactValue, Read};
use crate::ground::{GroundTask, Meaning, NumericId, VariableId};
use crate::semantics::calls::{ReadSymbol, instances};
use crate::task::{ObjectId, Task};

/// Place from which the value of a reading is taken.
#[derive(Debug, Clone)]
pub(super) enum Origin {
    /// A predicate: true if the variable has this value.
    Fact(VariableId, u32),
    /// A numeric fluent: the number with this id.
    Number(NumericId),
    /// An object fluent: the object that the variable's value stands for.
    Object(VariableId),
    /// Constant, equal in every state.
    Constant(FactValue),
}

/// Declared reading without its value: symbol name, argument names, and the place of the value in a
/// state.
pub(super) type Source = (Arc<str>, Arc<[Arc<str>]>, Origin);

/// Readings of one call, with the state variables and numbers behind them.
#[derive(Debug, Default)]
pub(super) struct Sources {
    /// Readings in the order of the declaration.
    pub list: Vec<Source>,
    /// Ids of all state variables in `list`, sorted, without duplicates.
    pub variables: Vec<VariableId>,
    /// Ids of all numeric fluents in `list`, sorted, without duplicates.
    pub numbers: Vec<NumericId>,
}

impl Sources {
    pub(super) fn new(list: Vec<Source>) -> Sources {
        let (mut variables, mut numbers) = (Vec::new(), Vec::new());
        for (_, _, origin) in &list {
            match origin {
                Origin::Fact(variable, _) | Origin::Object(variable) => variables.push(*variable),
                Origin::Number(number) => numbers.push(*number),
                Origin::Constant(_) => {}
            }
        }
        for ids in [&mut variables, &mut numbers] {
            ids.sort_unstable();
            ids.dedup();
        }
        Sources { list, variables, numbers }
    }
}

/// State variables and numbers of a ground task, by symbol id and argument object ids.
#[derive(Default)]
pub(super) struct Terms {
    facts: FxHashMap<(u32, Vec<u32>), (VariableId, u32)>,
    objects: FxHashMap<(u32, Vec<u32>), VariableId>,
    numbers: FxHashMap<(u32, Vec<u32>), NumericId>,
}

impl Terms {
    pub(super) fn new(ground: &GroundTask) -> Terms {
        let mut terms = Terms::default();
        for (variable, declared) in ground.variables.iter().enumerate() {
            for (value, meaning) in declared.values.iter().enumerate() {
                match meaning {
                    Meaning::Atom { predicate, arguments } => {
                        terms.facts.insert((*predicate, arguments.clone()), (variable as u32, value as u32));
                    }
                    Meaning::Object { fluent, arguments, .. } => {
                        terms.objects.insert((*fluent, arguments.clone()), variable as u32);
                    }
                    Meaning::Inner | Meaning::NoneOfThose => {}
                }
            }
        }
        for (number, fluent) in ground.numerics.iter().enumerate() {
            terms.numbers.insert((fluent.function, fluent.arguments.clone()), number as u32);
        }
        terms
    }

    /// Readings that one declared read means for a call with these arguments, in the order of the
    /// task's objects.
    pub(super) fn readings(
        &self,
        task: &Task,
        names: &[Arc<str>],
        read: &Read,
        arguments: &[u32],
    ) -> Vec<Source> {
        let arguments: Vec<ObjectId> = arguments.iter().map(|&argument| ObjectId(argument)).collect();
        let source = |(symbol, instance): (ReadSymbol, Vec<ObjectId>)| {
            let (name, origin) = self.origin(task, names, symbol, &instance);
            (name.into(), instance.iter().map(|a| names[a.index()].clone()).collect(), origin)
        };
        instances(task, read, &arguments).into_iter().map(source).collect()
    }

    fn origin<'t>(
        &self,
        task: &'t Task,
        names: &[Arc<str>],
        symbol: ReadSymbol,
        arguments: &[ObjectId],
    ) -> (&'t str, Origin) {
        let key = |id: u32| (id, arguments.iter().map(|object| object.0).collect::<Vec<_>>());
        let same = |objects: &[ObjectId]| *objects == *arguments;
        match symbol {
            ReadSymbol::Predicate(id) => {
                let origin = match self.facts.get(&key(id.0)) {
                    Some(&(variable, value)) => Origin::Fact(variable, value),
                    None => {
                        let holds =
                            task.init.facts.iter().any(|fact| fact.predicate == id && same(&fact.arguments));
                        Origin::Constant(FactValue::Truth(holds))
                    }
                };
                (&task.predicate(id).name, origin)
            }
            ReadSymbol::Function(id) => {
                let numeric = || {
                    let start =
                        task.init.numbers.iter().find(|(f, _)| f.function == id && same(&f.arguments));
                    start.map_or(FactValue::Undefined, |(_, number)| FactValue::Number(*number))
                };
                let object = || {
                    let start =
                        task.init.objects.iter().find(|(f, _)| f.function == id && same(&f.arguments));
                    start.map_or(FactValue::Undefined, |(_, o)| FactValue::Object(names[o.index()].clone()))
                };
                let declared = task.function(id);
                let origin = match (self.numbers.get(&key(id.0)), self.objects.get(&key(id.0))) {
                    (Some(&number), _) if declared.result.is_none() => Origin::Number(number),
                    (_, Some(&variable)) if declared.result.is_some() => Origin::Object(variable),
                    _ if declared.result.is_none() => Origin::Constant(numeric()),
                    _ => Origin::Constant(object()),
                };
                (&declared.name, origin)
            }
        }
    }
}
