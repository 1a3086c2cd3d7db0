//! Outcomes of a plan's steps, and the state of the run after each observation.

use descry_agent::report::failed;
use descry_domains::note::{BeliefChange, Note, OnTheFloor};
use descry_domains::saying::Saying;
use descry_skills::Call;

use super::chapters::{Chapter, Deed};
use super::looks;
use super::standings::Standing;
use super::wording::count;
use descry_agent::weigh::Expected;

/// Sentences about an outcome, or about the state of the run after an observation.
#[derive(Debug)]
pub struct Outcome {
    /// Time of the state on the body's clock, nanoseconds; `None` for the outcome of a step.
    pub stood_ns: Option<i64>,
    /// Text of one or more sentences.
    pub said: String,
}

/// Outcomes of a plan's steps in order, with the state of the run after each observation. `goal` is
/// in PDDL.
pub fn of(chapter: &Chapter, goal: &str, saying: &Saying) -> Vec<Outcome> {
    let hoped: &[Expected] = chapter.weighed.as_ref().map_or(&[], |weighed| &weighed.numbers);
    let asked = looks::Hopes { goal, hoped, saying };
    let mut said = Vec::new();
    let mut before: Option<&Standing> = chapter.before.as_ref();
    let mut noted: Vec<&Note> = Vec::new();
    let mut under_way: Vec<&Call> = Vec::new();
    let mut was_begun = false;
    for deed in &chapter.deeds {
        match deed {
            Deed::Began(call) => {
                if !was_begun {
                    under_way.clear();
                }
                under_way.push(call);
            }
            Deed::Stands(now) => {
                let is_look = |note: &&Note| matches!(note, Note::Perceived { .. } | Note::Nothing { .. });
                if noted.iter().any(is_look) {
                    let stood = |said| Outcome { stood_ns: Some(now.stamp_ns), said };
                    said.extend(looks::told(before, now, &noted, &asked).into_iter().map(stood));
                    before = Some(now);
                }
                noted.clear();
            }
            Deed::Noted(note) => noted.push(note),
            _ => {}
        }
        was_begun = matches!(deed, Deed::Began(_));
        let doing = if let [only] = under_way.as_slice() { Some(*only) } else { None };
        let came = outcome(deed, doing, chapter.before.is_some(), saying);
        said.extend(came.map(|said| Outcome { stood_ns: None, said }));
    }
    said
}

/// Sentence about an event; `None` if it adds nothing. `doing`: the step that is being executed, if
/// it is the only one. `has_standings`: the record has the state after each observation, so that
/// changes of confidence need not be told here.
fn outcome(deed: &Deed, doing: Option<&Call>, has_standings: bool, saying: &Saying) -> Option<String> {
    let say = |call: &Call| saying.say(&call.to_string());
    let by = doing.map(|call| format!("{}: ", say(call))).unwrap_or_default();
    Some(match deed {
        Deed::Began(_) | Deed::Stands(_) => return None,
        Deed::Ended(call, said) => format!("{}: {said}.", say(call)),
        Deed::Failed { call, because, unkept, changed, .. } => {
            let since = changed.as_ref().filter(|c| !c.is_empty());
            let since = since.map(|c| format!(" From then on: {}.", c.told(saying))).unwrap_or_default();
            format!("{} failed: {}.{since}", say(call), failed(because, unkept.as_deref(), saying))
        }
        Deed::Resumed => {
            "here the run was cut off; it was gone on with from its record, and what had been done was not done again."
                .into()
        }
        Deed::Noted(Note::Perceived { on, merged, left_out, residual_m, objects, changed, .. }) => {
            let views = match merged {
                1 => "one view".to_string(),
                n => format!("{n} views (aligned to {:.1} mm)", residual_m * 1e3),
            };
            let left_out: String = left_out.iter().map(|view| format!("; {view}")).collect();
            let is_said = |change: &&BeliefChange| has_standings && matches!(change, BeliefChange::Confidence { .. });
            let changed: String =
                changed.iter().filter(|c| !is_said(c)).map(|change| format!("; {change}")).collect();
            format!("{by}the {on}, in {views}, shows {}{left_out}{changed}.", shown(objects.len()))
        }
        // What to set otherwise is for who programs it.
        Deed::Noted(Note::Nothing { because, is_left_out, .. }) => {
            let kept = if *is_left_out { "" } else { " Further views may still make use of it." };
            format!("{by}the look showed nothing that things could stand on: {because}.{kept}")
        }
        Deed::Noted(Note::Swept { things }) => swept(things),
        Deed::Noted(note) => {
            let text = note.to_string();
            let lines: Vec<&str> = text.lines().map(str::trim).collect();
            format!("{}.", lines.join("; "))
        }
    })
}

fn shown(objects: usize) -> String {
    if objects == 0 { "no object".into() } else { count(objects, "object") }
}

/// Clause about the objects found by a laser sweep; distant ones are only counted.
pub fn swept(things: &[OnTheFloor]) -> String {
    let is_far = |thing: &&OnTheFloor| matches!(thing, OnTheFloor::Thing { is_far: true, .. });
    let (far, near): (Vec<&OnTheFloor>, Vec<&OnTheFloor>) = things.iter().partition(is_far);
    let far = (!far.is_empty()).then(|| format!("{} seen from afar", far.len()));
    let all: Vec<String> = near.into_iter().map(|thing| thing.text().to_string()).chain(far).collect();
    let on_the_floor = match things.len() {
        1 => "1 thing on the floor".to_string(),
        n => format!("{n} things on the floor"),
    };
    format!("{on_the_floor}: {}.", all.join("; "))
}
