//! `[search-cost ?on]`: seconds that a look at a surface may turn out to have been in vain for, counted at the first look of a plan
//! there: (1 - p) / p of what going there for a look takes, where p is the probability that this look finds what is asked for.
//! With the way and the look itself that is their time by p, and surfaces are looked at in the order of that, as is best when each
//! is looked at once. Nothing where all surfaces must be looked at, and nothing where the time is limited: then only real seconds
//! count.

use descry_planner::{Answer, Call, CallError};

use crate::abilities::argument;
use crate::situation::Situation;

/// No look costs more than so many seconds for being in vain: where next to nothing is left, one look is as vain as another.
const MOST_S: f64 = 10_000.0;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let on = situation.surface(argument(call, 0)?)?;
    let begun = situation.planned_looks(call).iter().any(|look| look.1 == on);
    let is_open = |n: &usize| situation.confidence(*n) < situation.threshold;
    let mut open: Vec<usize> = (0..situation.things.len()).filter(is_open).collect();
    // What has been found is looked for in vain elsewhere, too.
    if open.is_empty() {
        open = (0..situation.things.len()).collect();
    }
    let all = open.is_empty() || !situation.kinds.is_empty();
    if begun || all || situation.time_left_s.is_some() {
        return Ok(Answer::Number(0.0));
    }
    let finds =
        |&n: &usize| situation.doubt_about(n).most_settled_on(situation, on) + situation.presence(n, on);
    let p = open.iter().map(finds).fold(0.0, f64::max).clamp(1e-6, 1.0);
    Ok(Answer::Number(((1.0 - p) / p * situation.going_there_s(on)).min(MOST_S)))
}
