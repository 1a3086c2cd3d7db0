//! Ground calls bound to attachments: what the searches ask, and from which variables an answer is made.

use std::cell::RefCell;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::attachment::{
    Answer, AttachmentError, Attachments, Call as Question, CallError, CallKind, FactValue, Level, Read,
    Reading,
};
use crate::diagnostic::{Diagnostic, Findings};
use crate::explain::Refusals;
use crate::ground::{CallId, GroundTask, Meaning, NumericId, Place, Values, VariableId};
use crate::solve::PlanError;
use crate::task::{FunctionId, ObjectId, PredicateId, Task};

/// A failed call on its way up to [`crate::plan`].
pub(crate) type Failure = Box<AttachmentError>;

/// Where a reading comes from.
#[derive(Debug, Clone)]
enum Origin {
    /// True where the variable has the value.
    Fact(VariableId, u32),
    /// The number.
    Number(NumericId),
    /// The object that the variable's value means.
    Object(VariableId),
    /// The same in every state.
    Constant(FactValue),
}

/// A ground call: the question without its readings, and how to make those.
#[derive(Debug, Clone)]
struct Bound {
    attachment: String,
    question: Question,
    readings: Vec<(Arc<str>, Vec<Arc<str>>, Origin)>,
    writes: Vec<Place>,
}

/// Every call of a ground task, bound to its attachment.
pub(crate) struct Calls<'a> {
    task: &'a Task,
    ground: &'a GroundTask,
    attachments: &'a Attachments,
    names: Vec<Arc<str>>,
    bound: Vec<Bound>,
    /// Answers of calls that read nothing and take no proposed parameter, exact and relaxed.
    settled: RefCell<Vec<[Option<Answer>; 2]>>,
    terms: Terms,
    /// What condition modules denied and cost modules called impossible.
    refusals: RefCell<Refusals>,
}

impl<'a> Calls<'a> {
    /// Binds the calls of `ground`.
    ///
    /// # Errors
    ///
    /// [`PlanError::Refused`] naming every module of the task that has no attachment; [`PlanError::Attachment`] if one
    /// refuses its module options.
    pub fn bind(
        task: &'a Task,
        ground: &'a GroundTask,
        attachments: &'a Attachments,
    ) -> Result<Calls<'a>, PlanError> {
        let missing: Vec<Diagnostic> = task
            .modules
            .iter()
            .enumerate()
            .filter(|(index, module)| {
                used(task, ground, *index) && attachments.resolve(&module.function, &module.name).is_none()
            })
            .map(|(_, module)| unbound(module, attachments))
            .collect();
        if !missing.is_empty() {
            return Err(PlanError::Refused(Findings { sources: task.sources.to_vec(), list: missing }));
        }
        let names = task.objects.iter().map(|object| Arc::from(object.name.as_str())).collect();
        let mut calls = Calls {
            task,
            ground,
            attachments,
            names,
            bound: Vec::new(),
            settled: RefCell::new(vec![[None, None]; ground.calls.len()]),
            terms: Terms::default(),
            refusals: RefCell::default(),
        };
        if attachments.names().any(|name| !attachments.reads(name).is_empty()) {
            calls.terms = Terms::new(ground);
        }
        calls.bound = ground
            .calls
            .iter()
            .map(|call| {
                calls.bind_one(call.origin.schema as usize, &call.origin.arguments, call.writes.clone())
            })
            .collect();
        Ok(calls)
    }

    fn bind_one(&self, module: usize, arguments: &[u32], writes: Vec<Place>) -> Bound {
        let declared = &self.task.modules[module];
        let attachment =
            self.attachments.resolve(&declared.function, &declared.name).unwrap_or_default().to_string();
        let name = |&object: &u32| self.names[object as usize].clone();
        let readings = self
            .attachments
            .reads(&attachment)
            .iter()
            .flat_map(|read| self.terms.readings(self.task, &self.names, read, arguments))
            .collect();
        let question = Question {
            module: declared.name.as_str().into(),
            kind: declared.kind,
            arguments: arguments.iter().map(name).collect(),
            readings: Vec::new(),
        };
        Bound { attachment, question, readings, writes }
    }

    /// Whether a condition module says yes.
    pub fn truth(
        &self,
        call: CallId,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
    ) -> Result<bool, Failure> {
        match self.answer(call, proposal, state, level)? {
            Answer::Truth(truth) => Ok(truth),
            other => Err(self.misfit(call, &other)),
        }
    }

    /// The cost that a cost module answers.
    pub fn cost(
        &self,
        call: CallId,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
    ) -> Result<f64, Failure> {
        match self.answer(call, proposal, state, level)? {
            Answer::Number(cost) => Ok(cost),
            other => Err(self.misfit(call, &other)),
        }
    }

    /// Lets an effect module write into a state what it answers on another.
    pub fn write(
        &self,
        call: CallId,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
        into: &mut Values,
    ) -> Result<(), Failure> {
        let places = &self.bound[call as usize].writes;
        let answer = self.answer(call, proposal, state, level)?;
        let Answer::Writes(values) = &answer else { return Err(self.misfit(call, &answer)) };
        if values.len() != places.len() {
            return Err(self.misfit(call, &answer));
        }
        for (place, value) in places.iter().zip(values) {
            match (place, value) {
                (Place::Number(fluent), FactValue::Number(number)) => {
                    into.numbers[*fluent as usize] = *number
                }
                (Place::Truth(variable), FactValue::Truth(truth)) => {
                    into.values[*variable as usize] = u32::from(!truth);
                }
                (Place::Object(variable), FactValue::Object(name)) => {
                    let Some(value) = self.object_value(*variable, Some(name)) else {
                        return Err(self.misfit(call, &answer));
                    };
                    into.values[*variable as usize] = value;
                }
                (Place::Object(variable), FactValue::Undefined) => {
                    if let Some(value) = self.object_value(*variable, None) {
                        into.values[*variable as usize] = value;
                    }
                }
                (Place::Nowhere, _) => {}
                _ => return Err(self.misfit(call, &answer)),
            }
        }
        Ok(())
    }

    /// The value of an object fluent's variable that means the object of this name, or that it is undefined.
    fn object_value(&self, variable: VariableId, name: Option<&Arc<str>>) -> Option<u32> {
        let means = |meaning: &Meaning| match meaning {
            Meaning::Object { value: Some(object), .. } => name == Some(&self.names[*object as usize]),
            Meaning::Object { value: None, .. } => name.is_none(),
            _ => false,
        };
        let values = &self.ground.variables[variable as usize].values;
        values.iter().position(means).map(|value| value as u32)
    }

    /// The parameters that a grounding module of the lifted task proposes.
    pub fn proposals(
        &self,
        module: usize,
        arguments: &[u32],
        state: &Values,
    ) -> Result<Vec<Arc<str>>, Failure> {
        let bound = self.bind_one(module, arguments, Vec::new());
        let question = self.question(&bound, None, state);
        match self.attachments.call(&bound.attachment, &question, Level::Exact)? {
            Answer::Proposals(names) => Ok(names),
            other => Err(Box::new(misfit(&bound, &other))),
        }
    }

    /// What the answer depends on: variables, then numbers.
    pub fn reads(&self, call: CallId) -> (Vec<VariableId>, Vec<NumericId>) {
        let (mut variables, mut numbers) = (Vec::new(), Vec::new());
        for (_, _, origin) in &self.bound[call as usize].readings {
            match origin {
                Origin::Fact(variable, _) | Origin::Object(variable) => variables.push(*variable),
                Origin::Number(number) => numbers.push(*number),
                Origin::Constant(_) => {}
            }
        }
        variables.sort_unstable();
        variables.dedup();
        (variables, numbers)
    }

    /// What has been refused so far.
    pub fn refusals(&self) -> Refusals {
        self.refusals.borrow().clone()
    }

    /// What kind of module is called.
    pub fn kind(&self, call: CallId) -> CallKind {
        self.bound[call as usize].question.kind
    }

    fn answer(
        &self,
        call: CallId,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
    ) -> Result<Answer, Failure> {
        let bound = &self.bound[call as usize];
        let settles = bound.readings.is_empty() && proposal.is_none();
        if settles && let Some(answer) = &self.settled.borrow()[call as usize][level as usize] {
            return Ok(answer.clone());
        }
        let answer = if settles {
            self.attachments.call(&bound.attachment, &bound.question, level)?
        } else {
            let question = self.question(bound, proposal, state);
            self.attachments.call(&bound.attachment, &question, level)?
        };
        if matches!(answer, Answer::Truth(false))
            || matches!(answer, Answer::Number(cost) if cost.is_infinite())
        {
            let mut refusals = self.refusals.borrow_mut();
            let known = refusals.entry(self.ground.calls[call as usize].origin.schema).or_default();
            let text = bound.question.to_string();
            if known.len() < 1000 && !known.contains(&text) {
                known.push(text);
            }
        }
        if settles {
            self.settled.borrow_mut()[call as usize][level as usize] = Some(answer.clone());
        }
        Ok(answer)
    }

    fn question(&self, bound: &Bound, proposal: Option<&Arc<str>>, state: &Values) -> Question {
        let mut question = bound.question.clone();
        question.arguments.extend(proposal.cloned());
        question.readings = bound
            .readings
            .iter()
            .map(|(symbol, arguments, origin)| Reading {
                symbol: symbol.clone(),
                arguments: arguments.clone(),
                value: self.value(origin, state),
            })
            .collect();
        question
    }

    fn value(&self, origin: &Origin, state: &Values) -> FactValue {
        match origin {
            Origin::Fact(variable, value) => FactValue::Truth(state.values[*variable as usize] == *value),
            Origin::Number(number) => number_value(state.numbers[*number as usize]),
            Origin::Object(variable) => {
                let value = state.values[*variable as usize] as usize;
                match &self.ground.variables[*variable as usize].values[value] {
                    Meaning::Object { value: Some(object), .. } => {
                        FactValue::Object(self.names[*object as usize].clone())
                    }
                    _ => FactValue::Undefined,
                }
            }
            Origin::Constant(value) => value.clone(),
        }
    }

    fn misfit(&self, call: CallId, answer: &Answer) -> Failure {
        Box::new(misfit(&self.bound[call as usize], answer))
    }

    /// A failure as an error of the whole planning call, drawn under the domain.
    pub fn report(&self, failure: Failure) -> PlanError {
        report(self.task, failure)
    }
}

/// A failed call as an error of the whole planning call, pointing at the module's declaration and its first use.
pub(crate) fn report(task: &Task, failure: Failure) -> PlanError {
    let module = task.modules.iter().find(|module| module.name == failure.module);
    let list = module
        .map(|module| {
            let message = failure.to_string();
            Diagnostic::error("attachment-failed", message, module.span, "the module declared here")
        })
        .into_iter()
        .collect();
    PlanError::Attachment { error: failure, findings: Findings { sources: task.sources.to_vec(), list } }
}

fn used(task: &Task, ground: &GroundTask, module: usize) -> bool {
    ground.calls.iter().any(|call| call.origin.schema as usize == module)
        || task.actions.iter().any(|action| action.grounding.iter().any(|call| call.module.index() == module))
}

fn unbound(module: &crate::task::Module, attachments: &Attachments) -> Diagnostic {
    let function = module.function.split('@').next().unwrap_or_default();
    let known: Vec<&str> = attachments.names().collect();
    let help = if known.is_empty() {
        "no attachment is registered at all: give one as a Rust function or as a program that answers JSON lines".into()
    } else {
        format!("registered are: {}", known.join(", "))
    };
    let message =
        format!("module `{}` has no attachment: neither `{function}` nor `{}`", module.name, module.name);
    Diagnostic::error("missing-attachment", message, module.span, "nothing computes this").with_help(help)
}

fn misfit(bound: &Bound, answer: &Answer) -> AttachmentError {
    let expected = match bound.question.kind {
        CallKind::Effect => format!("{} values that fit the terms of the module", bound.writes.len()),
        kind => format!("an answer of a {kind} module"),
    };
    AttachmentError {
        call: bound.question.to_string(),
        module: bound.question.module.to_string(),
        attachment: bound.attachment.clone(),
        cause: CallError::WrongAnswer { expected, got: format!("{answer:?}") },
    }
}

fn number_value(number: f64) -> FactValue {
    if number.is_nan() { FactValue::Undefined } else { FactValue::Number(number) }
}

/// Ground terms by name, to where their values stand.
#[derive(Default)]
struct Terms {
    facts: FxHashMap<(u32, Vec<u32>), (VariableId, u32)>,
    objects: FxHashMap<(u32, Vec<u32>), VariableId>,
    numbers: FxHashMap<(u32, Vec<u32>), NumericId>,
}

impl Terms {
    fn new(ground: &GroundTask) -> Terms {
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

    /// The ground readings of one declared read, in the order of the task's objects.
    fn readings(
        &self,
        task: &Task,
        names: &[Arc<str>],
        read: &Read,
        arguments: &[u32],
    ) -> Vec<(Arc<str>, Vec<Arc<str>>, Origin)> {
        let mut found = Vec::new();
        let mut add = |symbol: Symbol, arguments: Vec<u32>| {
            let (name, origin) = self.origin(task, names, symbol, &arguments);
            found.push((
                Arc::from(name),
                arguments.iter().map(|&a| names[a as usize].clone()).collect(),
                origin,
            ));
        };
        match read {
            Read::At(name, positions) => {
                let picked: Option<Vec<u32>> =
                    positions.iter().map(|&position| arguments.get(position).copied()).collect();
                if let (Some(symbol), Some(picked)) = (symbol_named(task, name), picked) {
                    add(symbol, picked);
                }
            }
            Read::All(name) => {
                if let Some(symbol) = symbol_named(task, name) {
                    instances(task, symbol).into_iter().for_each(|instance| add(symbol, instance));
                }
            }
            Read::Everything => {
                for symbol in every_symbol(task) {
                    instances(task, symbol).into_iter().for_each(|instance| add(symbol, instance));
                }
            }
        }
        found
    }

    fn origin<'t>(
        &self,
        task: &'t Task,
        names: &[Arc<str>],
        symbol: Symbol,
        arguments: &[u32],
    ) -> (&'t str, Origin) {
        let key = |id: u32| (id, arguments.to_vec());
        let same = |objects: &[ObjectId]| objects.iter().map(|object| object.0).eq(arguments.iter().copied());
        match symbol {
            Symbol::Predicate(id) => {
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
            Symbol::Function(id) => {
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

#[derive(Clone, Copy)]
enum Symbol {
    Predicate(PredicateId),
    Function(FunctionId),
}

fn symbol_named(task: &Task, name: &str) -> Option<Symbol> {
    let predicate = task.predicates.iter().position(|p| p.name.eq_ignore_ascii_case(name));
    let function = task.functions.iter().position(|f| f.name.eq_ignore_ascii_case(name));
    predicate
        .map(|index| Symbol::Predicate(PredicateId(index as u32)))
        .or(function.map(|index| Symbol::Function(FunctionId(index as u32))))
}

fn every_symbol(task: &Task) -> Vec<Symbol> {
    let predicates = (0..task.predicates.len()).map(|index| Symbol::Predicate(PredicateId(index as u32)));
    predicates
        .chain((0..task.functions.len()).map(|index| Symbol::Function(FunctionId(index as u32))))
        .collect()
}

fn instances(task: &Task, symbol: Symbol) -> Vec<Vec<u32>> {
    let parameters = match symbol {
        Symbol::Predicate(id) => &task.predicate(id).parameters,
        Symbol::Function(id) => &task.function(id).parameters,
    };
    parameters.iter().fold(vec![Vec::new()], |instances, parameter| {
        instances
            .iter()
            .flat_map(|instance| {
                parameter.objects.iter().map(|object| {
                    let mut longer: Vec<u32> = instance.clone();
                    longer.push(object.0);
                    longer
                })
            })
            .collect()
    })
}
