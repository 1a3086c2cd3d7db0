//! Round objects lying on their side, measured like standing ones after rotation.
//!
//! A lying object is measured with either end down, because it is unknown which end is its foot.

use super::asker::Asker;
use super::body::Frustum;
use super::evidence::{
    HANDLE_FEWEST, HANDLE_POINTS, Measured, Setting, UNSEEN, measured_sectors, rays_around, tolerance_m,
};
use super::model::{Handle, ObjectModel, Range, Shape};
use super::percept::{Evidence, Sighting};
use super::rays::{PIXELS, Rays, ViewRays};
use super::upper::Upper;
use super::verify::Own;
use crate::round::lying::{self, Found, LyingRound};
use crate::round::{SECTORS, side_band};
use crate::scale::{APART_M, EDGE_M, HANDLE_M, PLACE_M};
use crate::segment::{Segment, VOXEL_ENDS, quantile};
use crate::visibility::Visibility;
use nalgebra::Point3;

/// Minimum cosine (60°) between an end's normal and the viewing direction for the end to show lid
/// or inside; at flatter angles, errors extend far along the ray. From: chosen.
const FACING: f64 = 0.5;

/// Measures of an object that may lie, with either end as foot, and the pixels used for each.
pub(super) struct Toppled {
    pub ways: [Way; 2],
    /// Pixels around the lying object.
    flat: Rays,
    /// Height of the support, metres above the surface.
    base_m: f64,
}

/// Object rotated so that one of its ends is down.
pub(super) struct Way {
    pub measured: Measured,
    rays: Rays,
    /// Position of the foot along the axis, metres.
    foot_m: f64,
}

impl Toppled {
    /// Measures of an object as lying; `None` if its top is hidden, no lying model is about as
    /// large, or it is not round about an axis along the surface.
    pub fn of(
        setting: &Setting,
        segment: &Segment,
        seen: &Visibility,
        measured: &Measured,
        models: &[ObjectModel],
    ) -> Option<Toppled> {
        if measured.top_hidden || !models.iter().any(|model| may_lie(model, measured)) {
            return None;
        }
        let mut found = lying::fit(&segment.points, &measured.footprint, segment.base_m, measured.sigma_m)?;
        let asker = Asker::of(
            seen,
            setting.scene.surface.surface_from_world.inverse(),
            &segment.points,
            tolerance_m(measured.sigma_m),
        );
        let place =
            ([measured.footprint.x, measured.footprint.y], 0.5 * measured.footprint.sides_m[0], PIXELS);
        let flat = rays_around(place, segment, (&segment.points, measured), &asker, setting);
        let handle = found.handle();
        if handle.sighting == Sighting::Seen {
            found.body.round.spread_m = found.spread_without_handle_m(measured.sigma_m);
        }
        let ways = [found.body, found.body.over()].map(|body| Way::of(measured, &flat, &body, &handle));
        Some(Toppled { ways, flat, base_m: segment.base_m })
    }

    /// Root mean square distance of the side's points from the lying round body, metres.
    pub fn spread_m(&self) -> f64 {
        self.ways[0].measured.evidence.round_residual_m
    }

    /// References for verifying models that lie, with either end as foot.
    pub fn own(&self, measured: &Measured) -> [Own<'_>; 2] {
        let as_it_lies = Own::of(&self.flat, measured, self.base_m);
        self.ways.each_ref().map(|way| as_it_lies.turned(&way.rays, &way.measured, way.foot_m))
    }
}

impl Way {
    fn of(m: &Measured, flat: &Rays, body: &LyingRound, handle: &HandleSeen) -> Way {
        let LyingRound { turned, round, ends_m: [foot_m, rim_m] } = *body;
        let rays = flat.moved(&turned);
        let (at_foot, at_rim) = (round.radius_at(foot_m), round.radius_at(rim_m));
        let height_m = rim_m - foot_m;
        let rim = Point3::new(round.x, round.y, rim_m);
        let facing = |view: &&ViewRays| {
            let from = Point3::from(view.from) - rim;
            from.z > FACING * from.norm()
        };
        let upper = Upper::of(rays.views.iter().filter(facing), &Frustum::around(&round, foot_m, rim_m));
        let evidence = Evidence {
            radius_m: at_foot.max(at_rim),
            radius_sigma_m: round.radius_sigma_m.hypot(0.5 * height_m * round.slope_sigma),
            taper: at_foot / at_rim,
            round_residual_m: round.spread_m,
            round_inliers: round.inliers,
            handle: handle.sighting,
            handle_unseen: handle.unseen,
            protrusion_m: handle.reach_m,
            ..m.evidence.clone()
        };
        let measured = Measured {
            evidence,
            round: Some(round),
            rival_m: m.round.map_or(f64::INFINITY, |upright| upright.spread_m),
            height_m,
            height_sigma_m: m.height_sigma_m.hypot(EDGE_M),
            looked_through: 0.0,
            upper,
            ..m.clone()
        };
        Way { measured, rays, foot_m }
    }
}

/// True if a lying model could give these measures; half of its length may be hidden.
fn may_lie(model: &ObjectModel, m: &Measured) -> bool {
    let (Shape::Round, Some(thick_m)) = (model.shape, model.diameter_m) else { return false };
    let out_m = if model.handle == Handle::None { 0.0 } else { HANDLE_M.1 };
    let long_m =
        Range { low: model.height_m.low.max(thick_m.low), high: model.height_m.high.max(thick_m.high) };
    let is_near = |value: f64, low: f64, high: f64| value > low - APART_M && value < high + APART_M;
    is_near(m.height_m, thick_m.low, thick_m.high)
        && is_near(m.footprint.sides_m[0], 0.5 * long_m.low, long_m.high + out_m)
}

/// Result of looking for the handle of a lying object.
struct HandleSeen {
    sighting: Sighting,
    /// Share of the directions in which a handle could hide.
    unseen: f64,
    /// Reach of the handle from the body, metres; 0 unless seen.
    reach_m: f64,
}

impl Found {
    /// Looks for a handle beside or above the body; below the body, the support leaves no room.
    fn handle(&self) -> HandleSeen {
        let LyingRound { round, ends_m: [low, high], .. } = self.body;
        let band = side_band(low, high);
        let out = self.points.iter().filter(|p| band.contains(&p.z)).map(|p| round.outside_m(p));
        let mut out: Vec<f64> = out.filter(|out| (HANDLE_M.0..HANDLE_M.1).contains(out)).collect();
        let least = (self.points.len() / HANDLE_POINTS.1).clamp(HANDLE_FEWEST.0, HANDLE_FEWEST.1);
        let measured = measured_sectors(&round, &self.points, low, high - low);
        let has_room = |sector: usize| {
            let angle = std::f64::consts::TAU * (sector as f64 + 0.5) / SECTORS as f64;
            round.y + (round.radius_m + PLACE_M) * angle.sin() > 0.0
        };
        let hides = (0..SECTORS).filter(|&sector| has_room(sector) && !measured[sector]).count();
        let unseen = hides as f64 / SECTORS as f64;
        let sighting = match () {
            () if out.len() >= least => Sighting::Seen,
            () if unseen < UNSEEN => Sighting::Absent,
            () => Sighting::Unseen,
        };
        let reach_m = if sighting == Sighting::Seen { quantile(&mut out, VOXEL_ENDS.1) } else { 0.0 };
        HandleSeen { sighting, unseen, reach_m }
    }

    /// Root mean square distance of the side's points from the body, metres, without those of a
    /// possible handle, which are no evidence against roundness.
    fn spread_without_handle_m(&self, sigma_m: f64) -> f64 {
        let LyingRound { round, ends_m: [low, high], .. } = self.body;
        round.spread_of(&self.points, (low, high), sigma_m, |p| round.outside_m(p) < PLACE_M)
    }
}
