//! Outcome of an observation: the confidence reached, the reasons for remaining doubt, and the
//! share seen of each surface.

use descry_agent::standing::{InDoubt, Of, Seen};
use descry_agent::weigh::Expected;
use descry_domains::english::{self, plural};
use descry_domains::note::{LeftOut, Note};
use descry_domains::saying::Saying;
use descry_domains::symbol::symbol;
use descry_memory::belief::Track;

use super::numbers::{self, Sure};
use super::standings::Standing;
use super::wording::{by_share, listed, place, share, share_of};

/// Probability up to which nothing is mentioned.
pub const HARDLY: f64 = 0.005;
/// Minimum probability at which an object counts as a candidate for the requested one.
const MAY_BE: f64 = 0.05;
/// Maximum distance at which one object may have been mistaken for the other, metres: half the
/// width of a mug.
const BESIDE_M: f64 = 0.06;
/// Minimum probability at which an object counts as identified.
const TAKEN: f64 = 0.5;
/// Probability from which something counts as certain and is not mentioned.
const SURELY: f64 = 0.99;
/// Maximum number of doubts described one by one.
const MOST_DOUBTS: usize = 3;
/// Maximum number of places listed by name; the rest are counted.
const MOST_PLACES: usize = 4;

/// Goal, and what the plan was expected to improve.
pub struct Hopes<'a> {
    /// Goal in PDDL.
    pub goal: &'a str,
    /// Numbers that the plan was expected to improve.
    pub hoped: &'a [Expected],
    /// Wording of the domain.
    pub saying: &'a Saying,
}

/// Sentences about each doubt after some observations (`looks`). `before` and `after` are the
/// states of the run.
pub fn told(before: Option<&Standing>, after: &Standing, looks: &[&Note], asked: &Hopes<'_>) -> Vec<String> {
    let told = |doubt: &InDoubt| {
        let was = before.and_then(|before| before.same(doubt));
        let sure = numbers::of(doubt, before, after, asked.goal, asked.hoped);
        if sure.is_empty() {
            return None;
        }
        let is_open = sure.iter().any(|sure| sure.now < sure.wanted);
        let because = is_open.then(|| why_no_surer(doubt, before, after, looks, asked.saying)).flatten();
        let because = because.map(|because| format!(" It is no more because {because}.")).unwrap_or_default();
        Some(format!("{}.{because}{}", sureness(&sure, asked.saying), seen(doubt, was)))
    };
    after.doubts.iter().take(MOST_DOUBTS).filter_map(told).collect()
}

/// Clause about confidence, such as `the certainty of where it stands is now 0.27 (0.00 before,
/// 0.80 is wanted)`; of several numbers, the first and those below their bounds.
fn sureness(all: &[Sure], saying: &Saying) -> String {
    let one = |sure: &Sure| {
        let told = |value| share_of(value, sure.wanted);
        let (now, wanted, certain) = (told(sure.now), share(sure.wanted), saying.say(&sure.name));
        match sure.was.map(told) {
            Some(was) if was == now => format!("{certain} is still {now} ({wanted} is wanted)"),
            Some(was) => format!("{certain} is now {now} ({was} before, {wanted} is wanted)"),
            None => format!("{certain} is now {now} ({wanted} is wanted)"),
        }
    };
    let counts = |(n, sure): &(usize, &Sure)| *n == 0 || sure.now < sure.wanted;
    let said: Vec<String> = all.iter().enumerate().filter(counts).map(|(_, sure)| one(sure)).collect();
    listed(&said, said.len())
}

/// Sentences about the share seen of each surface where the object may be, as far as it changed
/// since `was`, and about surfaces without any view.
pub fn seen(doubt: &InDoubt, was: Option<&InDoubt>) -> String {
    let before = |seen: &Seen| was.and_then(|was| was.seen.iter().find(|s| s.on == seen.on));
    let percent = |share: f64| format!("{:.0} %", (share * 100.0).floor());
    let one = |seen: &Seen| {
        let now = percent(seen.share?);
        let was = before(seen).and_then(|was| was.share).map(percent);
        let is_new = before(seen).is_none_or(|was| was.places != seen.places);
        let changed = seen.places > 0 && (is_new || was.as_ref() != Some(&now));
        let is_less = before(seen).and_then(|was| was.share) > seen.share;
        let was = was.filter(|was| *was != now).map(|was| match is_less {
            false => format!("{was} before"),
            true => format!("{was} before: views of it lie otherwise than was thought, or no longer hold"),
        });
        let left = 100.0 - (seen.share? * 100.0).floor();
        let left = (left > 0.0).then(|| format!("{left:.0} % are left"));
        let beside: Vec<String> = was.into_iter().chain(left).collect();
        let beside = if beside.is_empty() { String::new() } else { format!(" ({})", beside.join(", ")) };
        changed.then(|| format!("{now} of the {}{beside}", seen.on))
    };
    let now: Vec<String> = doubt.seen.iter().filter_map(one).collect();
    let open = |seen: &&Seen| seen.places == 0;
    let open: Vec<String> = doubt.seen.iter().filter(open).map(|seen| format!("the {}", seen.on)).collect();
    let now = match now.len() {
        0 => String::new(),
        n => format!(" Seen by now: {}.", listed(&now, n)),
    };
    match open.len() {
        0 => now,
        _ => format!("{now} Nothing was seen yet of {}.", listed(&open, MOST_PLACES)),
    }
}

/// Reasons why doubt remains, as a clause; `None` if the record gives none.
fn why_no_surer(
    doubt: &InDoubt,
    before: Option<&Standing>,
    after: &Standing,
    looks: &[&Note],
    saying: &Saying,
) -> Option<String> {
    let mut why: Vec<String> = looks.iter().filter_map(|note| in_vain(note)).collect();
    match doubt.of {
        Of::Thing => {
            why.extend(before.and_then(|before| lost(&doubt.about, before, after)).map(|(_, lost)| lost));
            why.push(may_be(doubt, after, saying).unwrap_or_else(|| none_may_be(doubt, after)));
        }
        Of::Kind => why.extend(unsure_of(doubt, after, saying)),
        Of::Surface => why.extend(untold(doubt, after)),
    }
    let seen: f64 = seen_objects(doubt, after).map(|(_, p)| p).sum();
    let others = best_seen(doubt, after).filter(|(_, p)| *p >= MAY_BE).map_or(0.0, |(_, p)| seen - p);
    if doubt.of == Of::Thing && others > HARDLY {
        let p = best_seen(doubt, after).map_or(0.0, |(_, p)| p);
        why.push(match others + p + doubt.hidden > 1.0 + HARDLY {
            true => {
                format!("others may be it as well, with {} in all: each is judged by itself", share(others))
            }
            false => format!("with {} it is another of the objects", share(others)),
        });
    }
    why.extend(hidden(doubt, seen));
    (!why.is_empty()).then(|| why.join("; "))
}

/// Clause about an observation that showed nothing usable, or that made earlier views invalid;
/// `None` for others.
fn in_vain(note: &Note) -> Option<String> {
    match note {
        Note::Nothing { .. } => Some("the look showed no surface".into()),
        Note::Perceived { on, merged, left_out, .. } => {
            let newest = merged + left_out.len();
            let is_newest = |left: &LeftOut| matches!(left, LeftOut::View { view, .. } if *view == newest);
            left_out.iter().any(is_newest).then(|| format!("this view of the {on} could not be used"))
        }
        Note::Changed { .. } => Some("what was seen before the last look no longer holds".into()),
        _ => None,
    }
}

/// Best candidate before some observations, if these ruled it out: its earlier probability, and a
/// clause about what it is now. `None` if it is still a candidate.
pub fn lost(thing: &str, before: &Standing, after: &Standing) -> Option<(f64, String)> {
    let (track, was) = before.best(thing).filter(|(_, was)| *was >= MAY_BE)?;
    let now = after.belief.tracks.iter().find(|now| now.id == track.id);
    let is = match now {
        Some(now) if now.probability_of(thing) * 2.0 > was => return None,
        Some(now) => {
            let (other, p) = likeliest(now, thing);
            format!("is {other} with {}", share(p))
        }
        // It may go on under another number, or as a part of what was made out better.
        None => match there(track, after) {
            Some(now) if now.probability_of(thing) * 2.0 > was => return None,
            Some(now) => {
                let (other, p) = likeliest(now, thing);
                format!("is seen as {other} now, with {}", share(p))
            }
            None if after.belief.mislaid.iter().any(|touched| touched.id == track.id) => {
                "was touched since, and where it stands has to be seen again".into()
            }
            None if counts_less(track, before, after) => {
                "is not counted on any more: what was seen there before no longer holds".into()
            }
            None => "is not seen there any more".into(),
        },
    };
    let taken = match was >= TAKEN {
        true => format!("was taken for {thing} with {}", share(was)),
        false => format!("might have been {thing}, with {},", share(was)),
    };
    Some((was, format!("what {taken} {is}")))
}

/// True if fewer viewpoints count for the object's surface than before.
fn counts_less(track: &Track, before: &Standing, after: &Standing) -> bool {
    let places = |standing: &Standing| -> usize {
        let seen = standing.doubts.iter().flat_map(|doubt| &doubt.seen);
        seen.filter(|seen| symbol(&seen.on) == track.on).map(|seen| seen.places).max().unwrap_or(0)
    };
    places(after) < places(before)
}

/// Object that is now nearest to the position of an earlier one; `None` if it is [`BESIDE_M`] or
/// more away.
pub fn there<'a>(track: &Track, after: &'a Standing) -> Option<&'a Track> {
    let apart_m = |other: &Track| (other.position_m - track.position_m).norm();
    let nearest = after.belief.tracks.iter().min_by(|a, b| apart_m(a).total_cmp(&apart_m(b)))?;
    (apart_m(nearest) < BESIDE_M).then_some(nearest)
}

/// Clause about the best candidate for the requested object; `None` without a candidate.
pub fn may_be(doubt: &InDoubt, after: &Standing, saying: &Saying) -> Option<String> {
    let thing = &doubt.about;
    let (track, p) = best_seen(doubt, after).filter(|(_, p)| *p >= MAY_BE)?;
    let (other, q) = likeliest(track, thing);
    let other = if q > HARDLY { format!(" (or {other} with {})", share(q)) } else { String::new() };
    let percent = track.seen_fraction * 100.0;
    let stands = where_it_is(track, saying);
    let so_far = format!(
        "what stands {stands} may be it with {}{other}; {percent:.0} % of its outside was seen",
        share(p)
    );
    // How sure it is of where something stands is also how sure it is that this is the place.
    let right = doubt.sure.unwrap_or(p) / p;
    Some(match right < SURELY {
        true => format!("{so_far}, and that this is the place is certain with {}", share(right)),
        false => so_far,
    })
}

/// Objects, each with the probability that it is the requested one; without the object in the hand
/// if it may have been lost.
fn seen_objects<'s>(doubt: &'s InDoubt, after: &'s Standing) -> impl Iterator<Item = (&'s Track, f64)> {
    let seen = after.belief.tracks.iter().filter(|track| !track.on.is_empty() || doubt.lost <= HARDLY);
    seen.map(|track| (track, track.probability_of(&doubt.about)))
}

/// Object that is most probably the requested one, with that probability; `None` without objects.
pub fn best_seen<'s>(doubt: &'s InDoubt, after: &'s Standing) -> Option<(&'s Track, f64)> {
    seen_objects(doubt, after).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Clause for the case that there is no candidate.
pub fn none_may_be(doubt: &InDoubt, after: &Standing) -> String {
    let p = best_seen(doubt, after).map(|(_, p)| p).filter(|p| *p > HARDLY);
    match (after.belief.tracks.len(), p.map(share)) {
        (0, _) => "no object was seen".into(),
        (1, None) => "the one object that was seen is not it".into(),
        (1, Some(p)) => format!("the one object that was seen is it with only {p}"),
        (n, None) => format!("none of the {n} objects that were seen may be it"),
        (n, Some(p)) => format!("none of the {n} objects that were seen is it with more than {p}"),
    }
}

/// Clause about objects of uncertain kind, when all objects of a kind are requested: the joint
/// certainty, and the least certain object. `None` if they are certain enough.
fn unsure_of(doubt: &InDoubt, after: &Standing, saying: &Saying) -> Option<String> {
    let p = |track: &Track| track.probability_of(&doubt.about);
    let open = |track: &Track| p(track).min(1.0 - p(track));
    let unsure: Vec<&Track> = after.asked_about(doubt).filter(|track| open(track) > HARDLY).collect();
    let least = unsure.iter().max_by(|a, b| open(a).total_cmp(&open(b)))?;
    let all: f64 = unsure.iter().map(|track| 1.0 - open(track)).product();
    let kind = &doubt.about;
    let one = format!(
        "what stands {} is {} with {}",
        where_it_is(least, saying),
        english::one(kind),
        share(p(least))
    );
    (all < SURELY).then(|| match unsure.len() {
        1 => one,
        n => format!(
            "which of {n} objects{} are {} is certain with {} for all together, least of one: {one}",
            doubt.within,
            plural(kind),
            share(all)
        ),
    })
}

/// Clause about the least certainly identified object on a surface; `None` if all are certain.
fn untold(doubt: &InDoubt, after: &Standing) -> Option<String> {
    let on = symbol(&doubt.about);
    let there = after.belief.tracks.iter().filter(|track| track.on == on);
    // Where each is sure enough by itself, the least sure one still counts.
    let is_open = |track: &&Track| track.certainty() < doubt.wanted.max(SURELY);
    let mut open: Vec<&Track> = there.filter(is_open).collect();
    if open.iter().any(|track| track.certainty() < doubt.wanted) {
        open.retain(|track| track.certainty() < doubt.wanted);
    }
    let least = open.iter().min_by(|a, b| a.certainty().total_cmp(&b.certainty()))?;
    let others = match open.len() {
        1 => "the object".to_string(),
        n => format!("the kinds of {n} objects are not sure, the least that of the one"),
    };
    let (percent, sure) = (least.seen_fraction * 100.0, share(least.certainty()));
    let kind = least.kind().unwrap_or("none that is known");
    Some(format!(
        "{others} at {}, {kind}, is told with only {sure} ({percent:.0} % of its outside was seen)",
        place(least)
    ))
}

/// Clause about the probability that the object stands unseen, or is absent; `None` if it hardly
/// can. `seen` is the total probability of the objects seen.
pub fn hidden(doubt: &InDoubt, seen: f64) -> Option<String> {
    (doubt.hidden > HARDLY).then_some(())?;
    let lost = match doubt.lost > HARDLY {
        true => format!(
            "with {} it was lost out of the hand, and lies where no look shows it; ",
            share(doubt.lost)
        ),
        false => String::new(),
    };
    let hidden = share((doubt.hidden - doubt.lost).max(0.0));
    let places = hidden_places(doubt);
    let nowhere = 1.0 - doubt.hidden - seen;
    let nowhere = if nowhere > HARDLY {
        format!("; with {} it is not there at all", share(nowhere))
    } else {
        String::new()
    };
    Some(match doubt.of {
        Of::Thing => format!("{lost}with {hidden} it stands where it could not be seen yet{places}{nowhere}"),
        Of::Kind => format!("with {hidden} there are more where they could not be seen yet{places}"),
        Of::Surface => format!("with {hidden} something stands there unseen{places}"),
    })
}

/// Surfaces on which the object may stand unseen, most probable first, as text in brackets;
/// mentions unexplained measurements. Empty if there is nothing to distinguish.
fn hidden_places(doubt: &InDoubt) -> String {
    let mut places: Vec<&Seen> = doubt.seen.iter().filter(|seen| seen.hidden > HARDLY).collect();
    places.sort_by(|a, b| b.hidden.total_cmp(&a.hidden));
    let is_measured = |seen: &&Seen| seen.measured > seen.hidden / 2.0;
    if places.is_empty() || (doubt.seen.len() == 1 && !is_measured(&places[0])) {
        return String::new();
    }
    let named = by_share(places.iter().map(|seen| {
        let measured = if is_measured(seen) {
            ", mostly where something was measured that no object explains"
        } else {
            ""
        };
        (seen.hidden, format!("on the {}{measured}", seen.on))
    }));
    format!(" ({named})")
}

/// Most probable identity of an object other than `besides`, with its probability.
fn likeliest(track: &Track, besides: &str) -> (String, f64) {
    let names = track.probabilities.iter().filter(|(name, _)| name != besides);
    let best = names.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, p)| *p > track.unknown);
    best.cloned().unwrap_or_else(|| ("none of the known objects".into(), track.unknown))
}

fn where_it_is(track: &Track, saying: &Saying) -> String {
    match track.on.as_str() {
        "" => "in the hand".into(),
        on => format!("on the {} at {}", saying.name_of(on), place(track)),
    }
}
