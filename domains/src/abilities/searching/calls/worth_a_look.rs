//! `[worth-a-look ?from ?on]`: true if a view from a viewpoint may settle some doubt. If no view may, no
//! plan exists and the search ends.

use descry_planner::{Answer, Call, CallError};

use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let on = situation.surface(argument(call, 1)?)?;
    Ok(Answer::Truth(situation.worth_a_look(from, on, situation.planned_push(call))))
}
