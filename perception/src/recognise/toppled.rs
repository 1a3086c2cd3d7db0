//! A round thing that lies on its side: once it is turned as if it stood, it is measured as what stands.
//!
//! Which of its ends is the foot is not known: it is turned both ways.

use super::asker::Asker;
use super::body::Frustum;
use super::evidence::{
    HANDLE_FEWEST, HANDLE_POINTS, MOST, Measured, Setting, UNSEEN, measured_sectors, rays_around, tolerance_m,
};
use super::model::{Handle, ObjectModel, Range, Shape};
use super::percept::{Evidence, Sighting};
use super::rays::{Rays, ViewRays};
use super::upper::Upper;
use super::verify::Own;
use crate::outline::Rectangle;
use crate::round::{self, Round, SECTORS, side_band};
use crate::scale::{APART_M, EDGE_M, HANDLE_M, PLACE_M};
use crate::segment::{POINT_ENDS, Segment, VOXEL_ENDS, end, quantile};
use crate::visibility::Visibility;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Its axis is sought about the sides of what bounds it from above, turned by so much, radians. From: chosen.
const TURNS: [f64; 3] = [0.0, 0.1, -0.1];
/// Points by which the direction of its axis is sought, at the most. From: chosen.
const SCOUTS: usize = 300;
/// An end that a camera sees flatter than this tells neither lid nor inside: what it is off by leads far along the ray, cosine of 60
/// degrees. From: chosen.
const FACING: f64 = 0.5;

/// What was measured of a thing that may lie, with either end for its foot, and the pixels that are asked about each.
pub(super) struct Toppled {
    pub ways: [Way; 2],
    /// The pixels around it as it lies.
    flat: Rays,
    base_m: f64,
}

/// A thing turned so that one of its ends is down.
pub(super) struct Way {
    pub measured: Measured,
    rays: Rays,
    foot_m: f64,
}

impl Toppled {
    /// None if it is not as large as one of the models would be that lies, or not round about an axis along the surface.
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
        let mut found = fit(segment, &measured.footprint, measured.sigma_m)?;
        let asker = Asker::of(
            seen,
            setting.scene.surface.surface_from_world.inverse(),
            &segment.points,
            tolerance_m(measured.sigma_m),
        );
        let place = ([measured.footprint.x, measured.footprint.y], 0.5 * measured.footprint.sides_m[0]);
        let flat = rays_around(place, segment, (&segment.points, measured), &asker, setting);
        let handle = found.handle();
        if handle.sighting == Sighting::Seen {
            found.body.round.spread_m = found.spread_without_handle_m(measured.sigma_m);
        }
        let ways = [found.body, found.body.over()].map(|body| Way::of(measured, &flat, &body, &handle));
        Some(Toppled { ways, flat, base_m: segment.base_m })
    }

    /// How far the side is off the round body that lies, metres.
    pub fn spread_m(&self) -> f64 {
        self.ways[0].measured.evidence.round_residual_m
    }

    /// What known models that lie are compared with, for each way.
    pub fn own(&self, measured: &Measured) -> [Own<'_>; 2] {
        let as_it_lies = Own::of(&self.flat, measured, self.base_m);
        self.ways.each_ref().map(|way| as_it_lies.turned(&way.rays, &way.measured, way.foot_m))
    }
}

impl Way {
    fn of(m: &Measured, flat: &Rays, body: &Body, handle: &HandleSeen) -> Way {
        let Body { turned, round, ends_m: [foot_m, rim_m] } = *body;
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

/// True if a model that lies on its side could be measured so: half of its length may be hidden.
fn may_lie(model: &ObjectModel, m: &Measured) -> bool {
    let (Shape::Round, Some(thick_m)) = (model.shape, model.diameter_m) else { return false };
    let out_m = if model.handle == Handle::None { 0.0 } else { HANDLE_M.1 };
    let long_m =
        Range { low: model.height_m.low.max(thick_m.low), high: model.height_m.high.max(thick_m.high) };
    let is_near = |value: f64, low: f64, high: f64| value > low - APART_M && value < high + APART_M;
    is_near(m.height_m, thick_m.low, thick_m.high)
        && is_near(m.footprint.sides_m[0], 0.5 * long_m.low, long_m.high + out_m)
}

/// A round body about an axis along the surface.
#[derive(Clone, Copy)]
struct Body {
    /// Surface to a frame in which the axis is z and y leads away from the surface.
    turned: Isometry3<f64>,
    /// The body there, and where it ends.
    round: Round,
    ends_m: [f64; 2],
}

impl Body {
    /// The same with its other end down.
    fn over(&self) -> Body {
        let over = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
        let Body { turned, round, ends_m: [foot, rim] } = *self;
        let round = Round { x: -round.x, slope: -round.slope, middle_m: -round.middle_m, ..round };
        Body { turned: over * turned, round, ends_m: [-rim, -foot] }
    }
}

/// A body that was found, the points in its frame, and the direction of its axis.
struct Found {
    body: Body,
    points: Vec<Point3<f64>>,
    angle: f64,
    /// Mean squared distance of the points from the side, each at most that of what is clear of it, square metres.
    miss_m2: f64,
}

/// Whether what lies has a handle.
struct HandleSeen {
    sighting: Sighting,
    /// Share of the directions in which one could hide.
    unseen: f64,
    /// How far it reaches out, metres.
    reach_m: f64,
}

impl Found {
    /// The handle lies beside the body or above it: what it rests on leaves no room below.
    fn handle(&self) -> HandleSeen {
        let Body { round, ends_m: [low, high], .. } = self.body;
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

    /// What may be a handle says nothing against the roundness of what it is the handle of.
    fn spread_without_handle_m(&self, sigma_m: f64) -> f64 {
        let Body { round, ends_m: [low, high], .. } = self.body;
        round.spread_of(&self.points, (low, high), sigma_m, |p| round.outside_m(p) < PLACE_M)
    }
}

/// The best round body about an axis along the surface.
fn fit(segment: &Segment, bounds: &Rectangle, sigma_m: f64) -> Option<Found> {
    let points = &segment.points;
    let few: Vec<Point3<f64>> =
        points.iter().step_by(points.len().div_ceil(SCOUTS).max(1)).copied().collect();
    let sides = [0.0, std::f64::consts::FRAC_PI_2];
    let angle = bounds.turn.0.atan2(bounds.turn.1);
    let angles = sides.into_iter().flat_map(|side| TURNS.map(|by| angle + side + by));
    let origin = Translation3::new(-bounds.x, -bounds.y, -segment.base_m);
    let best = |a: &Found, b: &Found| a.miss_m2.total_cmp(&b.miss_m2);
    let scouted = angles.filter_map(|angle| about(&few, &origin, (angle, 0.0), sigma_m)).min_by(best)?;
    let found = about(points, &origin, (scouted.angle, 0.0), sigma_m)?;
    // What narrows rests on its side: its axis rises towards the wider end.
    let rise = found.body.round.slope.atan();
    let risen = about(points, &origin, (found.angle, rise), sigma_m);
    [Some(found), risen].into_iter().flatten().min_by(best)
}

/// The round body about an axis in a direction, which rises by an angle, if it rests on what is below it.
fn about(
    points: &[Point3<f64>],
    origin: &Translation3<f64>,
    (angle, rise): (f64, f64),
    sigma_m: f64,
) -> Option<Found> {
    let (sin, cos) = angle.sin_cos();
    let (up, level) = rise.sin_cos();
    let along = Vector3::new(level * cos, level * sin, up);
    let across = Vector3::new(-sin, cos, 0.0);
    let rows = Matrix3::from_rows(&[across.transpose(), along.cross(&across).transpose(), along.transpose()]);
    let turned = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows)) * origin;
    let points: Vec<Point3<f64>> = points.iter().map(|p| turned * p).collect();
    let places: Vec<f64> = points.iter().map(|p| p.z).collect();
    let ends_m = [end(&places, POINT_ENDS.0), end(&places, POINT_ENDS.1)];
    let round = round::fit(&points, ends_m[0], ends_m[1], sigma_m, round::SEED)?;
    // It rests on its side, about a circle that is one to go by.
    let rests = (round.y - round.radius_m).abs() < PLACE_M + sigma_m;
    let is_told = round.radius_sigma_m < APART_M && round.inliers >= MOST;
    let band = side_band(ends_m[0], ends_m[1]);
    let misses = points.iter().filter(|p| band.contains(&p.z)).map(|p| round.outside_m(p).abs().min(PLACE_M));
    let (count, squares) = misses.fold((0.0, 0.0), |(n, sum), miss| (n + 1.0, sum + miss * miss));
    let miss_m2 = squares / f64::max(count, 1.0);
    (rests && is_told).then_some(Found { body: Body { turned, round, ends_m }, points, angle, miss_m2 })
}
