//! Ground calls bound to attachments: what the searches ask, and from which variables an answer is made.

mod terms;

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::attachment::{
    Answer, AttachmentError, Attachments, Call as Question, CallError, CallKind, FactValue, Level, Read,
    Reading,
};
use crate::diagnostic::{Diagnostic, Findings};
use crate::explain::{Refusals, sites};
use crate::ground::{CallId, GroundTask, Meaning, NumericId, Place, Values, VariableId};
use crate::solve::PlanError;
use crate::task::{ModuleId, Task};

use self::terms::{Origin, Sources, Terms};

/// A failed call on its way up to [`crate::plan`].
pub(crate) type Failure = Box<AttachmentError>;

/// A ground call: the question without its readings, and how to make those.
#[derive(Debug, Clone)]
struct Bound {
    attachment: String,
    question: Question,
    sources: Arc<Sources>,
    writes: Vec<Place>,
}

/// Answers known already, by what stands where the call reads.
type Known = FxHashMap<Box<[u64]>, Answer>;

/// A call, what was needed of it, and the proposed parameter.
type Refusal = (CallId, bool, Option<Arc<str>>);

/// Every call of a ground task, bound to its attachment.
pub(crate) struct Calls<'a> {
    task: &'a Task,
    ground: &'a GroundTask,
    attachments: &'a Attachments,
    names: Vec<Arc<str>>,
    bound: Vec<Bound>,
    /// By call, counts of answers that were known already, for the statistics of its attachment.
    hits: Vec<Option<&'a AtomicU64>>,
    /// Answers of calls that read nothing and take no proposed parameter, exact and relaxed.
    settled: RefCell<Vec<[Option<Answer>; 2]>>,
    /// Answers of calls that read something, without a proposed parameter, by call and level.
    known: RefCell<FxHashMap<(CallId, Level), Known>>,
    terms: Terms,
    /// Calls that were answered otherwise than needed: what was needed, and the proposed parameter.
    refused: RefCell<FxHashSet<Refusal>>,
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
            hits: Vec::new(),
            settled: RefCell::new(vec![[None, None]; ground.calls.len()]),
            known: RefCell::default(),
            terms: Terms::default(),
            refused: RefCell::default(),
        };
        if attachments.names().any(|name| !attachments.reads(name).is_empty()) {
            calls.terms = Terms::new(ground);
        }
        // Where the arguments make no difference, all calls of a module read the same.
        let mut shared: FxHashMap<u32, Arc<Sources>> = FxHashMap::default();
        for call in &ground.calls {
            let (module, arguments) = (call.origin.schema, &call.origin.arguments);
            let known = shared.get(&module).cloned();
            let bound = calls.bind_one(module as usize, arguments, call.writes.clone(), known);
            if !attachments.reads(&bound.attachment).iter().any(|read| matches!(read, Read::At(..))) {
                shared.entry(module).or_insert_with(|| bound.sources.clone());
            }
            calls.hits.push(attachments.hits(&bound.attachment));
            calls.bound.push(bound);
        }
        Ok(calls)
    }

    fn bind_one(
        &self,
        module: usize,
        arguments: &[u32],
        writes: Vec<Place>,
        known: Option<Arc<Sources>>,
    ) -> Bound {
        let declared = &self.task.modules[module];
        let attachment =
            self.attachments.resolve(&declared.function, &declared.name).unwrap_or_default().to_string();
        let name = |&object: &u32| self.names[object as usize].clone();
        let sources = known.unwrap_or_else(|| {
            let reads = self.attachments.reads(&attachment).iter();
            let list = reads.flat_map(|read| self.terms.readings(self.task, &self.names, read, arguments));
            Arc::new(Sources::new(list.collect()))
        });
        let question = Question {
            module: declared.name.as_str().into(),
            kind: declared.kind,
            arguments: arguments.iter().map(name).collect(),
            readings: Vec::new(),
        };
        Bound { attachment, question, sources, writes }
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

    /// Whether a condition module says what is needed; what it denies is remembered.
    pub fn agrees(
        &self,
        (call, wanted): (CallId, bool),
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
    ) -> Result<bool, Failure> {
        let agrees = self.truth(call, proposal, state, level)? == wanted;
        if !agrees {
            self.refused.borrow_mut().insert((call, wanted, proposal.cloned()));
        }
        Ok(agrees)
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
            Answer::Number(cost) => {
                if cost.is_infinite() {
                    self.refused.borrow_mut().insert((call, true, proposal.cloned()));
                }
                Ok(cost)
            }
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
        let bound = self.bind_one(module, arguments, Vec::new(), None);
        let question = self.question(&bound, None, state);
        match self.attachments.call(&bound.attachment, &question, Level::Exact)? {
            Answer::Proposals(names) => Ok(names),
            other => Err(Box::new(misfit(&bound, &other))),
        }
    }

    /// What the answer depends on: variables, then numbers.
    pub fn reads(&self, call: CallId) -> (&[VariableId], &[NumericId]) {
        let sources = &self.bound[call as usize].sources;
        (&sources.variables, &sources.numbers)
    }

    /// Whether the answer, without a proposed parameter, is the same in every state.
    pub fn settles(&self, call: CallId) -> bool {
        let (variables, numbers) = self.reads(call);
        variables.is_empty() && numbers.is_empty()
    }

    /// What has been answered otherwise than needed so far.
    pub fn refusals(&self) -> Refusals {
        let mut refusals = Refusals::default();
        let refused = self.refused.borrow();
        let mut refused: Vec<_> = refused.iter().collect();
        refused.sort_unstable();
        for (call, wanted, proposal) in refused {
            let mut question = self.bound[*call as usize].question.clone();
            question.arguments.extend(proposal.clone());
            let module = self.ground.calls[*call as usize].origin.schema;
            refusals.entry((module, *wanted)).or_default().push(question.to_string());
        }
        refusals
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
        if proposal.is_some() {
            let question = self.question(bound, proposal, state);
            return Ok(self.attachments.call(&bound.attachment, &question, level)?);
        }
        let hit = || {
            self.hits[call as usize].into_iter().for_each(|hits| {
                hits.fetch_add(1, Ordering::Relaxed);
            });
        };
        if self.settles(call) {
            if let Some(answer) = &self.settled.borrow()[call as usize][level as usize] {
                hit();
                return Ok(answer.clone());
            }
            let answer = match bound.sources.list.is_empty() {
                true => self.attachments.call(&bound.attachment, &bound.question, level)?,
                false => {
                    let question = self.question(bound, None, state);
                    self.attachments.call(&bound.attachment, &question, level)?
                }
            };
            self.settled.borrow_mut()[call as usize][level as usize] = Some(answer.clone());
            return Ok(answer);
        }
        let values =
            bound.sources.variables.iter().map(|&variable| u64::from(state.values[variable as usize]));
        // Adding zero makes -0.0 and 0.0 one key.
        let numbers =
            bound.sources.numbers.iter().map(|&number| (state.numbers[number as usize] + 0.0).to_bits());
        let key: Box<[u64]> = values.chain(numbers).collect();
        if let Some(answer) = self.known.borrow().get(&(call, level)).and_then(|known| known.get(&key)) {
            hit();
            return Ok(answer.clone());
        }
        let question = self.question(bound, None, state);
        let answer = self.attachments.call(&bound.attachment, &question, level)?;
        self.known.borrow_mut().entry((call, level)).or_default().insert(key, answer.clone());
        Ok(answer)
    }

    fn question(&self, bound: &Bound, proposal: Option<&Arc<str>>, state: &Values) -> Question {
        let mut question = bound.question.clone();
        question.arguments.extend(proposal.cloned());
        question.readings = bound
            .sources
            .list
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

/// A failed call as an error of the whole planning call, pointing at where the domain asks it.
pub(crate) fn report(task: &Task, failure: Failure) -> PlanError {
    let module = task.modules.iter().position(|module| module.name == failure.module);
    let list = module
        .map(|index| {
            let (message, declared) = (failure.to_string(), task.modules[index].span);
            let mut sites = sites(task, ModuleId(index as u32)).into_iter();
            let Some((who, span)) = sites.next() else {
                return Diagnostic::error("attachment-failed", message, declared, "the module declared here");
            };
            let asked = |who: &str| format!("asked here, by {who}");
            let mut finding = Diagnostic::error("attachment-failed", message, span, asked(&who));
            for (who, span) in sites {
                finding = finding.with_label(span, asked(&who));
            }
            finding.with_label(declared, format!("answered by the attachment `{}`", failure.attachment))
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
