//! Reasons for no plan, as a sentence.

use descry_planner::{NoPlan, Refusal};

/// Description of a domain's call; `None` if unknown.
pub type Meanings<'a> = &'a dyn Fn(&str) -> Option<String>;

/// Sentence about the reasons for no plan; refused calls are grouped by meaning and counted.
pub fn told(reasons: &[NoPlan], meanings: Meanings<'_>) -> String {
    reasons.iter().map(|reason| one(reason, meanings)).collect::<Vec<_>>().join("; ")
}

fn one(reason: &NoPlan, meanings: Meanings<'_>) -> String {
    match reason {
        NoPlan::Refused { module, answer, calls } => refused(module, *answer, calls, meanings),
        NoPlan::Exhausted => "whatever is done next, and in whatever order, the goal is not reached: what it needs excludes each \
                              other, or would end too late"
            .into(),
        NoPlan::Finding { message, help: Some(help) } => format!("{message} ({help})"),
        NoPlan::Finding { message, help: None } => message.clone(),
    }
}

/// Sentence about the calls that an attachment refused.
fn refused(module: &str, answer: Refusal, calls: &[String], meanings: Meanings<'_>) -> String {
    let said = match answer {
        Refusal::No => "no",
        Refusal::Yes => "yes, where no is needed,",
        Refusal::Impossible => "impossible",
    };
    // What a number is stands before what it is in cases that are rare.
    let about = meanings(module).map(|about| about.split(';').next().unwrap_or_default().to_string());
    let times = match calls.len() {
        1 => "once".to_string(),
        n => format!("{n} times"),
    };
    match (about, calls) {
        (Some(about), _) if answer == Refusal::Impossible => {
            format!("it was asked for the {about}, and {times} there were none")
        }
        (Some(about), [only]) => format!("asked {about}, the answer is {said} for {only}"),
        (Some(about), _) => format!("it was asked {about}, {times}, and each time the answer was {said}"),
        (None, [only]) => format!("{module} is {said} for {only}"),
        (None, all) => format!("{module} is {said} in {} cases", all.len()),
    }
}
