//! `[expected-gain ?from ?what]`: by how much a look is expected to raise the confidence in an object, if what it settles
//! is settled in the object's favour. What an earlier look of the plan settles does not count again.

use descry_planner::{Answer, Call, CallError};

use super::argument;
use crate::doubt::Taken;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let what = situation.thing(argument(call, 1)?)?;
    let looks = situation.planned_looks(call);
    let before = Taken { looks: &looks, moved: situation.planned_push(call) };
    let settled = situation.doubt_about(what).share_settled(situation, from, before);
    Ok(Answer::Number((1.0 - situation.confidence(what)) * settled))
}
