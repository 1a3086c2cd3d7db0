//! Texts on remaining doubts, and on what was seen.

use descry_memory::belief::Track;
use descry_perception::nalgebra::{self, Point3, Vector3};

use crate::belief::doubt::Doubt;
use crate::english::{percent, plural};
use crate::known::Thing;
use crate::situation::Situation;
use crate::surface::KnownSurface;

/// Minimum probability that an answer mentions.
pub const WORTH_SAYING: f64 = 0.01;
/// Reason why the absence of a thing cannot be claimed; `None` if it can.
pub fn left_about(s: &Situation, what: usize) -> Option<String> {
    if let Some(late) = out_of_time(s) {
        return Some(late);
    }
    let thing = &s.things[what];
    let p = |t: &Track| thing.probability(t, &s.surfaces);
    let best = s.belief.tracks.iter().max_by(|a, b| p(a).total_cmp(&p(b)));
    if let Some(track) = best.filter(|t| p(t) > 1.0 - s.thresholds.confidence) {
        let (at, p) = (place(&track.position_m), percent(p(track)));
        return Some(format!("what stands at {at} may be it ({p}{})", rather(track, thing)));
    }
    if s.chance_lost(what) > s.thresholds.not_there {
        return Some("it was lost out of the hand, and where it lies was not seen".into());
    }
    if let Some(floor) = may_be_none(s, thing) {
        return Some(floor);
    }
    let doubt = s.doubt_about(what);
    if doubt.can_be_settled(s) {
        return Some("there are looks that would settle it, and no plan leads through them".into());
    }
    let (left, t) = (doubt.hidden, &s.thresholds);
    let unsettled = || {
        let text = "there is room for it where looks promised to settle that, and did not";
        (left > t.remaining + t.out_of_sight).then(|| format!("{text} ({})", percent(left)))
    };
    let in_all = || {
        let there = s.chance_there(what);
        let most = best.filter(|track| p(track) > left);
        let text = most.map_or("there is room for it".into(), |track| {
            let (at, rather) = (place(&track.position_m), rather(track, thing));
            format!("what stands at {at} is hardly it ({}{rather}), but may be", percent(p(track)))
        });
        (there > t.not_there).then(|| format!("{text}; {} is left in all", percent(there)))
    };
    out_of_sight(s, doubt, "it").or_else(unsettled).or_else(in_all)
}

/// Clause on the known object that a seen object more likely is than `thing`, and on its colour; empty
/// if there is none.
pub fn rather(track: &Track, thing: &Thing) -> String {
    let is_it = |name: &str| thing.models.iter().any(|m| m.name == name);
    likelier(&track.probabilities, track.probability_of(&thing.name), is_it) + &colour(track, thing)
}

/// Clause on the colour that a seen object more likely has than the requested one, with its probability,
/// or on its colour not having been seen; empty if colour decides nothing.
fn colour(track: &Track, thing: &Thing) -> String {
    let decides = thing.colour.is_some() || thing.models.iter().any(|m| !m.colours.is_empty());
    match thing.colour {
        _ if decides && track.colours.is_empty() => "; its colour was not seen".into(),
        Some(asked) => {
            let p = track.colours.iter().find(|(name, _)| name == asked).map_or(0.0, |(_, p)| *p);
            likelier(&track.colours, p, |name| name == asked)
        }
        None => String::new(),
    }
}

#[doc(hidden)]
pub fn likelier(probabilities: &[(String, f64)], than: f64, is_it: impl Fn(&str) -> bool) -> String {
    let others = probabilities.iter().filter(|(name, p)| !is_it(name) && *p > than);
    let most = others.max_by(|a, b| a.1.total_cmp(&b.1));
    most.map_or_else(String::new, |(name, p)| format!("; rather {name}, {}", percent(*p)))
}

/// Sentence about a searched surface that may not be a supporting surface, or whose views may be false; `None` if there is no
/// doubt.
pub fn may_be_none(s: &Situation, thing: &Thing) -> Option<String> {
    let asked = s.surfaces.iter().enumerate().filter(|(n, _)| thing.may_be_on(*n));
    asked.into_iter().find_map(|(_, k)| {
        if let Some(doubt) = &k.doubtful {
            return Some(format!("what was taken for the {} {doubt}", k.name));
        }
        let about = || {
            let chance = percent(k.sensor_doubt);
            format!("camera or poses of the views of the {} may have a fault ({chance})", k.name)
        };
        (k.sensor_doubt > s.thresholds.not_there).then(about)
    })
}

/// Reason why the answer about every object is incomplete; `None` if unknown.
pub fn left_in_all(s: &Situation) -> Option<String> {
    if let Some(late) = out_of_time(s) {
        return Some(late);
    }
    let asked = |t: &&Track| s.surface_of(t).is_some_and(|on| s.asked.is_empty() || s.asked.contains(&on));
    let unsure = |t: &&Track| t.certainty() < s.thresholds.confidence;
    let places: Vec<String> =
        s.belief.tracks.iter().filter(asked).filter(unsure).map(|t| place(&t.position_m)).collect();
    // Of kinds it is asked only which objects are of them.
    if s.kinds.is_empty() && !places.is_empty() {
        return Some(format!("what stands at {} looks the same from every side", places.join(" and at ")));
    }
    let more = s.doubts().into_iter().find_map(|doubt| out_of_sight(s, doubt, "more"));
    // What was seen comes first where it leaves more open than what may stand where nothing was seen.
    let is_seen = open_kind(s)
        .is_some_and(|of| least_sure(s, of).is_some_and(|(_, p)| p.min(1.0 - p) > s.doubt_of(of).hidden));
    more.filter(|_| !is_seen).or_else(|| left_of_kinds(s))
}

/// Index of the first kind that is incompletely found.
fn open_kind(s: &Situation) -> Option<usize> {
    (0..s.kinds.len()).find(|&of| s.completeness(of) < s.wanted_of(of))
}

/// Object whose membership of a kind is least certain, with its probability; `None` if all are
/// certain enough.
fn least_sure(s: &Situation, of: usize) -> Option<(&Track, f64)> {
    let sure = |p: f64| p.max(1.0 - p);
    let tracks = s.belief.tracks.iter().map(|track| (track, s.kinds[of].probability(track, &s.surfaces)));
    let least = tracks.min_by(|a, b| sure(a.1).total_cmp(&sure(b.1)));
    least.filter(|(_, p)| sure(*p) < s.threshold)
}

/// Sentence on why the list of a kind is incomplete: the least certain member, and the chance of unseen
/// ones; `None` if it is complete.
fn left_of_kinds(s: &Situation) -> Option<String> {
    let open = open_kind(s)?;
    let kind = &s.kinds[open];
    let is_one = |(track, p): (&Track, f64)| {
        format!(", what stands at {} is one with {}", place(&track.position_m), percent(p))
    };
    let hidden = s.doubt_of(open).hidden;
    let least = least_sure(s, open).map(is_one);
    let all = s.completeness(open);
    let together = if hidden < 1.0 { all / (1.0 - hidden) } else { 1.0 };
    let about = about(least, together, hidden, 1.0 - s.threshold, s.belief.tracks.is_empty());
    let place = in_room(s, kind);
    let advice = if s.can_be_complete(open) { String::new() } else { at_most(s.most_complete(open), all) };
    Some(format!(
        "only {} sure that all {}{place} are found{about}{advice}",
        percent(all),
        plural(&kind.name)
    ))
}

/// Clause for a requested confidence that views cannot reach: `most` is reachable, `now` is reached.
pub fn at_most(most: f64, now: f64) -> String {
    let said = if now > 0.5 { format!("; at {} it could be said", percent(now)) } else { String::new() };
    format!(", and no look can raise that above {}{said}", percent(most))
}

/// Clause on the doubt about a kind: the least certain object, or all objects if each is certain enough
/// but their joint doubt dominates; and the unseen places, if they alone exceed the allowed doubt or
/// there is no such object.
pub fn about(least: Option<String>, together: f64, hidden: f64, allowed: f64, is_bare: bool) -> String {
    let says_hidden = is_bare || hidden >= WORTH_SAYING && (hidden > allowed || least.is_none());
    let hidden = hidden.max(0.0);
    let more =
        says_hidden.then(|| format!(", there may be more where nothing was seen ({})", percent(hidden)));
    let all_seen = || {
        let is_most = more.is_none() || (!is_bare && 1.0 - together > hidden);
        let of_all = format!(
            ", each object that was seen is sure enough, all together are not ({})",
            percent(together)
        );
        is_most.then_some(of_all)
    };
    least.or_else(all_seen).into_iter().chain(more.clone()).collect()
}

/// Clause on the rooms that a question about a kind names; empty if none.
pub fn in_room(s: &Situation, kind: &Thing) -> String {
    let mut rooms: Vec<&str> = Vec::new();
    for room in kind.on.iter().flatten().filter_map(|&on| s.surfaces[on].room.as_deref()) {
        if !rooms.contains(&room) {
            rooms.push(room);
        }
    }
    if rooms.is_empty() { String::new() } else { format!(" in the {}", rooms.join(" or the ")) }
}

fn out_of_time(s: &Situation) -> Option<String> {
    (s.time_left_s.is_some() && s.doubts().iter().any(|doubt| doubt.can_be_settled(s)))
        .then(|| "there is no time left for the looks that would settle it".into())
}

/// Sentence on the coverage of a thing's possible places: seen share and viewpoints of each surface, and
/// the remaining probability `left` that the thing is there. `looks` gives the number of views of a
/// surface.
pub fn seen_of(s: &Situation, doubt: &Doubt, left: f64, looks: impl Fn(usize) -> usize) -> String {
    let of = |on: usize, surface: &KnownSurface| -> Option<String> {
        let share = doubt.share_seen(on)?;
        let places = s.spaces[on].seen_from().len();
        let (percent, word) = ((share * 100.0).floor(), if places == 1 { "place" } else { "places" });
        Some(match (places, looks(on)) {
            (0, 0) => format!("the {} was not looked at", surface.name),
            (0, _) => format!("no look at the {} tells anything of it", surface.name),
            _ => format!("{percent:.0} % of the {} was seen from {places} {word}", surface.name),
        })
    };
    let parts: Vec<String> = s.surfaces.iter().enumerate().filter_map(|(on, k)| of(on, k)).collect();
    format!("{}; a chance of {} is left", parts.join(", "), percent(left))
}

/// Clause on possible places that no view can show; `None` if negligible.
fn out_of_sight(s: &Situation, doubt: &Doubt, what: &str) -> Option<String> {
    let (hidden, places) = doubt.out_of_sight(s);
    let middle =
        Point3::from(places.iter().map(|p| p.coords).sum::<Vector3<f64>>() / places.len().max(1) as f64);
    let first = places
        .iter()
        .min_by(|a, b| nalgebra::distance(a, &middle).total_cmp(&nalgebra::distance(b, &middle)))?;
    (hidden > s.thresholds.out_of_sight).then(|| {
        format!("there is room for {what} out of sight, near {} ({})", place(first), percent(hidden))
    })
}

/// Horizontal position as text, metres.
pub fn place(p: &Point3<f64>) -> String {
    format!("({:.2}, {:.2}) m", p.x, p.y)
}
