//! Unobserved places where an object could stand unnoticed.

use descry_memory::belief::Track;
use descry_memory::space::{Cell, Space};
use descry_perception::nalgebra::{Point3, Vector3};

use crate::surface::KnownSurface;

/// Spacing of the places where a hidden object may stand, metres.
const GRID_M: f64 = 0.05;
/// Margin beyond the seen part of a surface in which the surface may continue, metres.
const BEYOND_M: f64 = 0.3;
/// Minimum unobserved share of an object's volume for the object to stand there unnoticed.
const UNSEEN_SHARE: f64 = 0.6;
/// Maximum share of an object's volume that noise may have shown free although the object stands
/// there.
const FREE_SHARE: f64 = 0.15;
/// Maximum number of an object's five sample columns inside a solid body that count as errors, for
/// an object close to it.
const GRAZED: usize = 2;
/// Minimum share of an object's volume with unexplained measurements that makes an object there
/// likely.
const MEASURED_SHARE: f64 = 1.0 / 3.0;
/// Maximum free share of an object's volume at such measurements: from afar, rims are cut off and
/// noise frays the rest.
const FRAYED_SHARE: f64 = 0.5;
/// Height above which a measured column is too high to belong to an object, in heights of the object
/// from its foot.
const ABOVE: f64 = 1.5;
/// Distance from a wall, in voxels, within which a column that is measured even above the object belongs
/// to the wall; within one voxel, every column does.
const WALL_BLUR: f64 = 3.0;
/// Minimum certainty of an identified object for the object not to be the blur of two.
const SURE: f64 = 0.8;
/// Length, in diameters of the requested object, above which an unidentified object may be several.
const LARGE: f64 = 2.0;
/// Height range above an unseen point in which the top of a solid body is sought, metres.
const ROOF_M: f64 = 0.5;
/// Sample columns of an object's volume: offsets from the axis, in diameters.
const COLUMNS: [(f64, f64); 5] = [(0.0, 0.0), (0.35, 0.0), (-0.35, 0.0), (0.0, 0.35), (0.0, -0.35)];
/// Levels of the samples in each column, in heights of the object from its foot.
const LEVELS: [f64; 3] = [0.25, 0.6, 0.95];

/// Two orthogonal unit vectors that span a surface.
pub(super) fn across(surface: &KnownSurface) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if surface.up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let first = surface.up.cross(&helper).normalize();
    (first, surface.up.cross(&first))
}

/// Grid of possible object centres on a surface; extends beyond the outline while that is
/// incomplete.
pub(crate) fn grid(surface: &KnownSurface, diameter_m: f64) -> Vec<Point3<f64>> {
    let Some(centre) = surface.centre() else { return Vec::new() };
    let (e1, e2) = across(surface);
    let margin = if surface.whole { -diameter_m / 2.0 } else { BEYOND_M };
    let reach = surface.outline.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max) + margin.max(0.0);
    let steps = (reach / GRID_M).ceil() as i64;
    let place = |i: i64, j: i64| centre + (e1 * i as f64 + e2 * j as f64) * GRID_M;
    (-steps..=steps)
        .flat_map(|i| (-steps..=steps).map(move |j| (i, j)))
        .map(|(i, j)| place(i, j))
        .filter(|p| surface.covers(p, margin))
        .collect()
}

/// Sample points of the grid cell around a place, beginning near its centre.
pub(crate) fn around(surface: &KnownSurface, place: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    const STEPS: [f64; 4] = [-0.125, 0.125, -0.375, 0.375];
    let (e1, e2) = across(surface);
    let place = *place;
    let steps = STEPS.into_iter().flat_map(|a| STEPS.into_iter().map(move |b| (a, b)));
    steps.map(move |(a, b)| place + (e1 * a + e2 * b) * GRID_M)
}

/// Object that could stand unnoticed at a place.
pub struct Unnoticed {
    /// Unobserved points of the volume.
    pub points: Vec<Point3<f64>>,
    /// True if unexplained measurements make an object there likely.
    pub likely: bool,
}

/// Unobserved volume of an object (height, diameter) at a place, if the object could stand there
/// unnoticed. Measurements that no believed object explains may belong to the unnoticed one; those close
/// to a believed object may belong to that one.
pub fn unseen_volume(
    surface: &KnownSurface,
    space: &Space,
    standing: &[&Track],
    centre: &Point3<f64>,
    (height_m, diameter_m): (f64, f64),
) -> Option<Unnoticed> {
    let all = (COLUMNS.len() * LEVELS.len()) as f64;
    let (e1, e2) = across(surface);
    let column = |(a, b): (f64, f64)| centre + (e1 * a + e2 * b) * diameter_m;
    let cells = COLUMNS.map(|at| {
        LEVELS.map(|level| {
            let point = column(at) + surface.up * (height_m * level);
            (point, space.cell(&point))
        })
    });
    let free = cells.as_flattened().iter().filter(|(_, cell)| *cell == Cell::Free).count() as f64;
    if free > FRAYED_SHARE * all {
        return None;
    }
    let above = |at| column(at) + surface.up * (height_m * ABOVE);
    let margin_m = space.voxel_m() / 2.0;
    let is_of = |track: &Track, at| surface.is_of(track, &column(at), margin_m);
    let is_known = |track: &Track| track.certainty() >= SURE && track.label().is_some();
    let is_beyond = |track: &Track, at| is_beyond_body(track, &column(at), &surface.up, margin_m);
    // A thing that touches another may have been seen as one piece with it, and of one between others no more than strips. What is
    // measured above a place is not of the thing.
    let long_m = |track: &Track| track.size_m[0].max(track.size_m[1]);
    let is_strip = |track: &Track| {
        let top_m = (track.position_m - centre).dot(&surface.up) + track.size_m[2];
        !is_known(track)
            && track.size_m[0].min(track.size_m[1]) < diameter_m / 2.0
            && long_m(track) < diameter_m + margin_m
            && top_m < height_m + margin_m
    };
    let is_part = |track: &Track, at| {
        let is_large = long_m(track) > LARGE * diameter_m;
        let may_be = is_strip(track) || is_large && (!is_known(track) || is_beyond(track, at));
        may_be && !is_roofed(space, &above(at), &surface.up)
    };
    let explained = COLUMNS.map(|at| standing.iter().any(|track| is_of(track, at) && !is_part(track, at)));
    // Nothing is looked for in a vessel.
    let fills = |track: &Track| COLUMNS.iter().all(|&at| is_of(track, at) && !is_part(track, at));
    if standing.iter().any(|track| is_known(track) && fills(track)) {
        return None;
    }
    let mut unseen = Vec::new();
    let mut measured = 0.0;
    for (n, &at) in COLUMNS.iter().enumerate() {
        let above = above(at);
        let is_wall = surface.is_of_wall(&above, space.voxel_m())
            || surface.is_of_wall(&above, WALL_BLUR * space.voxel_m()) && space.cell(&above) != Cell::Free;
        for (point, cell) in cells[n] {
            match cell {
                Cell::Unseen => unseen.push(point),
                Cell::Occupied if !explained[n] => {
                    measured += if is_wall { 0.0 } else { 1.0 };
                    unseen.push(point);
                }
                Cell::Occupied | Cell::Free => {}
            }
        }
    }
    // Where no map knows how far it goes, it may be another surface.
    let likely = surface.whole && measured >= MEASURED_SHARE * all && !explained.contains(&true);
    let (most_free, least_unseen) =
        if likely { (FRAYED_SHARE, 1.0 - FRAYED_SHARE) } else { (FREE_SHARE, UNSEEN_SHARE) };
    if free > most_free * all || (unseen.len() as f64) < least_unseen * all {
        return None;
    }
    let is_inside = |&n: &usize| {
        let top = column(COLUMNS[n]) + surface.up * height_m;
        explained[n] && is_roofed(space, &top, &surface.up)
    };
    ((0..COLUMNS.len()).filter(is_inside).count() <= GRAZED).then_some(Unnoticed { points: unseen, likely })
}

/// True if a point lies outside the round body fitted to an object; false if none was fitted.
fn is_beyond_body(track: &Track, point: &Point3<f64>, up: &Vector3<f64>, margin_m: f64) -> bool {
    let radius_m = track.evidence.radius_m;
    radius_m > 0.0 && (point - track.position_m).cross(up).norm() > radius_m + margin_m
}

/// True if a measured surface lies above an unseen point without free space in between, so that the
/// point is inside a solid body.
fn is_roofed(space: &Space, point: &Point3<f64>, up: &Vector3<f64>) -> bool {
    let step_m = space.voxel_m();
    let above = (0..(ROOF_M / step_m) as usize).map(|k| space.cell(&(point + up * (k as f64 * step_m))));
    above.into_iter().find(|cell| *cell != Cell::Unseen) == Some(Cell::Occupied)
}
