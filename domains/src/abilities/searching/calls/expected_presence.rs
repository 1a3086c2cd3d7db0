//! `[expected-presence ?from ?on ?what]`: expected rise, by a view, of the certainty that an object
//! stands on a surface, if what the view settles turns out in the object's favour.

use descry_planner::{Answer, Call, CallError};

use super::settled;
use crate::ability::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let on = situation.surface(argument(call, 1)?)?;
    let what = situation.thing(argument(call, 2)?)?;
    if !situation.things[what].may_be_on(on) {
        return Ok(Answer::Number(0.0));
    }
    let settled = settled(situation, call, situation.doubt_about_on(what, on), true)?;
    Ok(Answer::Number((1.0 - situation.presence(what, on)) * settled))
}
