//! `[path-cost ?from ?to]`: seconds that the drive takes on the map, infinite where no route leads there.

use descry_planner::{Answer, Call, CallError};

use super::argument;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let to = situation.candidate(argument(call, 1)?)?;
    Ok(Answer::Number(situation.travel_s(from, to)))
}
