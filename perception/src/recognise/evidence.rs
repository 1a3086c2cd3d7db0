//! Measures of a segment that distinguish objects, with their visibility.

use super::asker::{Asker, IN_VIEW_M};
use super::body::Frustum;
use super::ends::{Side, sides, top_hidden};
use super::model::{ObjectModel, Range};
use super::painted::Painted;
use super::percept::{Evidence, Sighting};
use super::rays::{Around, EDGE_PIXELS, PIXELS, Rays};
use super::settle::settle;
use super::upper::Upper;
use crate::noise::Sensor;
use crate::outline::{self, Rectangle};
use crate::round::{self, ENDS, Edge, NO_CIRCLE, Round, SECTORS, distance};
use crate::scale::{APART_M, EDGE_M, HANDLE_M, HANDLE_WIDTH_M, PLACE_M, SHAPE_M, SPREADS};
use crate::segment::{Scene, Segment, VOXEL_ENDS, end, quantile, top_m};
use crate::surface::nearest_sigma_m;
use crate::visibility::{Seen, Visibility};
use nalgebra::Point3;

/// Distances from the body at which a handle is sampled, metres. From: chosen.
const HANDLE_REACHES_M: [f64; 3] = [0.010, 0.018, 0.026];
/// Heights at which a handle is sought, as shares of the body's height. From: chosen.
const HANDLE_HEIGHTS: [f64; 3] = [0.35, 0.55, 0.72];
/// Heights at which a camera is tested for looking through the side, as shares of the body's
/// height. From: chosen.
const SIDE_HEIGHTS: [f64; 4] = [0.35, 0.5, 0.65, 0.8];
/// Minimum number of [`SIDE_HEIGHTS`] at which a camera must look through the side: the foot of a
/// far side is often hidden by the near one. From: chosen.
const THROUGH: usize = 3;
/// Maximum share of directions in which a handle could be hidden for a body to count as having none.
/// From: chosen.
pub(super) const UNSEEN: f64 = 0.08;
/// Share of a protrusion's reach below which a point may lie on the body's own blurred side.
/// From: chosen.
const ROOT: f64 = 0.35;
/// Log likelihood ratio from which an inside is reported as seen or absent. From: chosen.
const SAID: f64 = 1.5;
/// Divisors of the number of a body's points that give the number required of a visible handle, for
/// a far and for a near body. From: chosen.
pub(super) const HANDLE_POINTS: (usize, usize) = (30, 150);
/// Lower and upper limit of the number of points required of a visible handle. From: chosen.
pub(super) const HANDLE_FEWEST: (usize, usize) = (6, 60);
/// Minimum height of a handle, metres. From: chosen.
const HANDLE_HIGH_M: f64 = 0.012;

/// Margin around and above an object within which pixels are used, and distance beyond its edge at
/// which free space is tested, metres. From: chosen.
const BESIDE_M: f64 = 0.012;
/// Minimum height of an object, metres. From: rounding.
const LEAST_HEIGHT_M: f64 = 0.001;
/// Minimum and maximum height of the rim, which is no part of the side, as shares of the body's
/// height. From: chosen.
const RIMS: (f64, f64) = (0.1, 0.45);
/// Number of side points that share an error. From: chosen.
const SHARING: f64 = 12.0;
/// Maximum number of groups of side points with independent errors. From: chosen.
const MOST_GROUPS: f64 = 60.0;

/// Measures of one segment.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub evidence: Evidence,
    /// Root mean square distance of the surface's own points from its plane, metres: noise plus the
    /// remaining merging error.
    pub blur_m: f64,
    /// Best-fitting upright round body; `None` if no circle fits.
    pub round: Option<Round>,
    /// Best-fitting rectangle of the side, seen from above; `None` if there are too few points.
    pub rectangle: Option<Rectangle>,
    /// Residual of the side from the best round body of the other stance (horizontal axis for a
    /// standing object, vertical for a lying one), metres; infinite if there is none.
    pub rival_m: f64,
    /// Height above the support, metres.
    pub height_m: f64,
    /// Standard deviation of the height, metres.
    pub height_sigma_m: f64,
    /// True if an occluder may hide the true top.
    pub top_hidden: bool,
    /// The bounding rectangle seen from above, surface frame.
    pub footprint: Rectangle,
    /// Likelihoods of the lengths of both sides of the footprint if the object is a box; `None` if
    /// its height fits no known box.
    pub sides: Option<[Side; 2]>,
    /// Share of the directions in which a camera looked through the place of the round body's side:
    /// evidence against that form.
    pub looked_through: f64,
    /// Effective number of independent points on the side.
    pub independent: f64,
    /// Standard deviation of one depth measurement, metres.
    pub sigma_m: f64,
    /// Share of the object's sides and top that a camera measured or saw past.
    pub seen_fraction: f64,
    /// Evidence of rays about the upper end.
    pub upper: Upper,
    /// Colours of the body's pixels.
    pub painted: Painted,
}

impl Measured {
    /// Distance between merged views of one surface, metres, a lower bound on measurement accuracy;
    /// 0 for a single view.
    pub fn apart_m(&self) -> f64 {
        if self.evidence.views > 1 { self.blur_m } else { 0.0 }
    }

    /// Centre of the footprint (surface frame), and distance to its corners, metres.
    pub fn footprint_reach(&self) -> ([f64; 2], f64) {
        let [long_m, short_m] = self.footprint.sides_m;
        ([self.footprint.x, self.footprint.y], 0.5 * distance(long_m, short_m))
    }
}

/// Measures of an object, and the pixels around it.
pub(super) struct Looked {
    pub measured: Measured,
    pub rays: Rays,
}

/// Scene with its models, as the context for measuring each object.
pub(super) struct Setting<'a> {
    pub scene: &'a Scene,
    pub sensor: Sensor,
    /// Width, depth and height ranges of all known boxes, metres.
    box_sides_m: Vec<Range>,
    /// Bounding rectangle of each segment, seen from above.
    reaches: Vec<Reach>,
}

impl<'a> Setting<'a> {
    pub fn of(scene: &'a Scene, sensor: Sensor, models: &[ObjectModel]) -> Setting<'a> {
        let box_sides_m = models.iter().filter_map(ObjectModel::box_sides_m).flatten().collect();
        Setting { scene, sensor, box_sides_m, reaches: scene.segments.iter().map(Reach::of).collect() }
    }

    /// Visibility queries around a segment, without cameras that are misregistered there.
    pub fn asker<'v>(&self, segment: &Segment, seen: &'v Visibility, m: &Measured) -> Asker<'v> {
        let world_from_surface = self.scene.surface.surface_from_world.inverse();
        Asker::of(seen, world_from_surface, &segment.points, tolerance_m(m.sigma_m))
    }

    /// Maximum side length that is tried for the object as a box, metres; `None` if its height is
    /// that of no side of a known box.
    fn longest_box_m(&self, m: &Measured) -> Option<f64> {
        /// Multiple of a known box's length up to which lengths are tried, to distinguish longer
        /// objects. From: chosen.
        const LONGER: f64 = 1.3;
        /// Number of standard deviations of a height from which a difference is beyond doubt.
        /// From: chosen.
        const SURE: f64 = 6.0;
        let out_m = SURE * m.height_sigma_m;
        let may_be = |range: &&Range| {
            m.height_m < range.high + out_m && (m.top_hidden || m.height_m > range.low - out_m)
        };
        let longest_m = self.box_sides_m.iter().map(|range| range.high).reduce(f64::max);
        self.box_sides_m.iter().find(may_be).and(longest_m).map(|longest_m| LONGER * longest_m)
    }
}

/// Minimum and maximum coordinate of a segment along both axes of the surface, metres.
struct Reach {
    low: [f64; 2],
    high: [f64; 2],
}

impl Reach {
    fn of(segment: &Segment) -> Reach {
        let none = Reach { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        segment.points.iter().fold(none, |r, p| Reach {
            low: [r.low[0].min(p.x), r.low[1].min(p.y)],
            high: [r.high[0].max(p.x), r.high[1].max(p.y)],
        })
    }

    fn is_within(&self, reach_m: f64, x: f64, y: f64) -> bool {
        let near = |k: usize, at: f64| self.low[k] < at + reach_m && self.high[k] > at - reach_m;
        near(0, x) && near(1, y)
    }
}

/// Pixels around a standing object.
fn rays(segment: &Segment, own: (&[Point3<f64>], &Measured), asker: &Asker, setting: &Setting) -> Rays {
    let m = own.1;
    let (x, y) = m.round.map_or((m.footprint.x, m.footprint.y), |round| (round.x, round.y));
    let half_m = m.round.map_or(0.5 * m.footprint.sides_m[0], |r| {
        r.radius_at(segment.base_m).max(r.radius_at(segment.base_m + m.height_m))
    });
    rays_around(([x, y], half_m, PIXELS), segment, own, asker, setting)
}

/// Pixels around an object centred at `[x, y]`, out to its half width and a margin; about `pixels`
/// of each view.
pub(super) fn rays_around(
    ([x, y], half_m, pixels): ([f64; 2], f64, f64),
    segment: &Segment,
    (own, m): (&[Point3<f64>], &Measured),
    asker: &Asker,
    Setting { scene, sensor, reaches, .. }: &Setting,
) -> Rays {
    let around = Around {
        x,
        y,
        reach_m: half_m + BESIDE_M,
        base_m: segment.base_m,
        top_m: segment.base_m + m.height_m + BESIDE_M,
        pixels,
    };
    let others = scene
        .segments
        .iter()
        .zip(reaches)
        .filter(|(other, reach)| !std::ptr::eq(*other, segment) && reach.is_within(around.reach_m, x, y));
    Rays::of(asker, sensor, &around, own, others.flat_map(|(other, _)| &other.points))
}

/// Maximum distance of a point from a measured surface that counts as on the surface, metres.
pub(super) fn tolerance_m(sigma_m: f64) -> f64 {
    (SPREADS * sigma_m).clamp(PLACE_M, APART_M)
}

/// Measures one segment of a scene.
pub(super) fn measure(setting: &Setting, segment: &Segment, seen: &Visibility) -> Looked {
    let (scene, this) = (setting.scene, segment);
    let base_m = segment.base_m;
    let top = top_m(segment);
    let height_m = (top - base_m).max(LEAST_HEIGHT_M);
    let bounding = |segment: &Segment| outline::bounding(&segment.points).unwrap_or(Rectangle::NONE);
    let footprint = bounding(segment);
    let world_from_surface = scene.surface.surface_from_world.inverse();
    let place = Point3::new(footprint.x, footprint.y, 0.5 * (base_m + top));
    let sigma_m = nearest_sigma_m(&(world_from_surface * place), &seen.viewpoints());
    let asker = Asker::of(seen, world_from_surface, &segment.points, tolerance_m(sigma_m));
    let first = round::fit(&segment.points, base_m, top, sigma_m, round::SEED);
    let settled = first.and_then(|round| settle(&round, segment, &asker, (base_m, top), sigma_m));
    let (segment, asker, first, footprint) = match &settled {
        Some(settled) => {
            (&settled.segment, settled.asker.clone(), Some(settled.round), bounding(&settled.segment))
        }
        None => (segment, asker, first, footprint),
    };
    // What is measured of a low thing's top reaches far down its side.
    let rim_m = (EDGE_M + SPREADS * sigma_m).clamp(RIMS.0 * height_m, RIMS.1 * height_m);
    let side_m = base_m + ENDS.0 * height_m..top - rim_m;
    let side: Vec<Point3<f64>> = segment.points.iter().filter(|p| side_m.contains(&p.z)).copied().collect();
    let mut measured = Measured {
        blur_m: scene.surface.residual_m,
        evidence: Evidence { taper: 1.0, ..Evidence::default() },
        round: first,
        rectangle: outline::fit(&side),
        rival_m: f64::INFINITY,
        height_m,
        height_sigma_m: SHAPE_M
            .hypot(0.5 * sigma_m)
            .hypot(0.5 * scene.surface.residual_m)
            .hypot(this.base_sigma_m),
        top_hidden: top_hidden(&asker, &footprint, top),
        sides: None,
        footprint,
        looked_through: 0.0,
        independent: (side.len() as f64 / SHARING).clamp(1.0, MOST_GROUPS),
        sigma_m,
        seen_fraction: 0.0,
        upper: Upper::default(),
        painted: Painted::of(&this.points, &world_from_surface, seen),
    };
    measured.evidence.views = views_of(&asker, &place);
    if let Some(rectangle) = &measured.rectangle {
        measured.evidence.box_residual_m = rectangle.residual_m;
    }
    if let Some(first) = first {
        let edges = silhouettes(&first, segment, &asker, base_m, height_m);
        let round = round::refit(&first, &segment.points, &edges, base_m, top, sigma_m);
        // Measured worse than a place is known, depth spreads points along the view as far as the side is deep.
        let eye = (sigma_m > PLACE_M).then(|| asker.only_from(&first)).flatten();
        let round =
            round.map(|r| eye.and_then(|eye| r.behind(&segment.points, (base_m, top), eye)).unwrap_or(r));
        measured.round = round.filter(|round| round.inliers >= NO_CIRCLE);
    }
    if let Some(longest_m) = setting.longest_box_m(&measured) {
        let [long_m, short_m] = footprint.sides_m;
        let reach_m = 0.5 * long_m.hypot(short_m) + (longest_m - short_m).max(0.0);
        let place = ([footprint.x, footprint.y], reach_m, EDGE_PIXELS);
        let rays = rays_around(place, this, (&segment.points, &measured), &asker, setting);
        let about = [measured.rectangle.as_ref().unwrap_or(&footprint), &footprint];
        measured.sides = Some(sides(&rays, about, (base_m, top), longest_m));
    }
    let rays = rays(this, (&segment.points, &measured), &asker, setting);
    if let Some(round) = measured.round {
        measure_round(&mut measured, &round, (segment, &asker, &rays), (base_m, top));
    }
    Looked { measured, rays }
}

/// Height bands in which silhouettes are measured, as shares of the body's height. From: chosen.
const SILHOUETTES: [(f64, f64); 3] = [(0.15, 0.4), (0.4, 0.65), (0.65, 0.92)];

/// Left and right ends of the body's silhouette against free space in each view, at three heights.
fn silhouettes(round: &Round, segment: &Segment, asker: &Asker, base_m: f64, height: f64) -> Vec<Edge> {
    /// Narrowing of each side by lost pixels at depth edges, metres. From: chosen.
    const LOST_M: f64 = 0.001;
    /// Quantile of the points of a band that defines its edge. From: chosen.
    const END: f64 = 0.985;
    /// Maximum number of points used of a band. From: work.
    const ENOUGH: usize = 600;
    let bands = SILHOUETTES.map(|(low, high)| (base_m + low * height, base_m + high * height));
    let in_band = |&(low, high): &(f64, f64)| {
        let near = |p: &&Point3<f64>| p.z >= low && p.z < high && round.outside_m(p) < BESIDE_M;
        let places: Vec<[f64; 2]> = segment.points.iter().filter(near).map(|p| [p.x, p.y]).collect();
        let stride = places.len().div_ceil(ENOUGH).max(1);
        places.into_iter().step_by(stride).collect::<Vec<[f64; 2]>>()
    };
    let near = bands.each_ref().map(in_band);
    let mut edges = Vec::new();
    for view in &asker.views {
        let (ex, ey) = (round.x - view.viewpoint.x, round.y - view.viewpoint.y);
        let distance = ex.hypot(ey);
        if distance < 2.0 * round.radius_m {
            continue;
        }
        for side in [-1.0, 1.0] {
            // The tangent point leans a little towards the camera: across the ray, not across the table.
            let across = [side * -ey / distance, side * ex / distance];
            for ((low, high), near) in bands.iter().zip(&near).filter(|(_, near)| !near.is_empty()) {
                let z = 0.5 * (low + high);
                let reaches: Vec<f64> = near.iter().map(|p| across[0] * p[0] + across[1] * p[1]).collect();
                let reach_m = end(&reaches, END) + LOST_M;
                let beyond = reach_m + BESIDE_M - (across[0] * round.x + across[1] * round.y);
                let place = Point3::new(round.x + across[0] * beyond, round.y + across[1] * beyond, z);
                if view.look(&place, asker.tolerance_m) == Seen::Free {
                    edges.push(Edge { direction: across, reach_m, height_m: z });
                }
            }
        }
    }
    edges
}

/// Number of views with the point (surface frame) in the image, measured or hidden.
fn views_of(asker: &Asker, place: &Point3<f64>) -> usize {
    asker.views.iter().filter(|view| !matches!(view.look(place, IN_VIEW_M), Seen::Never)).count()
}

fn measure_round(
    measured: &mut Measured,
    round: &Round,
    (segment, asker, rays): (&Segment, &Asker, &Rays),
    (base_m, top): (f64, f64),
) {
    /// Weight of the sides in the seen share of a body; the top has the rest. From: chosen.
    const SIDES: f64 = 0.75;
    let height = top - base_m;
    let evidence = &mut measured.evidence;
    let (at_base, at_top) = (round.radius_at(base_m), round.radius_at(top));
    evidence.radius_m = at_base.max(at_top);
    evidence.radius_sigma_m = round.radius_sigma_m.hypot(0.5 * height * round.slope_sigma);
    evidence.taper = at_base / at_top;
    evidence.round_residual_m = round.spread_m;
    evidence.round_inliers = round.inliers;

    let sectors = Sectors::measure(round, segment, asker, base_m, height);
    evidence.arc = sectors.measured_share();
    measured.looked_through = sectors.looked_through_share();
    evidence.handle_unseen = sectors.unseen_share();
    let mut spread_m = round.spread_m;
    // As far off, a few points that stick out together are no handle.
    let protrusion = Protrusion::find(round, segment, asker, (base_m, height), measured.sigma_m > PLACE_M);
    if let Some(protrusion) = &protrusion {
        evidence.protrusion_m = protrusion.reach_m;
        // What may be a handle says nothing against the roundness of what it is the handle of.
        let body = |p: &Point3<f64>| !protrusion.has(round, p);
        spread_m = round.spread_of(&segment.points, (base_m, top), measured.sigma_m, body);
    }
    evidence.handle = match protrusion.filter(|p| p.is_handle(spread_m)) {
        Some(_) => {
            evidence.round_residual_m = spread_m;
            measured.round = Some(Round { spread_m, ..*round });
            Sighting::Seen
        }
        None if evidence.handle_unseen < UNSEEN => Sighting::Absent,
        None => Sighting::Unseen,
    };

    let upper = Upper::of(&rays.views, &Frustum::around(round, base_m, top));
    (evidence.open, evidence.lid) = (upper.open, upper.lid);
    evidence.inside = match upper.open_log {
        log if log > SAID => Sighting::Seen,
        log if log < -SAID => Sighting::Absent,
        _ => Sighting::Unseen,
    };
    measured.seen_fraction =
        SIDES * sectors.covered_share() + (1.0 - SIDES) * (upper.open + upper.lid).min(1.0);
    if evidence.radius_sigma_m > APART_M {
        // Beside and above a circle that may as well be another, nothing was looked at.
        (evidence.handle, evidence.handle_unseen, evidence.inside) =
            (Sighting::Unseen, 1.0, Sighting::Unseen);
        measured.looked_through = 0.0;
        // A sliver may be cut off above, too.
        measured.height_sigma_m = measured.height_sigma_m.hypot(PLACE_M);
    } else {
        measured.upper = upper;
    }
}

/// Visibility around a round body, direction by direction.
struct Sectors {
    /// True for each direction in which the side was measured.
    measured: [bool; SECTORS],
    /// True for each direction in which a camera looked through the side.
    looked_through: [bool; SECTORS],
    /// Seen-through share of possible handle positions, by direction.
    handle_free: [f64; SECTORS],
}

impl Sectors {
    fn measure(round: &Round, segment: &Segment, asker: &Asker, base_m: f64, height: f64) -> Sectors {
        let mut sectors = Sectors {
            measured: measured_sectors(round, &segment.points, base_m, height),
            looked_through: [false; SECTORS],
            handle_free: [0.0; SECTORS],
        };
        for i in 0..SECTORS {
            let (sin, cos) = (std::f64::consts::TAU * (i as f64 + 0.5) / SECTORS as f64).sin_cos();
            let look = |reach: f64, share: f64| {
                let z = base_m + share * height;
                let d = round.radius_at(z) + reach;
                asker.look(round.x + d * cos, round.y + d * sin, z)
            };
            // Free, or another thing's surface: either way the body's own side is not there.
            sectors.looked_through[i] = !sectors.measured[i]
                && SIDE_HEIGHTS.iter().filter(|&&share| look(-EDGE_M, share) >= Seen::Surface).count()
                    >= THROUGH;
            let free = HANDLE_REACHES_M
                .iter()
                .flat_map(|&reach| HANDLE_HEIGHTS.map(|share| look(reach, share)))
                .filter(|&s| s == Seen::Free)
                .count();
            sectors.handle_free[i] = free as f64 / (HANDLE_REACHES_M.len() * HANDLE_HEIGHTS.len()) as f64;
        }
        sectors
    }

    fn measured_share(&self) -> f64 {
        share(&self.measured)
    }

    fn looked_through_share(&self) -> f64 {
        share(&self.looked_through)
    }

    /// Share of the directions in which the side was measured or a camera saw past it.
    fn covered_share(&self) -> f64 {
        let covered = |i: usize| self.measured[i] || self.handle_free[i] > 0.5;
        (0..SECTORS).filter(|&i| covered(i)).count() as f64 / SECTORS as f64
    }

    /// Share of the directions in which a handle, about two sectors wide, could hide.
    fn unseen_share(&self) -> f64 {
        /// Minimum seen-through share of possible handle positions that excludes a handle.
        /// From: chosen.
        const FREE: f64 = 0.6;
        let hides = |i: usize| self.handle_free[i] < FREE && self.handle_free[(i + 1) % SECTORS] < FREE;
        (0..SECTORS).filter(|&i| hides(i)).count() as f64 / SECTORS as f64
    }
}

/// True for each direction in which two or more points lie on the side.
pub(super) fn measured_sectors(
    round: &Round,
    points: &[Point3<f64>],
    base_m: f64,
    height: f64,
) -> [bool; SECTORS] {
    let (low, high) = (base_m + ENDS.0 * height, base_m + (1.0 - ENDS.1) * height);
    let on_side = |p: &&Point3<f64>| p.z > low && p.z < high && round.outside_m(p).abs() < PLACE_M;
    let mut counts = [0_u32; SECTORS];
    points.iter().filter(on_side).for_each(|p| counts[sector_of(round, p)] += 1);
    counts.map(|c| c >= 2)
}

fn share(flags: &[bool; SECTORS]) -> f64 {
    flags.iter().filter(|f| **f).count() as f64 / SECTORS as f64
}

fn sector_of(round: &Round, p: &Point3<f64>) -> usize {
    round::sector(p.x - round.x, p.y - round.y)
}

/// Largest protrusion of the body in one direction.
pub(super) struct Protrusion {
    pub reach_m: f64,
    /// Direction of the protrusion: sine and cosine.
    direction: (f64, f64),
    width_m: f64,
    /// Number of points of the protrusion.
    points: usize,
    /// Minimum number of points of a handle.
    least: usize,
    /// True if the protrusion spans at least the height of a handle and begins above the foot.
    inside_height: bool,
}

impl Protrusion {
    fn find(
        round: &Round,
        segment: &Segment,
        asker: &Asker,
        (base_m, height): (f64, f64),
        far: bool,
    ) -> Option<Protrusion> {
        /// Minimum and maximum height of a protrusion's points, as shares of the body's height.
        /// From: chosen.
        const HEIGHTS: (f64, f64) = (0.08, 1.02);
        /// Number of sectors combined for a protrusion. From: chosen.
        const WINDOW: usize = 3;
        /// Minimum number of points of a protrusion. From: chosen.
        const FEWEST: usize = 3;
        /// Quantiles of a protrusion's points that define its extent across and in height.
        /// From: chosen.
        const SPAN: (f64, f64) = (0.1, 0.9);
        let beside = |p: &&Point3<f64>| {
            let outside_m = round.outside_m(p);
            let clear = |sigma_m: f64| outside_m > SPREADS * sigma_m;
            outside_m > PLACE_M && asker.support(p).is_some_and(clear)
        };
        let out: Vec<&Point3<f64>> = segment
            .points
            .iter()
            .filter(|p| p.z > base_m + HEIGHTS.0 * height && p.z < base_m + HEIGHTS.1 * height)
            .filter(beside)
            .collect();
        let mut counts = [0_usize; SECTORS];
        out.iter().for_each(|p| counts[sector_of(round, p)] += 1);
        let window = |i: usize| (0..WINDOW).map(|k| counts[(i + k) % SECTORS]).sum::<usize>();
        let start = (0..SECTORS).max_by_key(|&i| (window(i), SECTORS - i))?;
        let middle = std::f64::consts::TAU * (start as f64 + 0.5 * WINDOW as f64) / SECTORS as f64;
        let (sin, cos) = middle.sin_cos();
        // Along and across the direction of the protrusion, in the half plane on its side.
        let local: Vec<(f64, f64, f64)> = out
            .iter()
            .map(|p| {
                let (along, across) = along_and_across(round, p, (sin, cos));
                (along, across, p.z)
            })
            .filter(|&(along, ..)| along > 0.0)
            .collect();
        if local.len() < FEWEST {
            return None;
        }
        let reach_of = |&(along, across, z): &(f64, f64, f64)| along.hypot(across) - round.radius_at(z);
        let mut reaches: Vec<f64> = local.iter().map(reach_of).collect();
        let reach_m = quantile(&mut reaches, VOXEL_ENDS.1);
        // What hardly leaves the body is its blurred side, beside the handle or not.
        let (mut across, mut heights): (Vec<f64>, Vec<f64>) =
            local.iter().filter(|l| reach_of(l) > ROOT * reach_m).map(|l| (l.1, l.2)).unzip();
        let ends = |v: &mut Vec<f64>| (quantile(v, SPAN.0), quantile(v, SPAN.1));
        let (left, right) = ends(&mut across);
        let (low, high) = ends(&mut heights);
        Some(Protrusion {
            reach_m,
            direction: (sin, cos),
            width_m: right - left,
            points: local.len(),
            least: (segment.points.len() / if far { HANDLE_POINTS.0 } else { HANDLE_POINTS.1 })
                .clamp(HANDLE_FEWEST.0, HANDLE_FEWEST.1),
            inside_height: high - low > HANDLE_HIGH_M && low > base_m,
        })
    }

    /// True if a point lies in the protrusion.
    fn has(&self, round: &Round, p: &Point3<f64>) -> bool {
        let (along, across) = along_and_across(round, p, self.direction);
        round.outside_m(p) > PLACE_M && along > 0.0 && across.abs() < HANDLE_WIDTH_M
    }

    /// True if the protrusion is a handle rather than an artefact of misaligned views; `spread_m`:
    /// root mean square distance of the side's points from the body, metres.
    fn is_handle(&self, spread_m: f64) -> bool {
        self.points >= self.least
            && (HANDLE_M.0.max(SPREADS * spread_m)..HANDLE_M.1).contains(&self.reach_m)
            && self.width_m < HANDLE_WIDTH_M
            && self.inside_height
    }
}

/// Coordinates of a point from the axis, along a direction (sine and cosine) and across it, metres.
fn along_and_across(round: &Round, p: &Point3<f64>, (sin, cos): (f64, f64)) -> (f64, f64) {
    let (x, y) = (p.x - round.x, p.y - round.y);
    (x * cos + y * sin, y * cos - x * sin)
}
