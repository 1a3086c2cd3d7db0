//! Calls of *shapes*: expected information gain of scans, and driving costs.

use descry_planner::{Answer, Call, CallError};

use super::floor::{NOTHING_KNOWN_M, THIS, thing};
use super::poses;
use crate::abilities::shapes::floor::FloorThing;
use crate::ability::{Deed, MOVE, Meaning, Reads, argument, quickest_first};
use crate::situation::{Situation, holding};

const SCANS: &[Reads] = &[Reads::all("scanned")];

/// All calls of *shapes*.
pub(super) const ALL: &[Meaning] = &[
    Meaning {
        name: "circle-cost",
        reads: &[],
        is_advice: false,
        about: "seconds that the drive around it takes; infinite where no way leads",
        answers: circle_cost,
    },
    Meaning {
        name: "can-scan",
        reads: &[],
        is_advice: false,
        about: "whether a scan from there shows it",
        answers: can_scan,
    },
    Meaning {
        name: "expected-tightening",
        reads: SCANS,
        is_advice: false,
        about: "by how much a scan would lessen how far it may reach beyond what was met",
        answers: expected_tightening,
    },
    Meaning {
        name: "expected-sureness",
        reads: SCANS,
        is_advice: false,
        about: "by how much surer one may be what it is once its scans are aligned",
        answers: expected_sureness,
    },
    Meaning {
        name: "expected-found",
        reads: SCANS,
        is_advice: false,
        about: "by how much surer one may be that it has that shape once its scans are aligned",
        answers: expected_found,
    },
    Meaning {
        name: "expected-discovery",
        reads: &[],
        is_advice: false,
        about: "whether a sweep from there passes over floor on which something of that shape may stand",
        answers: expected_discovery,
    },
];

fn named<'a>(s: &'a Situation, call: &Call, n: usize) -> Result<Option<&'a FloorThing>, CallError> {
    thing(s, argument(call, n)?).map_err(CallError::Failed)
}

fn circle_cost(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let (from, to) = (s.candidate(argument(call, 0)?)?, s.candidate(argument(call, 1)?)?);
    let way = named(s, call, 2)?.and_then(|t| poses::way(s, from, to, t));
    Ok(Answer::Number(way.map_or(f64::INFINITY, |way| poses::seconds(s, from, &way))))
}

/// Answers `[can-scan ?from ?what]`: an object is scanned from the poses around it; before the first
/// sweep, from the current pose alone.
fn can_scan(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let pose = argument(call, 0)?;
    Ok(Answer::Truth(match named(s, call, 1)? {
        Some(thing) => thing.ring.iter().any(|p| p == pose),
        None => s.floor().sweeps.is_empty() && s.candidate(pose)? == s.at,
    }))
}

/// Indices, in the object's ring, of the poses not swept from yet from which the plan scans before a
/// call.
fn planned(s: &Situation, call: &Call, thing: &FloorThing) -> Vec<usize> {
    let taken = |pose: &str| s.floor().sweeps.iter().any(|(_, from)| from == pose);
    let poses = holding(call, "scanned").filter_map(|r| r.arguments.first());
    poses
        .filter(|pose| !taken(pose))
        .filter_map(|pose| thing.ring.iter().position(|p| **p == **pose))
        .collect()
}

fn expected_tightening(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let Some(thing) = named(s, call, 1)? else { return Ok(Answer::Number(NOTHING_KNOWN_M)) };
    let mut scans = planned(s, call, thing);
    let before_m = thing.hoped_looseness_m(&scans);
    let pose = argument(call, 0)?;
    scans.extend(thing.ring.iter().position(|p| p == pose));
    // Of what no scan has shown, one will show about half.
    let after_m = if thing.outline.is_some() { thing.hoped_looseness_m(&scans) } else { 0.5 * before_m };
    Ok(Answer::Number((before_m - after_m).max(0.0)))
}

fn expected_sureness(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let Some(thing) = named(s, call, 0)? else { return Ok(Answer::Number(1.0)) };
    Ok(Answer::Number(hope(s, call, thing)))
}

/// Expected gain of confidence in the shape of an object by the plan's scans before a call.
fn hope(s: &Situation, call: &Call, thing: &FloorThing) -> f64 {
    let (known, scans) = (s.floor().known.len(), planned(s, call, thing));
    if scans.is_empty() && thing.taken_for.is_some() {
        return 0.0;
    }
    thing.hoped(&scans, known) - thing.sureness(known)
}

fn expected_found(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let shape = argument(call, 1)?;
    let Some(thing) = named(s, call, 0)? else { return Ok(Answer::Number(0.0)) };
    if !thing.may_have(shape, s.floor().known.len(), s.threshold) || !s.floor().knows(shape) {
        return Ok(Answer::Number(0.0));
    }
    let scans = planned(s, call, thing);
    let hope = match &thing.outline {
        None => 1.0,
        Some(_) if scans.is_empty() && thing.taken_for.is_some() => 0.0,
        // Whatever else it is taken for now.
        Some(_) => thing.hoped_of_name(&scans, s.floor().known.len()) - s.floor().surest(shape),
    };
    Ok(Answer::Number(hope.max(0.0)))
}

fn expected_discovery(s: &Situation, call: &Call) -> Result<Answer, CallError> {
    let (from, shape) = (s.candidate(argument(call, 0)?)?, argument(call, 1)?);
    let passes = s.floor().sought.iter().any(|sought| sought == shape)
        && s.floor().knows(shape)
        && s.floor().promising.contains(&s.candidates[from].symbol);
    Ok(Answer::Number(if passes { 1.0 } else { 0.0 }))
}

/// Minimum expected reduction of an outline's looseness (how far the object may reach beyond it) that
/// justifies a scan, metres.
const WORTH_M: f64 = 0.001;

/// Fallback when the planner finds no plan: aligning the scans of an object; if there are none to align,
/// each useful scan or survey, quickest first.
pub(super) fn fallback(s: &Situation) -> Vec<Vec<Deed>> {
    let sought = &s.floor().sought;
    // What nobody has learned is known by no scan.
    if !sought.is_empty() && !sought.iter().any(|shape| s.floor().knows(shape)) {
        return Vec::new();
    }
    let is_open = |t: &&FloorThing| match sought.is_empty() {
        false => s.floor().may_be_sought(t, s.threshold),
        true => t.symbol == THIS,
    };
    let open: Vec<&FloorThing> = s.floor().things.iter().filter(is_open).collect();
    if let Some(thing) = open.iter().find(|t| t.outline.is_some() && t.taken_for.is_none()) {
        return vec![vec![Deed::new("align", [&thing.symbol])]];
    }
    let pose = |n: usize| s.candidates[n].symbol.clone();
    let here = pose(s.at);
    let untried = |p: &String| s.floor().sweeps.iter().all(|(_, from)| from != p);
    let scans = open.iter().flat_map(|t| (0..t.ring.len()).map(move |k| (*t, k))).filter_map(|(t, k)| {
        let to = s.candidate(&t.ring[k]).ok().filter(|to| !s.out_of_reach.contains(to))?;
        let promises = t.outline.is_none() || t.looseness_m() - t.hoped_looseness_m(&[k]) > WORTH_M;
        let way_s = if to == s.at { 0.0 } else { poses::seconds(s, s.at, &poses::way(s, s.at, to, t)?) };
        (promises && untried(&t.ring[k]) && way_s.is_finite()).then_some((way_s, to, Some(t)))
    });
    let surveys = s.floor().promising.iter().filter_map(|p| {
        let to = s.candidate(p).ok()?;
        let is_around = s.floor().things.iter().any(|t| t.ring.contains(p));
        (!is_around && untried(p) && s.can_drive_to(to)).then(|| (s.travel_s(s.at, to), to, None))
    });
    let deeds = |(way_s, to, thing): (f64, usize, Option<&FloorThing>)| {
        let there = pose(to);
        let all = match thing {
            Some(t) => {
                [Deed::new("circle", [&here, &there, &t.symbol]), Deed::new("scan", [&there, &t.symbol])]
            }
            None => [Deed::new(MOVE, [&here, &there]), Deed::new("survey", [&there])],
        };
        (way_s, all.into_iter().skip(usize::from(to == s.at)).collect())
    };
    quickest_first(scans.chain(surveys).map(deeds).collect())
}

/// Clause on what a scan of an object from a pose would show.
pub(super) fn hope_of_scan(s: &Situation, arguments: &[&str]) -> String {
    let Ok(Some(thing)) = thing(s, arguments[1]) else {
        return format!("nothing is known yet of what {THIS} is");
    };
    let Some(pose) = thing.ring.iter().position(|p| p == arguments[0]) else { return String::new() };
    match &thing.outline {
        Some(_) => {
            let (now_m, then_m) = (thing.looseness_m(), thing.hoped_looseness_m(&[pose]));
            format!(
                "it may reach {:.1} cm beyond what was met of it, after this perhaps {:.1} cm",
                1e2 * now_m,
                1e2 * then_m
            )
        }
        None => "no scan shows both ends of it yet".into(),
    }
}
