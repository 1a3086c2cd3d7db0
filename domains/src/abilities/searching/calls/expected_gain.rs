//! `[expected-gain ?from ?on ?what]`: by how much a look is expected to raise the confidence in an object, if what it settles
//! is settled in the object's favour. What an earlier look of the plan settles does not count again.

use descry_planner::{Answer, Call, CallError};

use super::settled;
use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let what = situation.thing(argument(call, call.arguments.len() - 1)?)?;
    let settled = settled(situation, call, situation.doubt_about(what), call.arguments.len() > 2)?;
    Ok(Answer::Number((1.0 - situation.confidence(what)) * settled))
}
