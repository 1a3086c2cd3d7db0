//! Calls of a ground task, bound to their attachments: asks the attachments, caches their answers,
//! and names the state variables on which each answer depends.

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
use crate::outcome::PlanError;
use crate::task::{Module, ModuleId, Task};

use self::terms::{Origin, Sources, Terms};

/// Error of a failed call, passed up to [`crate::plan()`].
pub type Failure = Box<AttachmentError>;

/// Data that all calls of a module share.
struct Asked<'a> {
    /// Name of the attachment; empty if none is registered (allowed only for modules without
    /// calls).
    attachment: String,
    module: Arc<str>,
    kind: CallKind,
    /// Number of terms that the call writes.
    writes: usize,
    /// Counter of answers found in the caches here, for the statistics of the attachment; `None`
    /// without an attachment.
    hits: Option<&'a AtomicU64>,
    /// Argument positions on which the set of facts that a call reads depends.
    positions: Vec<usize>,
    /// Readings of every call, if they do not depend on the arguments; else `None`.
    sources: Option<Arc<Sources>>,
}

/// Ground call with the data of its module: argument object ids, and the places of its readings.
#[derive(Clone, Copy)]
struct Bound<'b> {
    asked: &'b Asked<'b>,
    arguments: &'b [u32],
    sources: &'b Sources,
}

/// Cached answers of one call, by the packed values of the variables and numbers that it reads.
type Known = FxHashMap<Box<[u64]>, Answer>;

/// Refused call: its id, the truth value that was needed, and the proposed parameter if there is
/// one.
type Refusal = (CallId, bool, Option<Arc<str>>);

/// Every call of a ground task, bound to its attachment.
pub struct Calls<'a> {
    task: &'a Task,
    ground: &'a GroundTask,
    attachments: &'a Attachments,
    names: Vec<Arc<str>>,
    /// Data shared by the calls of a module, by module index.
    asked: Vec<Asked<'a>>,
    /// Readings of each call, by call id.
    sources: Vec<Arc<Sources>>,
    /// Cached answers, exact (index 0) and relaxed (index 1), of calls that read nothing and have no
    /// proposed parameter, by call id.
    settled: RefCell<Vec<[Option<Answer>; 2]>>,
    /// Cached answers, exact (index 0) and relaxed (index 1), of calls that read something and have no
    /// proposed parameter, by call id.
    known: RefCell<Vec<[Known; 2]>>,
    /// Scratch buffer for cache keys.
    read: RefCell<Vec<u64>>,
    terms: Terms,
    /// Calls whose answer differed from the truth value needed.
    refused: RefCell<FxHashSet<Refusal>>,
}

impl<'a> Calls<'a> {
    /// Binds the calls of `ground` to their attachments.
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
            asked: Vec::new(),
            sources: Vec::with_capacity(ground.calls.len()),
            settled: RefCell::new(vec![[None, None]; ground.calls.len()]),
            known: RefCell::new((0..ground.calls.len()).map(|_| Default::default()).collect()),
            read: RefCell::default(),
            terms: Terms::default(),
            refused: RefCell::default(),
        };
        if attachments.names().any(|name| !attachments.reads(name).is_empty()) {
            calls.terms = Terms::new(ground);
        }
        calls.asked = task.modules.iter().map(|module| calls.asked(module)).collect();
        // What is read at positions of the arguments is the same for all that agree there.
        let mut known: FxHashMap<(usize, Vec<u32>), Arc<Sources>> = FxHashMap::default();
        for call in &ground.calls {
            let (module, arguments) = (call.origin.schema as usize, &call.origin.arguments);
            let positions = &calls.asked[module].positions;
            let there = positions.iter().filter_map(|&at| arguments.get(at)).copied().collect();
            let sources = known.entry((module, there)).or_insert_with(|| calls.sources_of(module, arguments));
            calls.sources.push(Arc::clone(sources));
        }
        Ok(calls)
    }

    /// The attachments that the calls are bound to.
    pub fn attachments(&self) -> &'a Attachments {
        self.attachments
    }

    fn asked(&self, declared: &Module) -> Asked<'a> {
        let attachment =
            self.attachments.resolve(&declared.function, &declared.name).unwrap_or_default().to_string();
        let reads = self.attachments.reads(&attachment);
        let at = |read: &Read| if let Read::At(_, positions) = read { positions.clone() } else { Vec::new() };
        let mut positions: Vec<usize> = reads.iter().flat_map(at).flatten().collect();
        positions.sort_unstable();
        positions.dedup();
        Asked {
            module: declared.name.as_str().into(),
            kind: declared.kind,
            writes: declared.writes.len(),
            hits: self.attachments.hits(&attachment),
            sources: positions.is_empty().then(|| Arc::new(self.read_by(&attachment, &[]))),
            positions,
            attachment,
        }
    }

    fn read_by(&self, attachment: &str, arguments: &[u32]) -> Sources {
        let reads = self.attachments.reads(attachment).iter();
        let list = reads.flat_map(|read| self.terms.readings(self.task, &self.names, read, arguments));
        Sources::new(list.collect())
    }

    fn sources_of(&self, module: usize, arguments: &[u32]) -> Arc<Sources> {
        let asked = &self.asked[module];
        asked.sources.clone().unwrap_or_else(|| Arc::new(self.read_by(&asked.attachment, arguments)))
    }

    fn bound(&self, call: CallId) -> Bound<'_> {
        let origin = &self.ground.calls[call as usize].origin;
        let asked = &self.asked[origin.schema as usize];
        Bound { asked, arguments: &origin.arguments, sources: &self.sources[call as usize] }
    }

    /// Truth that the condition module of `call` answers.
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

    /// True if the condition module of `call` answers `wanted`; otherwise records the refusal.
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

    /// Duration or cost that the cost module of `call` answers.
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

    /// Calls an effect module in one state and writes the values that it answers into another
    /// state.
    pub fn write(
        &self,
        call: CallId,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
        into: &mut Values,
    ) -> Result<(), Failure> {
        let places = &self.ground.calls[call as usize].writes;
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

    /// Value of an object fluent's variable that stands for the object `name` (`None`: for
    /// undefined); `None` if the variable has no such value.
    fn object_value(&self, variable: VariableId, name: Option<&Arc<str>>) -> Option<u32> {
        let means = |meaning: &Meaning| match meaning {
            Meaning::Object { value: Some(object), .. } => name == Some(&self.names[*object as usize]),
            Meaning::Object { value: None, .. } => name.is_none(),
            _ => false,
        };
        let values = &self.ground.variables[variable as usize].values;
        values.iter().position(means).map(|value| value as u32)
    }

    /// Names that a grounding module of the lifted task proposes for the parameter of an action.
    pub fn proposals(
        &self,
        module: usize,
        arguments: &[u32],
        state: &Values,
    ) -> Result<Vec<Arc<str>>, Failure> {
        let sources = self.sources_of(module, arguments);
        let bound = Bound { asked: &self.asked[module], arguments, sources: &sources };
        match self.ask(bound, None, state, Level::Exact)? {
            Answer::Proposals(names) => Ok(names),
            other => Err(self.unfit(bound, &other)),
        }
    }

    /// State variables and numbers that the call reads.
    pub fn reads(&self, call: CallId) -> (&[VariableId], &[NumericId]) {
        let sources = &self.sources[call as usize];
        (&sources.variables, &sources.numbers)
    }

    /// True if the call reads nothing, so its answer (without a proposed parameter) is the same in
    /// all states.
    pub fn settles(&self, call: CallId) -> bool {
        let (variables, numbers) = self.reads(call);
        variables.is_empty() && numbers.is_empty()
    }

    /// Refusals recorded so far, by module and needed answer.
    pub fn refusals(&self) -> Refusals {
        let mut refusals = Refusals::default();
        let refused = self.refused.borrow();
        let mut refused: Vec<_> = refused.iter().collect();
        refused.sort_unstable();
        for (call, wanted, proposal) in refused {
            let question = self.unread(self.bound(*call), proposal.as_ref());
            let module = self.ground.calls[*call as usize].origin.schema;
            refusals.entry((module, *wanted)).or_default().push(question.to_string());
        }
        refusals
    }

    /// Kind of the called module.
    pub fn kind(&self, call: CallId) -> CallKind {
        self.bound(call).asked.kind
    }

    fn answer(
        &self,
        call: CallId,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
    ) -> Result<Answer, Failure> {
        let bound = self.bound(call);
        if proposal.is_some() {
            return self.ask(bound, proposal, state, level);
        }
        let hit = || {
            bound.asked.hits.into_iter().for_each(|hits| {
                hits.fetch_add(1, Ordering::Relaxed);
            });
        };
        if self.settles(call) {
            if let Some(answer) = &self.settled.borrow()[call as usize][level as usize] {
                hit();
                return Ok(answer.clone());
            }
            let answer = self.ask(bound, None, state, level)?;
            self.settled.borrow_mut()[call as usize][level as usize] = Some(answer.clone());
            return Ok(answer);
        }
        let key = {
            let mut key = self.read.borrow_mut();
            self.what_is_read(bound.sources, state, &mut key);
            if let Some(answer) = self.known.borrow()[call as usize][level as usize].get(key.as_slice()) {
                hit();
                return Ok(answer.clone());
            }
            Box::from(key.as_slice())
        };
        let answer = self.ask(bound, None, state, level)?;
        self.known.borrow_mut()[call as usize][level as usize].insert(key, answer.clone());
        Ok(answer)
    }

    /// Writes the cache key of a state to `words`: values of the variables read, packed into words
    /// of 64 bits, then the numbers read.
    fn what_is_read(&self, sources: &Sources, state: &Values, words: &mut Vec<u64>) {
        words.clear();
        let (mut word, mut room) = (0, 1_u64);
        for &variable in &sources.variables {
            let value = u64::from(state.values[variable as usize]);
            let many = u64::from(self.ground.variables[variable as usize].domain_size().max(2));
            match room.checked_mul(many) {
                Some(more) => (word, room) = (word + value * room, more),
                None => {
                    words.push(word);
                    (word, room) = (value, many);
                }
            }
        }
        words.push(word);
        // Adding zero makes -0.0 and 0.0 one key.
        words.extend(sources.numbers.iter().map(|&number| (state.numbers[number as usize] + 0.0).to_bits()));
    }

    fn ask(
        &self,
        bound: Bound,
        proposal: Option<&Arc<str>>,
        state: &Values,
        level: Level,
    ) -> Result<Answer, Failure> {
        let mut question = self.unread(bound, proposal);
        let readings = bound.sources.list.iter().map(|(symbol, arguments, origin)| Reading {
            symbol: symbol.clone(),
            arguments: arguments.clone(),
            value: self.value(origin, state),
        });
        question.readings = readings.collect();
        Ok(self.attachments.call(&bound.asked.attachment, &question, level)?)
    }

    /// Question of a call with its arguments and an empty list of readings.
    fn unread(&self, bound: Bound, proposal: Option<&Arc<str>>) -> Question {
        let arguments = bound.arguments.iter().map(|&object| &self.names[object as usize]);
        Question {
            module: bound.asked.module.clone(),
            kind: bound.asked.kind,
            arguments: arguments.chain(proposal).cloned().collect(),
            readings: Vec::new(),
        }
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
        self.unfit(self.bound(call), answer)
    }

    fn unfit(&self, bound: Bound, answer: &Answer) -> Failure {
        let question = self.unread(bound, None);
        let expected = match question.kind {
            CallKind::Effect => format!("{} values that fit the terms of the module", bound.asked.writes),
            kind => format!("an answer of a {kind} module"),
        };
        Box::new(AttachmentError {
            call: question.to_string(),
            module: question.module.to_string(),
            attachment: bound.asked.attachment.clone(),
            cause: CallError::WrongAnswer { expected, got: format!("{answer:?}") },
        })
    }

    /// Planning error for a failed call, with a finding that points at the call in the domain.
    pub fn report(&self, failure: Failure) -> PlanError {
        report(self.task, failure)
    }
}

/// Planning error for a failed call, pointing at the call in the domain.
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

fn number_value(number: f64) -> FactValue {
    if number.is_nan() { FactValue::Undefined } else { FactValue::Number(number) }
}
