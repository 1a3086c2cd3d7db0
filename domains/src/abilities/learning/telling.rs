//! Final answers to the questions "what is new" and "what has changed".

use super::PATROLLED;
use super::news::{DIRECTIONS, Fate, Novelty, Place};
use super::taken::size;
use crate::abilities::learning::news::Difference;
use crate::conclusion::{Believed, Conclusion, Ended, Verdict};
use crate::english::percent;
use crate::mind::Mind;
use crate::objective::Goal;
use crate::situation::Situation;

/// Minimum share of an object's sides that must be seen to call it seen from all around.
const ALL_ROUND: f64 = 0.9;

/// Answers a goal about learning; `None` for other goals.
pub(super) fn answer(goal: &Goal, mind: &Mind, s: &Situation, ended: &Ended) -> Option<Conclusion> {
    goal.asked.of_word(PATROLLED).next()?;
    let is_to_learn = goal.asked.of_word("settled").next().is_some();
    let (verdict, why) = told(mind, s, ended, is_to_learn);
    let objects: Vec<Believed> = mind.known.news().novelties.iter().map(|n| believed(mind, n)).collect();
    Some(Conclusion {
        verdict,
        why,
        confidence: f64::from(u8::from(verdict == Verdict::Achieved)),
        remaining: None,
        object: None,
        found: None,
        objects,
        remembered: None,
    })
}

fn told(mind: &Mind, s: &Situation, ended: &Ended, is_to_learn: bool) -> (Verdict, String) {
    let news = mind.known.news();
    if s.past.is_none() {
        let text = "no earlier visit is known to compare with: name a store with --remember, and come again";
        return (Verdict::CannotTell, text.into());
    }
    if news.places.is_empty() {
        return (Verdict::CannotTell, "there is nothing to visit: the map knows no surface".into());
    }
    let mut said: Vec<String> = news.novelties.iter().map(|n| fate(mind, n, is_to_learn)).collect();
    said.extend(news.changes.iter().map(changed));
    let nothing = if is_to_learn { "nothing is new" } else { "nothing has changed" };
    let compared =
        |p: &&Place| p.is_visited && p.strange.is_none() && p.room.as_ref().is_some_and(|r| r.visits > 1);
    let count = news.places.iter().filter(compared).count();
    if said.is_empty() {
        said.push(if count == 0 { "nothing can be new yet".into() } else { nothing.into() });
    }
    let first = news.places.iter().filter(|p| p.is_visited && p.room.as_ref().is_some_and(|r| r.visits == 1));
    let first: Vec<&str> = first.map(|p| p.waypoint.as_str()).collect();
    if !first.is_empty() {
        said.push(format!("seen for the first time, and remembered: {}", first.join(", ")));
    }
    let mut open = open(s, news.places.iter(), &news.novelties, is_to_learn);
    match ended {
        Ended::Reached => {}
        Ended::Limit(why) | Ended::Failed(why) => open.push(why.clone()),
        Ended::NoPlan(_) | Ended::Undecided(_) => match s.time_left_s {
            Some(left_s) if left_s <= 0.0 => open.push("there is no time left".into()),
            _ if open.is_empty() => open.push("nothing that is left can be done".into()),
            _ => {}
        },
    }
    let looks = format!("after {} looks and {:.1} m", mind.views, mind.distance_m);
    let verdict = match (ended, open.is_empty()) {
        (Ended::Failed(_), _) => Verdict::Failed,
        (_, true) => Verdict::Achieved,
        (_, false) => Verdict::CannotTell,
    };
    said.extend(open);
    (verdict, format!("{}; {looks}", said.join("; ")))
}

/// Reasons why the answer may be incomplete.
fn open<'a>(
    s: &Situation,
    places: impl Iterator<Item = &'a Place>,
    novelties: &[Novelty],
    is_to_learn: bool,
) -> Vec<String> {
    let left = |p: &Place| match (&p.strange, p.is_visited) {
        (Some(why), _) => {
            Some(format!("what {} shows cannot be compared with earlier visits: {why}", p.waypoint))
        }
        (None, false) => Some(format!("{} was not visited", p.waypoint)),
        (None, true) => None,
    };
    let mut open: Vec<String> = places.filter_map(left).collect();
    let seen: std::collections::BTreeSet<&str> =
        s.news().places.iter().filter(|p| p.is_visited).map(|p| p.on.as_str()).collect();
    let unseen = s.surfaces.iter().filter(|k| !seen.contains(k.symbol.as_str()));
    open.extend(unseen.map(|k| format!("the {} was not looked at", k.name)));
    if is_to_learn {
        let given_up = novelties.iter().filter(|n| matches!(n.fate, Fate::GivenUp(_) | Fate::Open)).count();
        if given_up > 0 {
            open.push(format!("{given_up} of what is new is not learned"));
        }
    }
    open
}

fn fate(mind: &Mind, n: &Novelty, is_to_learn: bool) -> String {
    let at = format!("at ({:.2}, {:.2}, {:.2}) m", n.centre.x, n.centre.y, n.centre.z);
    let surface = mind.known.surfaces.iter().find(|s| s.symbol == n.on);
    let on = surface.map_or(String::new(), |s| format!(" on the {}", s.name));
    match &n.fate {
        Fate::Learned { name, looks, sides } => {
            let all_round = match *sides >= ALL_ROUND {
                true => "from all around".into(),
                false => format!("from {:.0} % of its sides alone", 1e2 * sides),
            };
            format!(
                "something new{on} {at} is learned as \"{name}\", seen {all_round} in {} of {} looks",
                looks.0, looks.1
            )
        }
        Fate::Known { name, confidence, model } => {
            let model = model.as_ref().map(|model| format!(", {model}")).unwrap_or_default();
            format!("{name} stands{on} {at} ({} sure){model}", percent(*confidence))
        }
        Fate::GivenUp(because) => format!("something new{on} {at} could not be learned: {because}"),
        Fate::Open if is_to_learn => {
            let sides = 1e2 * n.seen().len() as f64 / DIRECTIONS as f64;
            format!("something new{on} {at} is not learned: {sides:.0} % of its sides were seen")
        }
        Fate::Open => format!("something new stands{on} {at}"),
    }
}

fn changed(change: &Difference) -> String {
    match change {
        Difference::Came { name, at, before } => format!(
            "{name} stands at ({:.2}, {:.2}) m now, and was seen at ({:.2}, {:.2}) m before",
            at.x, at.y, before.x, before.y
        ),
        Difference::Left { name, at } => format!("{name} is no longer at ({:.2}, {:.2}) m", at.x, at.y),
        Difference::Gone { at, size_m } => {
            format!("something that always stood there is gone, {}", size(size_m, at))
        }
        Difference::Beside { at, size_m } => {
            format!("something stands on no surface where nothing stood before, {}", size(size_m, at))
        }
    }
}

fn believed(mind: &Mind, n: &Novelty) -> Believed {
    let (label, confidence) = match &n.fate {
        Fate::Learned { name, .. } => (Some(name.clone()), 1.0),
        Fate::Known { name, confidence, .. } => (Some(name.clone()), *confidence),
        Fate::Open | Fate::GivenUp(_) => (None, 1.0),
    };
    let surface = mind.known.surfaces.iter().find(|s| s.symbol == n.on);
    Believed {
        asked: true,
        kind: label.clone(),
        label,
        confidence,
        position_m: Some(n.centre.coords.into()),
        position_sigma_m: None,
        size_m: n.size_m,
        on: surface.map(|s| s.name.clone()),
        room: surface.and_then(|s| s.room.clone()),
    }
}
