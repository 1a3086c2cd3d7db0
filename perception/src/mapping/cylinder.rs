//! Cylinders, announced in the paper: pillars from points outside the planes, and round walls, where one cylinder
//! replaces several planes.

mod post;

use super::cells::Region;
use super::patch::Patch;
use crate::draw::Draws;
use nalgebra::{Matrix3, Point2, Vector2, Vector3};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// An upright cylinder: a pillar, or a round wall that was seen from inside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UprightCylinder {
    /// Position of the axis in the map, metres.
    pub middle: Point2<f64>,
    /// Radius, metres.
    pub radius_m: f64,
    /// True if seen from inside: a round wall.
    pub from_inside: bool,
    /// Minimum and maximum observed height, metres.
    pub heights_m: (f64, f64),
    /// Observed arcs of the circle: start and end, anticlockwise from the x axis, radians.
    pub arcs_rad: Vec<(f64, f64)>,
    /// Root mean square residual of the fit, metres.
    pub rms_m: f64,
    /// Share of the points observed on or near the cylinder that lie on its surface.
    pub share: f64,
}

impl UprightCylinder {
    /// Total length of the observed arcs, radians.
    pub fn arc_rad(&self) -> f64 {
        self.arcs_rad.iter().map(|(from, to)| to - from).sum()
    }

    /// Point of the circle in a direction from the axis, map frame, metres.
    pub fn at(&self, angle_rad: f64) -> Point2<f64> {
        self.middle + Vector2::new(angle_rad.cos(), angle_rad.sin()) * self.radius_m
    }

    /// Chords of the observed arcs, as start and end points, one per sector.
    pub fn feet(&self) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> + '_ {
        let chords = |(from, to): &(f64, f64)| {
            let (from, count) = (*from, ((to - from) / PART_RAD).round().max(1.0) as usize);
            let step = (to - from) / count as f64;
            (0..count).map(move |k| (from + step * k as f64, from + step * (k + 1) as f64))
        };
        self.arcs_rad.iter().flat_map(chords).map(|(a, b)| (self.at(a), self.at(b)))
    }
}

/// Options for finding cylinders.
#[derive(Clone, Debug, PartialEq)]
pub struct CylinderOptions {
    /// Permitted radii of pillars, metres.
    pub pillar_m: RangeInclusive<f64>,
    /// Permitted radii of round walls, metres.
    pub round_wall_m: RangeInclusive<f64>,
    /// Maximum distance of a point from the cylinder's surface, metres.
    pub tolerance_m: f64,
    /// Minimum unbroken arc of a pillar, radians; a shorter one may be a bend of a wall.
    pub least_arc_rad: f64,
    /// Minimum unbroken arc of a round wall, radians; a shorter one may be the walls of a cluttered room.
    pub least_round_rad: f64,
    /// Minimum share of the points observed on or near the cylinder that must lie on its surface.
    pub least_share: f64,
}

impl Default for CylinderOptions {
    fn default() -> Self {
        CylinderOptions {
            pillar_m: 0.1..=0.6,
            round_wall_m: 1.0..=15.0,
            tolerance_m: 0.06,
            least_arc_rad: 2.1,
            least_round_rad: 4.0,
            least_share: 0.6,
        }
    }
}

/// Number of sectors into which a circle is divided to record the observed ones.
const PARTS: usize = 24;
/// Angle of a sector, radians.
const PART_RAD: f64 = TAU / PARTS as f64;
/// Minimum number of occupied cells in a column.
const LEVELS: u32 = 3;
/// Maximum width of a plane that may be a side of a pillar, in diameters of the largest pillar.
const NARROW: f64 = 1.0;
/// Maximum distance from a wide wall at which points belong to the wall, in cell edges.
const OF_WALL: f64 = 1.5;
/// Blur of a measured surface to each side of it, in tolerances.
const BLURRED: f64 = 3.0;
/// Minimum number of planes that a round wall must replace.
const PLANES: usize = 3;
/// Maximum number of circles that are tried.
const TRIES: usize = 3000;
/// Number of least-squares steps.
const STEPS: usize = 8;

/// Cell of the floor plan with an upright surface.
#[derive(Clone, Copy, Debug)]
struct Column {
    at: Point2<f64>,
    /// Mean horizontal direction to the camera.
    towards: Vector2<f64>,
    /// Number of occupied cells above each other.
    levels: u32,
    heights_m: (f64, f64),
}

/// Circle with the indices of the columns on it.
struct Circle {
    middle: Point2<f64>,
    radius_m: f64,
    on: Vec<usize>,
}

/// Finds cylinders, and removes the patches that are part of them. Patches are planes through those `regions` that have
/// a normal; only upright regions in the height band count.
pub(super) fn cylinders(
    regions: &[Region],
    patches: &mut Vec<Patch>,
    (band_m, least_height_m): (&RangeInclusive<f64>, f64),
    options: &CylinderOptions,
    edge_m: f64,
) -> Vec<UprightCylinder> {
    let mut found = Vec::new();
    let upright = |r: &&Region| band_m.contains(&r.at.z) && r.normal.is_none_or(|n| n.z.abs() < 0.7);
    let wide_m = NARROW * 2.0 * options.pillar_m.end();
    let wide: Vec<&Patch> = patches.iter().filter(|p| p.limits_m[0].1 - p.limits_m[0].0 > wide_m).collect();
    let is_loose = |r: &&Region| !wide.iter().any(|p| is_of(p, r, OF_WALL * edge_m));
    let loose = columns(regions.iter().filter(upright).filter(is_loose), edge_m);
    for group in groups(&loose, edge_m) {
        search(&loose, group, false, least_height_m, options, &mut found);
    }
    let all = columns(regions.iter().filter(upright), edge_m);
    for group in groups(&all, edge_m) {
        let mut round = Vec::new();
        search(&all, group, true, least_height_m, options, &mut round);
        let stands_for = |c: &UprightCylinder| patches.iter().filter(|p| is_part(p, c, options)).count();
        round.retain(|c| stands_for(c) >= PLANES);
        found.append(&mut round);
    }
    patches.retain(|p| !found.iter().any(|c| is_part(p, c, options)));
    found
}

/// True if a region lies within `within_m` of a patch, across it and along it.
fn is_of(patch: &Patch, region: &Region, within_m: f64) -> bool {
    let off = region.at - patch.middle;
    let along = off.dot(&patch.along);
    let (from, to) = patch.limits_m[0];
    patch.plane.height_m(&region.at).abs() <= within_m && along >= from - within_m && along <= to + within_m
}

/// True if the centre and both ends of a patch lie on a cylinder, within the tolerance.
fn is_part(patch: &Patch, cylinder: &UprightCylinder, options: &CylinderOptions) -> bool {
    let (from, to) = patch.limits_m[0];
    let sagitta_m = 0.125 * (to - from).powi(2) / cylinder.radius_m;
    let within_m = 2.0 * options.tolerance_m + sagitta_m;
    let off_m = |along: f64| {
        let place = (patch.middle + patch.along * along).xy();
        ((place - cylinder.middle).norm() - cylinder.radius_m).abs()
    };
    sagitta_m < cylinder.radius_m && [from, 0.5 * (from + to), to].iter().all(|a| off_m(*a) <= within_m)
}

/// Cells of the floor plan with at least [`LEVELS`] of the given regions, ordered by cell coordinates.
fn columns<'a>(regions: impl Iterator<Item = &'a Region>, edge_m: f64) -> Vec<Column> {
    type Sums = (Vector3<f64>, Vector2<f64>, f64, u32, (f64, f64));
    let mut squares: FxHashMap<(i32, i32), Sums> = FxHashMap::default();
    for region in regions {
        let key = ((region.at.x / edge_m).floor() as i32, (region.at.y / edge_m).floor() as i32);
        let nothing = (Vector3::zeros(), Vector2::zeros(), 0.0, 0, (f64::INFINITY, f64::NEG_INFINITY));
        let (sum, towards, weight, levels, (low, high)) = squares.entry(key).or_insert(nothing);
        let points = f64::from(region.points);
        *sum += region.at.coords * points;
        *towards += region.towards.xy() * points;
        *weight += points;
        *levels += 1;
        (*low, *high) = (low.min(region.at.z), high.max(region.at.z));
    }
    let mut keyed: Vec<_> = squares.into_iter().filter(|(_, sums)| sums.3 >= LEVELS).collect();
    keyed.sort_unstable_by_key(|(key, _)| *key);
    let column = |(_, (sum, towards, weight, levels, heights_m)): (_, Sums)| Column {
        at: (sum.xy() / weight).into(),
        towards: towards / weight,
        levels,
        heights_m,
    };
    keyed.into_iter().map(column).collect()
}

/// Indices of columns, grouped so that neighbours are at most two cells apart.
fn groups(columns: &[Column], edge_m: f64) -> Vec<Vec<usize>> {
    let square = |c: &Column| ((c.at.x / edge_m).floor() as i32, (c.at.y / edge_m).floor() as i32);
    let mut left: FxHashMap<(i32, i32), usize> = columns.iter().map(square).zip(0..).collect();
    let mut found = Vec::new();
    for (first, column) in columns.iter().enumerate() {
        if left.remove(&square(column)).is_none() {
            continue;
        }
        let mut group = vec![first];
        let mut next = 0;
        while next < group.len() {
            let (x, y) = square(&columns[group[next]]);
            next += 1;
            let around = (-2..=2).flat_map(|i| (-2..=2).map(move |j| (x + i, y + j)));
            group.extend(around.filter_map(|s| left.remove(&s)));
        }
        group.sort_unstable();
        found.push(group);
    }
    found
}

/// Appends the cylinders among a group of columns to `found`, the best supported first.
fn search(
    columns: &[Column],
    mut group: Vec<usize>,
    from_inside: bool,
    least_height_m: f64,
    options: &CylinderOptions,
    found: &mut Vec<UprightCylinder>,
) {
    while let Some(circle) = best(columns, &group, from_inside, options) {
        group.retain(|c| !circle.on.contains(c));
        let cylinder = told(columns, &circle, &group, from_inside, options);
        if cylinder.is_some() {
            // What is blurred before and behind it is of it.
            let miss_m = |c: &usize| (columns[*c].at - circle.middle).norm() - circle.radius_m;
            group.retain(|c| miss_m(c).abs() > BLURRED * options.tolerance_m);
        }
        found.extend(cylinder.filter(|c| c.heights_m.1 - c.heights_m.0 >= least_height_m));
    }
}

/// Circle of a group that most columns support, of a permitted radius; `None` if there is none.
fn best(columns: &[Column], group: &[usize], from_inside: bool, options: &CylinderOptions) -> Option<Circle> {
    let radii = if from_inside { &options.round_wall_m } else { &options.pillar_m };
    let mut draws = Draws::new(group.len() as u64);
    let mut most = (0, None);
    for _ in 0..TRIES.min(group.len().pow(3)) {
        let [a, b, c] = draws.distinct::<3>(group.len())?.map(|i| columns[group[i]].at);
        let Some((middle, radius_m)) = through(&a, &b, &c) else { continue };
        if !radii.contains(&radius_m) {
            continue;
        }
        let on = group.iter().filter(|&&c| is_on(&columns[c], &middle, radius_m, from_inside, options));
        let held: u32 = on.map(|&c| columns[c].levels).sum();
        if held > most.0 {
            most = (held, Some((middle, radius_m)));
        }
    }
    let (mut middle, mut radius_m) = most.1?;
    let mut on = Vec::new();
    for _ in 0..STEPS {
        on = group.to_vec();
        on.retain(|&c| is_on(&columns[c], &middle, radius_m, from_inside, options));
        (middle, radius_m) = least_squares(columns, &on, middle, radius_m)?;
    }
    (on.len() >= 5 && radii.contains(&radius_m)).then_some(Circle { middle, radius_m, on })
}

/// Centre and radius of the circle through three points; `None` if they are nearly collinear.
fn through(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> Option<(Point2<f64>, f64)> {
    let (u, v) = (b - a, c - a);
    let twice = 2.0 * u.perp(&v);
    if twice.abs() < 1e-6 {
        return None;
    }
    let (uu, vv) = (u.norm_squared(), v.norm_squared());
    let to = Vector2::new(v.y * uu - u.y * vv, u.x * vv - v.x * uu) / twice;
    Some((a + to, to.norm()))
}

/// True if a column stands on a circle and was seen from outside, or from inside if `from_inside`.
fn is_on(
    column: &Column,
    middle: &Point2<f64>,
    radius_m: f64,
    from_inside: bool,
    options: &CylinderOptions,
) -> bool {
    let off = column.at - middle;
    let is_outward = off.dot(&column.towards) > 0.0;
    (off.norm() - radius_m).abs() <= options.tolerance_m && is_outward != from_inside
}

/// Centre and radius after one Gauss-Newton step on the distances of columns from a circle; `None` if they do not
/// determine one.
fn least_squares(
    columns: &[Column],
    on: &[usize],
    middle: Point2<f64>,
    radius_m: f64,
) -> Option<(Point2<f64>, f64)> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for column in on.iter().map(|&c| &columns[c]) {
        let off = column.at - middle;
        let length = off.norm();
        let row = (off / length.max(1e-9)).push(1.0);
        normal += row * row.transpose() * f64::from(column.levels);
        right += row * (f64::from(column.levels) * (length - radius_m));
    }
    let step = normal.cholesky()?.solve(&right);
    Some((middle + step.xy(), radius_m + step.z))
}

/// Circle as a cylinder; `None` if too little of it was seen, too much else was seen there, or a square post fits
/// better. `rest`: columns off the circle.
fn told(
    columns: &[Column],
    circle: &Circle,
    rest: &[usize],
    from_inside: bool,
    options: &CylinderOptions,
) -> Option<UprightCylinder> {
    let Circle { middle, radius_m, on } = circle;
    let mut seen = [false; PARTS];
    let (mut square, mut held) = (0.0, 0.0);
    let mut heights_m = (f64::INFINITY, f64::NEG_INFINITY);
    for column in on.iter().map(|&c| &columns[c]) {
        let off = column.at - middle;
        let weight = f64::from(column.levels);
        seen[(off.y.atan2(off.x).rem_euclid(TAU) / PART_RAD) as usize % PARTS] = true;
        square += weight * (off.norm() - radius_m).powi(2);
        held += weight;
        heights_m = (heights_m.0.min(column.heights_m.0), heights_m.1.max(column.heights_m.1));
    }
    // A pillar is solid: what was seen within is against it. Of a round wall only what is seen right before or behind it is.
    let reach_m = BLURRED * options.tolerance_m;
    let is_beside = |c: &Column| {
        let miss_m = (c.at - middle).norm() - radius_m;
        miss_m < reach_m && (!from_inside || miss_m > -reach_m)
    };
    let beside: Vec<Column> = rest.iter().map(|&c| columns[c]).filter(is_beside).collect();
    let against: f64 = beside.iter().map(|c| f64::from(c.levels)).sum();
    let arcs_rad = arcs(&seen);
    let longest_rad = arcs_rad.iter().map(|(from, to)| to - from).fold(0.0, f64::max);
    let share = held / (held + against);
    let least_rad = if from_inside { options.least_round_rad } else { options.least_arc_rad };
    let is_one = longest_rad >= least_rad
        && share >= options.least_share
        && (from_inside || {
            let all: Vec<Column> = on.iter().map(|&c| columns[c]).chain(beside).collect();
            misses_m2(&all, circle, options.tolerance_m) <= post::misses_m2(&all, options.tolerance_m)
        });
    is_one.then(|| UprightCylinder {
        middle: *middle,
        radius_m: *radius_m,
        from_inside,
        heights_m,
        arcs_rad,
        rms_m: (square / held).sqrt(),
        share,
    })
}

/// Mean squared distance of columns from a pillar, square metres; each distance is limited to the tolerance.
fn misses_m2(columns: &[Column], circle: &Circle, tolerance_m: f64) -> f64 {
    let miss_m = |c: &Column| {
        let off = c.at - circle.middle;
        if off.dot(&c.towards) > 0.0 { (off.norm() - circle.radius_m).abs() } else { tolerance_m }
    };
    mean_m2(columns.iter().map(|c| (c, miss_m(c))), tolerance_m)
}

/// Mean of squared distances, weighted by the columns' occupied cells; each distance is limited to the tolerance.
fn mean_m2<'a>(misses: impl Iterator<Item = (&'a Column, f64)>, tolerance_m: f64) -> f64 {
    let (sum, weight) = misses.fold((0.0, 0.0), |(sum, weight), (c, miss_m)| {
        let levels = f64::from(c.levels);
        (sum + levels * miss_m.min(tolerance_m).powi(2), weight + levels)
    });
    sum / f64::max(weight, 1.0)
}

/// Start and end angles of the runs of observed sectors, radians; gaps of one sector are bridged.
fn arcs(seen: &[bool; PARTS]) -> Vec<(f64, f64)> {
    let is_seen = |k: usize| seen[k % PARTS] || (seen[(k + 1) % PARTS] && seen[(k + PARTS - 1) % PARTS]);
    let Some(gap) = (0..PARTS).find(|k| !is_seen(*k)) else { return vec![(0.0, TAU)] };
    let mut found: Vec<(usize, usize)> = Vec::new();
    for k in (gap + 1..gap + PARTS).filter(|k| is_seen(*k)) {
        match found.last_mut() {
            Some(last) if last.1 == k => last.1 = k + 1,
            _ => found.push((k, k + 1)),
        }
    }
    found.into_iter().map(|(from, to)| (from as f64 * PART_RAD, to as f64 * PART_RAD)).collect()
}
