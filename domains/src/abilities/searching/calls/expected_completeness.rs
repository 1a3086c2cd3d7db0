//! `[expected-completeness ?from ?on ?of]`: by how much a look is expected to raise the certainty of having found all of a kind. Where
//! the objects that were seen from all sides leave too little of that, no look is expected to.

use descry_planner::{Answer, Call, CallError};

use super::settled;
use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let of = situation.kind(argument(call, call.arguments.len() - 1)?)?;
    if !situation.can_be_complete(of) {
        return Ok(Answer::Number(0.0));
    }
    let settled = settled(situation, call, situation.doubt_of(of), call.arguments.len() > 2)?;
    Ok(Answer::Number((1.0 - situation.completeness(of)) * settled))
}
