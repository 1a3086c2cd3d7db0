//! The words of a domain whose meaning is computed: one file per attachment, and the list of them.

mod can_see;
mod expected_clarity;
mod expected_completeness;
mod expected_gain;
mod path_cost;
mod program;
mod worth_a_look;
mod worth_a_push;

use std::sync::Arc;

use descry_planner::{Answer, Attachments, Call, CallError};

use crate::load::Domain;
use crate::situation::Situation;

pub use program::ProgramAttachment;

/// A function that answers calls about the current situation.
type Answers = fn(&Situation, &Call) -> Result<Answer, CallError>;

/// Every attachment that is built in: its name, the facts that its answer depends on, and what answers.
const ALL: &[(&str, &[&str], Answers)] = &[
    ("can-see", &[], can_see::answer),
    ("expected-clarity", &["observed", "pushed"], expected_clarity::answer),
    ("expected-completeness", &["observed", "pushed"], expected_completeness::answer),
    ("expected-gain", &["observed", "pushed"], expected_gain::answer),
    ("path-cost", &[], path_cost::answer),
    ("worth-a-look", &["pushed"], worth_a_look::answer),
    ("worth-a-push", &["pushed"], worth_a_push::answer),
];

/// An attachment of the list above, bound to a situation.
struct Bound {
    situation: Arc<Situation>,
    reads: &'static [&'static str],
    answers: Answers,
}

impl descry_planner::Attachment for Bound {
    fn reads(&self) -> Vec<descry_planner::Read> {
        self.reads.iter().map(|symbol| descry_planner::Read::All((*symbol).into())).collect()
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        (self.answers)(&self.situation, call)
    }
}

/// The programs that a domain names, as attachments.
pub fn programs(domain: &Domain) -> Vec<(String, Arc<ProgramAttachment>)> {
    let bind = |p: &crate::load::Program| Arc::new(ProgramAttachment::new(p.clone(), domain.folder.clone()));
    domain.config.attachments.iter().map(|(name, program)| (name.clone(), bind(program))).collect()
}

/// Every attachment, bound to the current situation. A program of the domain's own replaces a built-in of its name.
pub fn bind(
    situation: &Arc<Situation>,
    programs: &[(String, Arc<ProgramAttachment>)],
    clock_s: impl Fn() -> f64 + Send + Sync + 'static,
) -> Attachments {
    let mut attachments = Attachments::new().with_clock(clock_s);
    for &(name, reads, answers) in ALL {
        attachments.insert(name, Bound { situation: Arc::clone(situation), reads, answers });
    }
    for (name, program) in programs {
        attachments.insert_shared(name.clone(), Arc::clone(program) as Arc<dyn descry_planner::Attachment>);
    }
    attachments
}

/// The `n`-th argument of a call, by name.
fn argument(call: &Call, n: usize) -> Result<&str, CallError> {
    call.arguments
        .get(n)
        .map(|a| &**a)
        .ok_or_else(|| CallError::Failed(format!("{call} lacks argument {}", n + 1)))
}
