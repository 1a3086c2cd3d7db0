//! Semantics of conditions, expressions and effects, shared by all parts that apply actions.
//!
//! The validator, the monitor and the executive call it directly. The meaning of times is that of PDDL
//! 2.1 (Fox and Long 2003, section 8).

pub(crate) mod calls;
mod conditions;
mod derive;
mod describe;
mod differences;
pub(crate) mod effects;
pub(crate) mod reads;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use crate::attachment::{AttachmentError, Attachments};
use crate::diagnostic::{Diagnostic, Findings, Span};
use crate::plan::Step;
use crate::state::State;
use crate::task::{ActionId, ObjectId, Slot, Task};

pub(crate) use conditions::value_text;
pub use conditions::{Compared, Why};
pub use effects::{Changes, Clash, Pending};
pub use reads::{Together, Touched};

/// Object that stands for an unbound slot.
pub(crate) const UNBOUND: ObjectId = ObjectId(u32::MAX);

/// Values for the variables of an action, rule or formula.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    /// Object of each slot; a reserved identifier while the slot is unbound.
    pub objects: Vec<ObjectId>,
    /// `?duration`, in seconds; `None` if the action has none.
    pub duration_s: Option<f64>,
    /// Arguments proposed by grounding modules; calls of the action get them after their own arguments.
    pub proposals: Vec<Arc<str>>,
}

impl Binding {
    /// Binding of a number of slots, all unbound.
    pub fn new(slots: usize) -> Binding {
        Binding { objects: vec![UNBOUND; slots], duration_s: None, proposals: Vec::new() }
    }

    fn get(&self, slot: Slot) -> ObjectId {
        self.objects.get(slot.index()).copied().unwrap_or(UNBOUND)
    }

    fn set(&mut self, slot: Slot, object: ObjectId) {
        if let Some(place) = self.objects.get_mut(slot.index()) {
            *place = object;
        }
    }
}

/// Failure of an attachment during evaluation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{error}")]
pub struct CallFailure {
    /// The failed call.
    pub error: AttachmentError,
    /// Span of the call in the domain.
    pub span: Span,
}

impl CallFailure {
    /// Findings to be drawn under the call in the text of the task.
    pub fn findings(&self, task: &Task) -> Findings {
        let finding =
            Diagnostic::error("attachment-failed", self.error.to_string(), self.span, "this call failed");
        Findings { sources: task.sources.to_vec(), list: vec![finding] }
    }
}

/// Mismatch between a step of a plan and the task.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// The mismatch, in a sentence.
    pub reason: String,
    /// Span of the declaration that the step violates; `None` if there is no such declaration.
    pub span: Option<Span>,
}

/// Evaluator of a task's conditions and effects, with the attachments that its modules call.
pub struct Semantics<'a> {
    /// The task.
    pub task: &'a Task,
    /// Attachments that implement the task's modules.
    pub attachments: &'a Attachments,
    /// Name under which each module's attachment is registered.
    bound: Vec<String>,
    object_names: Vec<Arc<str>>,
    module_names: Vec<Arc<str>>,
    /// True, by predicate, if an action, rule, module or timed literal may change it.
    changing: Vec<bool>,
    stop: &'a (dyn Fn() -> bool + Sync),
    /// Number of objects tried for quantified variables so far.
    tried: AtomicU32,
    stopped: AtomicBool,
}

/// Number of tried objects between two checks of the stop signal.
const TRIED_AT_ONCE: u32 = 4096;

impl<'a> Semantics<'a> {
    /// Evaluator of a task; a module without an attachment fails when called.
    pub fn new(task: &'a Task, attachments: &'a Attachments) -> Semantics<'a> {
        Self::until(task, attachments, &|| false)
    }

    /// Evaluator that stops trying objects once `stop` returns true; its answers are meaningless from
    /// then on ([`Semantics::is_stopped`]).
    pub(crate) fn until(
        task: &'a Task,
        attachments: &'a Attachments,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Semantics<'a> {
        let bound = task.modules.iter().map(|module| {
            attachments.resolve(&module.function, &module.name).unwrap_or(&module.function).to_string()
        });
        Semantics {
            task,
            attachments,
            bound: bound.collect(),
            object_names: task.objects.iter().map(|object| object.name.as_str().into()).collect(),
            module_names: task.modules.iter().map(|module| module.name.as_str().into()).collect(),
            changing: reads::changing(task),
            stop,
            tried: AtomicU32::new(0),
            stopped: AtomicBool::new(false),
        }
    }

    /// True if evaluation was stopped, so that objects may have been skipped.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// Counts one more tried object; `false` once evaluation is stopped.
    fn go_on(&self) -> bool {
        let tried = self.tried.fetch_add(1, Ordering::Relaxed);
        if tried % TRIED_AT_ONCE == TRIED_AT_ONCE - 1 && (self.stop)() {
            self.stopped.store(true, Ordering::Relaxed);
        }
        !self.is_stopped()
    }

    /// Initial state, derived facts included.
    pub fn initial(&self) -> Result<State, CallFailure> {
        let mut state = State::initial(self.task);
        self.derive(&mut state)?;
        Ok(state)
    }

    /// Action that a step names, with the step's arguments and duration as its binding.
    pub fn bind(&self, step: &Step) -> Result<(ActionId, Binding), Misfit> {
        let task = self.task;
        let Some(at) = task.actions.iter().position(|action| action.name.eq_ignore_ascii_case(&step.action))
        else {
            let known = task.actions.iter().map(|action| action.name.as_str());
            let near = crate::pddl::nearest(&step.action, known);
            let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            return Err(Misfit {
                reason: format!("no action is called `{}`{hint}", step.action),
                span: None,
            });
        };
        let action = &task.actions[at];
        let (wanted, found) = (action.parameters.len() + action.grounding.len(), step.arguments.len());
        if wanted != found {
            let reason = format!("`{}` takes {wanted} arguments, found {found}", action.name);
            return Err(Misfit { reason, span: Some(action.span) });
        }
        let mut binding = Binding::new(action.slots);
        for (index, (parameter, name)) in action.parameters.iter().zip(&step.arguments).enumerate() {
            let Some(object) = task.find_object(name) else {
                let reason = format!("no object is called `{name}`");
                return Err(Misfit { reason, span: Some(parameter.span) });
            };
            if parameter.objects.binary_search(&object).is_err() {
                let types: Vec<&str> =
                    parameter.types.iter().map(|&id| task.type_of(id).name.as_str()).collect();
                let reason =
                    format!("`{name}` is no {}, which {} must be", types.join(" or "), parameter.name);
                return Err(Misfit { reason, span: Some(parameter.span) });
            }
            binding.objects[index] = object;
        }
        binding.duration_s = action.is_durative().then_some(step.duration_s);
        binding.proposals =
            step.arguments[action.parameters.len()..].iter().map(|name| name.as_str().into()).collect();
        Ok((ActionId(at as u32), binding))
    }
}
