//! `[can-see ?from ?on]`: true if a view from a viewpoint shows any part of a surface, by field of
//! view and range.

use descry_planner::{Answer, Call, CallError};

use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let on = situation.surface(argument(call, 1)?)?;
    Ok(Answer::Truth(situation.sees(from, on)))
}
