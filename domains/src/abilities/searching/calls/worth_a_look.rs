//! `[worth-a-look ?from ?on]`: whether a look from a pose may settle anything that is still in doubt. Where none may, there is
//! no plan, and the search is over.

use descry_planner::{Answer, Call, CallError};

use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let on = situation.surface(argument(call, 1)?)?;
    Ok(Answer::Truth(situation.worth_a_look(from, on, situation.planned_push(call))))
}
