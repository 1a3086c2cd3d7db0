//! Belief state of a run, kept from round to round.

use std::collections::{BTreeMap, BTreeSet};

use descry_memory::RecordId;
use descry_memory::belief::Track;
use descry_perception::View;
use descry_perception::merge::{MergeOptions, Merged, Merger};
use descry_perception::nalgebra::Isometry3;

use crate::contradiction::Contradiction;
use crate::known::Known;
use crate::looking::change::Change;
use crate::words::Words;

/// Everything that a world has come to know.
pub struct Mind {
    /// Knowledge that rounds are grounded in.
    pub known: Known,
    /// Values of remembered and fixed predicates and functions.
    pub words: Words,
    /// View history of each surface.
    pub regions: Vec<Region>,
    /// Last merge of an unmapped surface's views, kept because they may show other surfaces, too.
    pub merged: Option<LastMerged>,
    /// Number of views taken.
    pub views: usize,
    /// Number of pushes tried.
    pub pushes: usize,
    /// Number of disturbances of the scene: each time something moved, earlier views became void.
    pub disturbed: usize,
    /// Distance driven, metres.
    pub distance_m: f64,
    /// Last reading of each sense, by symbol.
    pub readings: BTreeMap<String, serde_json::Value>,
}

/// View history of one surface.
#[derive(Debug, Default)]
pub struct Region {
    /// Views that still hold.
    pub looks: Vec<RecordedView>,
    /// State of the incremental merger.
    pub merger: Merger,
    /// Views integrated into the observed space: timestamp and camera pose of each.
    pub taken_in: Vec<(i64, Isometry3<f64>)>,
    /// Places where objects have moved.
    pub changes: Vec<Change>,
    /// Total number of views taken.
    pub taken: usize,
    /// Reason why the last view showed no surface; `None` if it did.
    pub nothing: Option<String>,
    /// True if contradicting views are as many as agreeing ones, so that the wrong ones are
    /// unknown.
    pub disputed: bool,
    /// Contradiction between the views and the map, or among the views, by which they prove nothing;
    /// `None` if consistent.
    pub contradiction: Option<Contradiction>,
    /// Objects believed to be there before the run's first view; `None` before that view.
    pub expected: Option<Vec<Track>>,
}

/// Recorded view.
#[derive(Debug, Clone, Copy)]
pub struct RecordedView {
    /// Timestamp of the view, nanoseconds.
    pub stamp_ns: i64,
    /// Id of the record.
    pub record: RecordId,
    /// Distance of the camera from the surface's centre, if known, metres.
    pub away_m: f64,
    /// Alignment of this view alone with the map's outline.
    pub laid: Laid,
}

/// Alignment of a view with the outline of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Laid {
    /// As localised: there is no outline, or no alignment was tried.
    AsLocalised,
    /// Moved by this transform, `map_from_localised`.
    By(Isometry3<f64>),
    /// Not aligned: the view alone shows no such surface, or none within the localisation error.
    Nowhere,
}

impl Mind {
    /// State before anything was done or seen.
    pub(crate) fn new(known: Known, words: Words) -> Self {
        let regions = known.surfaces.iter().map(|_| Region::default()).collect();
        let (merged, readings) = (None, BTreeMap::new());
        let (views, pushes, disturbed, distance_m) = (0, 0, 0, 0.0);
        let mut mind = Self { known, words, regions, merged, views, pushes, disturbed, distance_m, readings };
        mind.attend();
        mind
    }

    /// Updates views taken, unreachable candidates and shut doors from the remembered facts.
    pub fn attend(&mut self) {
        let (known, words) = (&mut self.known, &self.words);
        let candidate = |name: &String| known.candidates.iter().position(|c| c.symbol == *name);
        let surface = |name: &String| known.surfaces.iter().position(|s| s.symbol == *name);
        let observed: BTreeSet<(usize, usize)> = words
            .instances("observed")
            .filter_map(|a| match a {
                [from, on] => candidate(from).zip(surface(on)),
                _ => None,
            })
            .collect();
        let out_of_reach: BTreeSet<usize> =
            words.instances("out-of-reach").filter_map(|a| candidate(a.first()?)).collect();
        let door = |name: &String| known.doors.iter().position(|d| d.symbol == *name);
        let shut: BTreeSet<usize> = words.instances("shut").filter_map(|a| door(a.first()?)).collect();
        (known.observed, known.out_of_reach, known.shut) = (observed, out_of_reach, shut);
    }

    /// Forgets the views taken of a surface (`None`: of all), so that they may be repeated.
    pub fn forget_looks(&mut self, surface: Option<&str>) {
        let all: Vec<Vec<String>> = self.words.instances("observed").map(<[String]>::to_vec).collect();
        for look in all {
            if surface.is_none_or(|s| look.get(1).is_some_and(|on| on == s)) {
                self.words.set("observed", look, None);
            }
        }
        self.attend();
    }
}

/// Last merge of views of a surface without an outline on the map.
pub struct LastMerged {
    pub(crate) options: MergeOptions,
    /// Timestamps and poses of the views.
    pub(crate) views: Vec<(i64, Isometry3<f64>)>,
    pub(crate) merged: Merged,
}

impl RecordedView {
    /// Localised camera pose of a view, before alignment with a surface's outline.
    pub(crate) fn localised(&self, view: &View) -> Isometry3<f64> {
        match self.laid {
            Laid::By(map_from_localised) => map_from_localised.inverse() * view.world_from_camera,
            Laid::AsLocalised | Laid::Nowhere => view.world_from_camera,
        }
    }
}

impl Mind {
    /// Ids of the records of all views that still hold.
    pub(crate) fn views_held(&self) -> Vec<RecordId> {
        self.regions.iter().flat_map(|r| &r.looks).map(|look| look.record).collect()
    }
}
