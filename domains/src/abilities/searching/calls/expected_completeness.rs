//! `[expected-completeness ?from ?on ?of]`: expected rise, by a view, of the certainty that all objects
//! of a kind are found. Zero if objects already seen from all sides keep that certainty below what is
//! required.

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
