//! `[expected-clarity ?from ?on]`: expected rise of a surface's clarity by a view of it.

use descry_planner::{Answer, Call, CallError};

use super::settled;
use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let on = situation.surface(argument(call, 1)?)?;
    let settled = settled(situation, call, situation.doubt_on(on), true)?;
    Ok(Answer::Number((1.0 - situation.clarity(on)) * settled))
}
