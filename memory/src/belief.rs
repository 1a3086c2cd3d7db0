//! Belief about objects: number, places, classes, and the viewpoints behind them. Tracks keep
//! identity: percepts of later merges are associated with earlier objects.

use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{Evidence, Percept};
use pathfinding::prelude::{Matrix, kuhn_munkres_min};
use serde::{Deserialize, Serialize};

use crate::document::RecordId;

/// A percept farther from an object than this is another object.
const GATE_M: f64 = 0.10;
/// Greatest distance at which an object that was touched is still the same, metres: it may have
/// slid, and the hand may have pushed it.
pub const MISLAID_M: f64 = 0.25;
/// An unknown thing of this many times the volume of a known object is not that object.
const MUCH_LARGER: f64 = 3.0;

/// An object that is believed to be there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Its number, never used again.
    pub id: u64,
    /// The symbol of the surface that it stands on; empty: in the hand.
    #[serde(default)]
    pub on: String,
    /// Position: centre of its body's footprint, world frame, metres.
    pub position_m: Point3<f64>,
    /// Standard deviation of each coordinate, metres.
    pub position_sigma_m: f64,
    /// Longer and shorter side of its footprint and its height, metres.
    pub size_m: [f64; 3],
    /// Convex outline of what was measured of it, seen from above, world frame, metres; empty where only its size is known.
    #[serde(default)]
    pub footprint_m: Vec<Point3<f64>>,
    /// Probability of each known object; with `unknown` they sum to one.
    pub probabilities: Vec<(String, f64)>,
    /// Probability of each kind.
    pub kinds: Vec<(String, f64)>,
    /// Probability that it is none of the known objects.
    pub unknown: f64,
    /// Share of its visible hull that some view saw or looked past.
    pub seen_fraction: f64,
    /// Viewpoints from which it was seen.
    pub viewpoints_m: Vec<Point3<f64>>,
    /// Evidence for and against, as of the last merge.
    pub evidence: Evidence,
    /// The records that the belief rests on.
    pub cites: Vec<RecordId>,
    /// When it was first and last seen.
    pub first_ns: i64,
    /// When it was last seen.
    pub last_ns: i64,
}

/// A percept with where it was seen from.
#[derive(Debug, Clone, Copy)]
pub struct Sighted<'a> {
    /// Percept.
    pub percept: &'a Percept,
    /// Cameras that saw it.
    pub viewpoints_m: &'a [Point3<f64>],
    /// Convex outline of what was measured of it, seen from above, world frame, metres.
    pub footprint_m: &'a [Point3<f64>],
}

/// Everything that is believed of the objects.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// The objects, in the order in which they were first seen.
    pub tracks: Vec<Track>,
    /// Objects that were believed in and are no longer seen: gone, or never there.
    pub gone: Vec<Track>,
    /// Objects that were touched and have not been seen since: what is first seen like one, near where it stood, is that one.
    #[serde(default)]
    pub mislaid: Vec<Track>,
    next_id: u64,
}

impl Track {
    /// Probability that it is the known object, or of the kind, called `name`; 0 for names that no model has.
    pub fn probability_of(&self, name: &str) -> f64 {
        let of = |list: &[(String, f64)]| list.iter().find(|(n, _)| n == name).map(|&(_, p)| p);
        of(&self.probabilities).or_else(|| of(&self.kinds)).unwrap_or(0.0)
    }

    /// The known object that it most likely is; none: unknown.
    pub fn label(&self) -> Option<&str> {
        let best = self.probabilities.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (best.1 > self.unknown).then_some(best.0.as_str())
    }

    /// The kind that it most likely is; none: unknown.
    pub fn kind(&self) -> Option<&str> {
        let best = self.kinds.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (best.1 > self.unknown).then_some(best.0.as_str())
    }

    /// True if a view may have blurred the object into another over its place: the object is known,
    /// the other an unknown and much larger thing.
    pub fn may_be_blurred_into(&self, label: Option<&str>, size_m: &[f64; 3]) -> bool {
        let volume = |size_m: &[f64; 3]| size_m.iter().product::<f64>();
        self.label().is_some() && label.is_none() && volume(size_m) > MUCH_LARGER * volume(&self.size_m)
    }

    /// Certainty of the object's class, *none of the known* included, 0 to 1. Members of a kind
    /// count together.
    pub fn certainty(&self) -> f64 {
        self.kinds.iter().map(|&(_, p)| p).fold(self.unknown, f64::max)
    }
}

impl Belief {
    /// Takes in what the merge of all views of a surface shows. A percept is the object there that was believed nearest to it, at
    /// the least sum of distances; what no percept is taken for is gone. What stands elsewhere stays as it is.
    ///
    /// The percepts rest on every view of the surface so far, so that their probabilities replace the earlier ones. A known object that a
    /// larger unknown thing has swallowed, since the last view blurs the two, is still believed in as before.
    pub fn update(&mut self, on: &str, sighted: &[Sighted<'_>], stamp_ns: i64, cites: &[RecordId]) {
        let (here, elsewhere) = std::mem::take(&mut self.tracks).into_iter().partition(|t| t.on == on);
        self.tracks = here;
        let partner = self.associate(sighted);
        let mut kept: Vec<Track> = elsewhere;
        for (track, found) in std::mem::take(&mut self.tracks).into_iter().zip(partner.tracks) {
            match found {
                Some(n) => kept.push(Track {
                    id: track.id,
                    first_ns: track.first_ns,
                    ..seen(on, &sighted[n], stamp_ns, cites)
                }),
                None if sighted.iter().any(|s| swallows(s.percept, &track)) => kept.push(track),
                None => self.gone.push(track),
            }
        }
        for n in partner.new {
            let new = seen(on, &sighted[n], stamp_ns, cites);
            kept.push(match self.found_again(&new) {
                Some(old) => Track { id: old.id, first_ns: old.first_ns, ..new },
                None => {
                    self.next_id += 1;
                    Track { id: self.next_id - 1, ..new }
                }
            });
        }
        kept.sort_by_key(|track| track.id);
        self.tracks = kept;
    }

    /// Begins with objects that are remembered of earlier.
    pub fn adopt(&mut self, remembered: impl IntoIterator<Item = Track>) {
        for track in remembered {
            self.tracks.push(Track { id: self.next_id, ..track });
            self.next_id += 1;
        }
    }

    /// The object of a number was touched: it is no longer believed in where it was, and where it is has to be seen.
    pub fn mislay(&mut self, id: u64) {
        if let Some(at) = self.tracks.iter().position(|t| t.id == id) {
            self.mislaid.push(self.tracks.remove(at));
        }
    }

    /// The mislaid object that one which is seen for the first time is.
    fn found_again(&mut self, new: &Track) -> Option<Track> {
        let apart_m = |old: &Track| (old.position_m - new.position_m).norm();
        let may_be = |old: &Track| old.kind() == new.kind() && apart_m(old) < MISLAID_M;
        let all = self.mislaid.iter().enumerate().filter(|(_, old)| may_be(old));
        let nearest = all.min_by(|(_, a), (_, b)| apart_m(a).total_cmp(&apart_m(b)))?.0;
        Some(self.mislaid.remove(nearest))
    }

    /// The percept of each track, and the percepts of none: the assignment of least distance within the gate.
    fn associate(&self, sighted: &[Sighted<'_>]) -> Association {
        let (rows, columns) = (self.tracks.len(), sighted.len());
        let mut tracks = vec![None; rows];
        if rows > 0 {
            // Beside every track stands a place for "gone", at the cost of the gate.
            let gate = (GATE_M * 1e4) as i64;
            let weights = Matrix::from_fn(rows, columns + rows, |(r, c)| match sighted.get(c) {
                Some(s) => {
                    let track = &self.tracks[r];
                    let distance = (track.position_m - s.percept.position_m).norm();
                    let other = distance >= GATE_M || swallows(s.percept, track);
                    if other { 4 * gate } else { (distance * 1e4) as i64 }
                }
                None => gate,
            });
            let (_, chosen) = kuhn_munkres_min(&weights);
            tracks = chosen.into_iter().map(|c| (c < columns).then_some(c)).collect();
        }
        let new = (0..columns).filter(|c| !tracks.contains(&Some(*c))).collect();
        Association { tracks, new }
    }
}

struct Association {
    tracks: Vec<Option<usize>>,
    new: Vec<usize>,
}

/// True if a percept is an unknown thing, much larger than a known object, over its place.
fn swallows(percept: &Percept, track: &Track) -> bool {
    let reach_m = percept.size_m[0].max(percept.size_m[1]) / 2.0;
    track.may_be_blurred_into(percept.label.as_deref(), &percept.size_m)
        && (track.position_m - percept.position_m).norm() < reach_m
}

fn seen(on: &str, sighted: &Sighted<'_>, stamp_ns: i64, cites: &[RecordId]) -> Track {
    let p = sighted.percept;
    Track {
        id: 0,
        on: on.into(),
        position_m: p.position_m,
        position_sigma_m: p.position_sigma_m,
        size_m: p.size_m,
        footprint_m: sighted.footprint_m.to_vec(),
        probabilities: p.probabilities.clone(),
        kinds: p.kinds.clone(),
        unknown: p.unknown,
        seen_fraction: p.seen_fraction,
        viewpoints_m: sighted.viewpoints_m.to_vec(),
        evidence: p.evidence.clone(),
        cites: cites.to_vec(),
        first_ns: stamp_ns,
        last_ns: stamp_ns,
    }
}
