//! `[path-cost ?from ?to]`: driving time on the map, seconds, past the doors that are shut at that point
//! of the plan; infinite where no route leads.

use std::collections::BTreeSet;

use descry_planner::{Answer, Call, CallError};

use crate::ability::argument;
use crate::situation::{Situation, holding};

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let from = situation.candidate(argument(call, 0)?)?;
    let to = situation.candidate(argument(call, 1)?)?;
    let shut: BTreeSet<usize> =
        holding(call, "shut").filter_map(|r| situation.door(r.arguments.first()?).ok()).collect();
    Ok(Answer::Number(situation.travel_past_s(from, to, &shut)))
}
