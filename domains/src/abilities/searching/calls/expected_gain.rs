//! `[expected-gain ?from ?on ?what]`: expected rise of the confidence in an object by a view, if what
//! the view settles turns out in the object's favour. Doubt settled by an earlier view of the plan does
//! not count again.

use descry_planner::{Answer, Call, CallError};

use super::settled;
use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let what = situation.thing(argument(call, call.arguments.len() - 1)?)?;
    let settled = settled(situation, call, situation.doubt_about(what), call.arguments.len() > 2)?;
    Ok(Answer::Number((1.0 - situation.confidence(what)) * settled))
}
