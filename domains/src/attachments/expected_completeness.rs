//! `[expected-completeness ?from ?of]`: by how much a look is expected to raise the certainty of having found all of a kind.

use descry_planner::{Answer, Call, CallError};

use super::argument;
use crate::doubt::Taken;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let of = situation.kind(argument(call, 1)?)?;
    let looks = situation.planned_looks(call);
    let before = Taken { looks: &looks, moved: situation.planned_push(call) };
    let settled = situation.doubt_of(of).share_settled(situation, from, before);
    Ok(Answer::Number((1.0 - situation.completeness(of)) * settled))
}
