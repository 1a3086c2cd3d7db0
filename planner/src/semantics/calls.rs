//! Calls of semantic modules in a state.

use std::sync::Arc;

use super::{Binding, CallFailure, Semantics};
use crate::attachment::{self, Answer, FactValue, Level, Read, Reading};
use crate::state::State;
use crate::task::{CallTerm, FunctionId, ObjectId, Parameter, PredicateId, Task};

/// Predicate or function that a module reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ReadSymbol {
    /// A predicate.
    Predicate(PredicateId),
    /// A function.
    Function(FunctionId),
}

impl Semantics<'_> {
    /// Answer of a call at the exact level; `None` if an argument is undefined.
    pub(crate) fn ask(
        &self,
        state: &State,
        call: &CallTerm,
        binding: &Binding,
    ) -> Result<Option<Answer>, CallFailure> {
        let Some(arguments) = self.objects(state, &call.arguments, binding) else { return Ok(None) };
        let question = self.question(state, call, &arguments, binding);
        let name = &self.bound[call.module.index()];
        match self.attachments.call(name, &question, Level::Exact) {
            Ok(answer) => Ok(Some(answer)),
            Err(error) => Err(CallFailure { error, span: call.span }),
        }
    }

    /// Arguments that a grounding module proposes; empty if an argument of the call is undefined.
    pub(crate) fn proposals(
        &self,
        state: &State,
        call: &CallTerm,
        binding: &Binding,
    ) -> Result<Vec<Arc<str>>, CallFailure> {
        Ok(match self.ask(state, call, binding)? {
            Some(Answer::Proposals(proposals)) => proposals,
            _ => Vec::new(),
        })
    }

    /// Call as sent to the attachment: names of its arguments, and values of the facts that its module
    /// reads.
    fn question(
        &self,
        state: &State,
        call: &CallTerm,
        arguments: &[ObjectId],
        binding: &Binding,
    ) -> attachment::Call {
        let module = self.task.module(call.module);
        let mut readings = Vec::new();
        for read in self.attachments.reads(&self.bound[call.module.index()]) {
            for (symbol, instance) in instances(self.task, read, arguments) {
                readings.push(self.reading(state, symbol, &instance));
            }
        }
        let names = arguments.iter().map(|&id| self.object_names[id.index()].clone());
        attachment::Call {
            module: self.module_names[call.module.index()].clone(),
            kind: module.kind,
            arguments: names.chain(binding.proposals.iter().cloned()).collect(),
            readings,
        }
    }

    fn reading(&self, state: &State, symbol: ReadSymbol, arguments: &[ObjectId]) -> Reading {
        let (name, value) = match symbol {
            ReadSymbol::Predicate(id) => {
                (&self.task.predicate(id).name, FactValue::Truth(state.holds(id, arguments)))
            }
            ReadSymbol::Function(id) => {
                let value = match self.task.function(id).result {
                    None => state.number(id, arguments).map(FactValue::Number),
                    Some(_) => state
                        .object(id, arguments)
                        .map(|object| FactValue::Object(self.object_names[object.index()].clone())),
                };
                (&self.task.function(id).name, value.unwrap_or(FactValue::Undefined))
            }
        };
        let names = arguments.iter().map(|&id| self.object_names[id.index()].clone());
        Reading { symbol: name.as_str().into(), arguments: names.collect(), value }
    }
}

/// Ground facts and fluents that a module reads in a call with these arguments, ordered by declaration
/// and by the task's objects; empty for an unknown predicate or function.
pub(crate) fn instances(
    task: &Task,
    read: &Read,
    arguments: &[ObjectId],
) -> Vec<(ReadSymbol, Vec<ObjectId>)> {
    match read {
        Read::At(name, positions) => {
            // What stands at a position that the call does not have is nothing.
            let chosen: Option<Vec<Option<ObjectId>>> = positions
                .iter()
                .map(|position| position.map_or(Some(None), |at| arguments.get(at).copied().map(Some)))
                .collect();
            let chosen = find(task, name).zip(chosen);
            chosen.map(|(symbol, chosen)| instances_with(task, symbol, &chosen)).unwrap_or_default()
        }
        Read::All(name) => find(task, name).map(|symbol| all_instances(task, symbol)).unwrap_or_default(),
        Read::Everything => {
            let predicates =
                (0..task.predicates.len()).map(|index| ReadSymbol::Predicate(PredicateId(index as u32)));
            let functions =
                (0..task.functions.len()).map(|index| ReadSymbol::Function(FunctionId(index as u32)));
            predicates.chain(functions).flat_map(|symbol| all_instances(task, symbol)).collect()
        }
    }
}

fn find(task: &Task, name: &str) -> Option<ReadSymbol> {
    match task.find_predicate(name) {
        Some(id) => Some(ReadSymbol::Predicate(id)),
        None => task.find_function(name).map(ReadSymbol::Function),
    }
}

fn all_instances(task: &Task, symbol: ReadSymbol) -> Vec<(ReadSymbol, Vec<ObjectId>)> {
    instances_with(task, symbol, &vec![None; parameters(task, symbol).len()])
}

fn parameters(task: &Task, symbol: ReadSymbol) -> &[Parameter] {
    match symbol {
        ReadSymbol::Predicate(id) => &task.predicate(id).parameters,
        ReadSymbol::Function(id) => &task.function(id).parameters,
    }
}

/// Ground instances of a predicate or function with these arguments; `None` stands for every object of
/// the parameter's type.
fn instances_with(
    task: &Task,
    symbol: ReadSymbol,
    arguments: &[Option<ObjectId>],
) -> Vec<(ReadSymbol, Vec<ObjectId>)> {
    let mut all: Vec<Vec<ObjectId>> = vec![Vec::new()];
    for (parameter, argument) in parameters(task, symbol).iter().zip(arguments) {
        let objects = argument.as_ref().map_or(&*parameter.objects, std::slice::from_ref);
        let longer = all
            .iter()
            .flat_map(|known| objects.iter().map(|&object| known.iter().copied().chain([object]).collect()));
        all = longer.collect();
    }
    all.into_iter().map(|arguments| (symbol, arguments)).collect()
}
