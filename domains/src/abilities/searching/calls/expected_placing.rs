//! `[expected-placing ?from ?on ?what]`: expected rise, by a view, of the certainty of an object's
//! position along its surface. Edges shown by an earlier view of the plan do not count again.

use descry_planner::{Answer, Call, CallError};

use crate::ability::argument;
use crate::belief::adrift;
use crate::situation::Situation;

pub(super) fn answer(situation: &Situation, call: &Call) -> Result<Answer, CallError> {
    let look = (situation.candidate(argument(call, 0)?)?, situation.surface(argument(call, 1)?)?);
    let what = situation.thing(argument(call, 2)?)?;
    let Some(track) = situation.best(what).filter(|t| situation.surface_of(t) == Some(look.1)) else {
        return Ok(Answer::Number(0.0));
    };
    let shown = adrift::share_shown(situation, look, &situation.planned_looks(call));
    Ok(Answer::Number(adrift::chance_off(situation, track) * shown))
}
