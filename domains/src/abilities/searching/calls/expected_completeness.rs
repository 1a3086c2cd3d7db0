//! `[expected-completeness ?from ?on ?of]`: by how much a look is expected to raise the certainty of having found all of a kind.

use descry_planner::{Answer, Call, CallError};

use super::settled;
use crate::abilities::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let of = situation.kind(argument(call, call.arguments.len() - 1)?)?;
    let settled = settled(situation, call, situation.doubt_of(of), call.arguments.len() > 2)?;
    Ok(Answer::Number((1.0 - situation.completeness(of)) * settled))
}
