//! `[expected-clarity ?from ?on]`: by how much a look is expected to raise the clarity of a surface.

use descry_planner::{Answer, Call, CallError};

use super::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let on = situation.surface(argument(call, 1)?)?;
    let planned = situation.planned_looks(call);
    let doubt = situation.doubt_on(on);
    Ok(Answer::Number((1.0 - situation.clarity(on)) * doubt.share_settled(situation, from, &planned)))
}
