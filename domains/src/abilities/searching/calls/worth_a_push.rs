//! `[worth-a-push ?from ?what]`: true if a push from a viewpoint would move an obstacle and so enable
//! views that settle what no view can settle now. Pushes are planned one at a time, as each reveals
//! whether the next is worthwhile.

use descry_planner::{Answer, Call, CallError};

use crate::ability::argument;
use crate::belief::obstacle;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let what = situation.obstacle(argument(call, 1)?)?;
    if situation.planned_push(call).is_some() {
        return Ok(Answer::Truth(false));
    }
    let uncovers = || situation.would_uncover(what);
    Ok(Answer::Truth(obstacle::push(situation, from, &situation.obstacles()[what]).is_some() && uncovers()))
}
