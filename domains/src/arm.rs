//! Object in the hand, and reach of the arm.

use descry_memory::belief::Track;
use descry_perception::nalgebra::{Point3, Vector3};
use descry_robots::{Description, Place};

use crate::situation::Situation;

/// Number of standard deviations of localisation that are allowed for as error.
const ASTRAY: f64 = 2.0;
/// Assumed distance between the body and an object that it looks at, metres.
const FROM_M: f64 = 1.2;

impl Situation {
    /// Object in the hand; `None` if the hand is empty.
    pub fn in_hand(&self) -> Option<&Track> {
        let held = self.held.as_ref()?;
        self.belief.tracks.iter().find(|t| t.id == held.track)
    }

    /// Name of the thing with a symbol; the symbol itself if there is no such thing.
    pub fn thing_name<'a>(&'a self, symbol: &'a str) -> &'a str {
        self.thing(symbol).map_or(symbol, |n| &self.things[n].name)
    }

    /// Object on a surface that is most likely the thing; `None` if none reaches the confidence threshold.
    pub fn standing(&self, thing: &str, surface: &str) -> Option<&Track> {
        let thing = &self.things[self.thing(thing).ok()?];
        let there = self.belief.tracks.iter().filter(|t| t.on == surface);
        there
            .max_by(|a, b| thing.is(a).total_cmp(&thing.is(b)))
            .filter(|track| thing.is(track) >= self.threshold)
    }

    /// Point of an object's axis at a share of its height above its foot, map frame.
    pub fn on_axis(&self, track: &Track, share: f64) -> Point3<f64> {
        let up = self.surface_of(track).map_or_else(Vector3::z, |on| self.surfaces[on].up);
        track.position_m + up * (share * track.size_m[2])
    }

    /// Horizontal distance of a point from the body at a candidate, metres; `None` with a wall in between or
    /// at a station.
    pub fn distance_m(&self, from: usize, p: &Point3<f64>) -> Option<f64> {
        let Place::Pose(base) = &self.candidates[from].place else { return None };
        (!self.is_walled_off(&base.point(), &p.xy())).then(|| (p.xy() - base.point()).norm())
    }

    /// True if the hand reaches a point from a candidate with no wall in between and with a margin for
    /// localisation error. The candidate nearest to the point needs no margin.
    pub fn reaches(&self, from: usize, p: &Point3<f64>) -> bool {
        let body = self.robot.description();
        let Some((d_m, reach_m)) = self.distance_m(from, p).zip(body.reach_m()) else { return false };
        let is_nearest = || {
            let others = (0..self.candidates.len()).filter(|&other| self.can_drive_to(other));
            others.filter_map(|other| self.distance_m(other, p)).all(|other_m| d_m <= other_m)
        };
        d_m <= reach_m && (d_m + astray_m(body) <= reach_m || is_nearest())
    }
}

/// Localisation error to allow for at an object seen from [`FROM_M`], metres.
pub(crate) fn astray_m(body: &Description) -> f64 {
    ASTRAY * (body.pose_sigma_m + body.pose_sigma_rad * FROM_M)
}
