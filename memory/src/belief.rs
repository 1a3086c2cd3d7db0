//! Belief over objects: how many there are, where, of which class, and from which viewpoints they were seen.
//! Each object has a *track*, with which percepts of later merged views are associated.

use descry_perception::nalgebra::Point3;
use descry_perception::recognise::{Evidence, Percept, probability_of};
use pathfinding::prelude::{Matrix, kuhn_munkres_min};
use serde::{Deserialize, Serialize};

use crate::document::RecordId;

/// Maximum distance between a percept and a track at which both may be one object, metres.
const GATE_M: f64 = 0.10;
/// Maximum distance between a touched object's former track and a new detection that continues the track,
/// metres: the object may have slid, or the hand may have pushed it.
pub const MISLAID_M: f64 = 0.25;
/// Ratio of volumes above which an unknown percept is too large to be the known object.
const MUCH_LARGER: f64 = 3.0;

/// Belief about one object over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Number of the track; never reused.
    pub id: u64,
    /// Symbol of the supporting surface; empty while the object is in the hand.
    #[serde(default)]
    pub on: String,
    /// Centre of the object's footprint, world frame, metres.
    pub position_m: Point3<f64>,
    /// Standard deviation of each coordinate of the position, metres.
    pub position_sigma_m: f64,
    /// Longer and shorter side of the footprint, and height, metres.
    pub size_m: [f64; 3],
    /// Convex hull of the measured points, seen from above, world frame, metres; empty if only the size is
    /// known.
    #[serde(default)]
    pub footprint_m: Vec<Point3<f64>>,
    /// Probability of being each known object, by name; with `unknown` they sum to one.
    pub probabilities: Vec<(String, f64)>,
    /// Probability of being of each kind, by name.
    pub kinds: Vec<(String, f64)>,
    /// Probability that the object is none of the known ones.
    pub unknown: f64,
    /// Probability of each basic colour, by name; empty if the colour was not seen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colours: Vec<(String, f64)>,
    /// Share of the object's visible hull (sides and top) that some view measured or looked past, 0 to 1.
    pub seen_fraction: f64,
    /// Positions of the cameras that saw the object, world frame, metres.
    pub viewpoints_m: Vec<Point3<f64>>,
    /// Evidence for and against the object, from the last merge of views.
    pub evidence: Evidence,
    /// Records on which the belief about the object rests.
    pub cites: Vec<RecordId>,
    /// Time of the first detection, nanoseconds.
    pub first_ns: i64,
    /// Time of the last detection, nanoseconds.
    pub last_ns: i64,
}

/// A percept with the cameras that saw the object.
#[derive(Debug, Clone, Copy)]
pub struct Sighted<'a> {
    /// Percept of the object.
    pub percept: &'a Percept,
    /// Positions of the cameras that saw the object, world frame, metres.
    pub viewpoints_m: &'a [Point3<f64>],
    /// Convex hull of the measured points, seen from above, world frame, metres.
    pub footprint_m: &'a [Point3<f64>],
}

/// Belief over all objects.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// Tracks, ordered by first sighting.
    pub tracks: Vec<Track>,
    /// Tracks that later views no longer show: removed objects, or false detections.
    pub gone: Vec<Track>,
    /// Tracks of objects that were touched and not seen since; a new detection of the same kind nearby
    /// continues such a track.
    #[serde(default)]
    pub mislaid: Vec<Track>,
    next_id: u64,
}

impl Track {
    /// Probability that the object is the known object, or is of the kind, called `name`; a colour may stand
    /// before the kind. 0 for a name without a model.
    pub fn probability_of(&self, name: &str) -> f64 {
        probability_of(name, [&self.probabilities, &self.kinds], &self.colours)
    }

    /// Name of the most probable known object; `None` if *unknown* is more probable.
    pub fn label(&self) -> Option<&str> {
        let best = self.probabilities.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (best.1 > self.unknown).then_some(best.0.as_str())
    }

    /// Name of the most probable kind; `None` if it is more probable that the object is of no known kind. An
    /// object that is like a known one but of another colour is of that one's kind.
    pub fn kind(&self) -> Option<&str> {
        let best = self.kinds.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let all = |list: &[(String, f64)]| list.iter().map(|(_, p)| p).sum::<f64>();
        let recoloured = all(&self.kinds) - all(&self.probabilities);
        (best.1 > self.unknown - recoloured).then_some(best.0.as_str())
    }

    /// True if this object is known, and a percept with this label and size is unknown and so much larger
    /// that blurred views may have merged the object into it.
    pub fn may_be_blurred_into(&self, label: Option<&str>, size_m: &[f64; 3]) -> bool {
        let volume = |size_m: &[f64; 3]| size_m.iter().product::<f64>();
        self.label().is_some() && label.is_none() && volume(size_m) > MUCH_LARGER * volume(&self.size_m)
    }

    /// Probability of the most probable class: a kind, whose members count together, or *none of the known
    /// objects*.
    pub fn certainty(&self) -> f64 {
        self.kinds.iter().map(|&(_, p)| p).fold(self.unknown, f64::max)
    }
}

impl Belief {
    /// Updates the tracks on a surface from the merge of all views of it: percepts are assigned to tracks by
    /// minimum total distance within the gate [`GATE_M`]; unassigned tracks are gone. Tracks on other
    /// surfaces stay unchanged.
    ///
    /// Percepts rest on every view of the surface so far, so their probabilities replace the earlier ones. A
    /// known object that blurred views have merged into a larger unknown percept keeps its track.
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

    /// Adds the tracks of earlier runs, with new numbers.
    pub fn adopt(&mut self, remembered: impl IntoIterator<Item = Track>) {
        for track in remembered {
            self.tracks.push(Track { id: self.next_id, ..track });
            self.next_id += 1;
        }
    }

    /// Moves a track to `mislaid`: its object was touched, so that the position is unknown until the object
    /// is seen again.
    pub fn mislay(&mut self, id: u64) {
        if let Some(at) = self.tracks.iter().position(|t| t.id == id) {
            self.mislaid.push(self.tracks.remove(at));
        }
    }

    /// Removes and returns the mislaid track that a new detection continues, if any.
    fn found_again(&mut self, new: &Track) -> Option<Track> {
        let apart_m = |old: &Track| (old.position_m - new.position_m).norm();
        let may_be = |old: &Track| old.kind() == new.kind() && apart_m(old) < MISLAID_M;
        let all = self.mislaid.iter().enumerate().filter(|(_, old)| may_be(old));
        let nearest = all.min_by(|(_, a), (_, b)| apart_m(a).total_cmp(&apart_m(b)))?.0;
        Some(self.mislaid.remove(nearest))
    }

    /// Assigns percepts to tracks at the least total distance within the gate [`GATE_M`]; also returns the
    /// unassigned percepts.
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

/// True if a percept is unknown, much larger than the object of a track, and covers the place of that object.
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
        colours: p.colours.clone(),
        seen_fraction: p.seen_fraction,
        viewpoints_m: sighted.viewpoints_m.to_vec(),
        evidence: p.evidence.clone(),
        cites: cites.to_vec(),
        first_ns: stamp_ns,
        last_ns: stamp_ns,
    }
}
