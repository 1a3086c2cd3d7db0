//! Where an object could stand that no view has shown.

use descry_memory::belief::Track;
use descry_memory::space::{Cell, Space};
use descry_perception::nalgebra::{Point3, Vector3};

use crate::situation::KnownSurface;

/// Distance between places where a hidden object may stand.
const GRID_M: f64 = 0.05;
/// How far beyond the seen part of a surface it may go on.
const BEYOND_M: f64 = 0.3;
/// Share of an object's volume that must be unseen for it to stand there unnoticed.
const UNSEEN_SHARE: f64 = 0.6;
/// Share of an object's volume that may have been seen free, for noise, if it stands there.
const FREE_SHARE: f64 = 0.15;
/// So many of the five columns of an object may seem to lie within a solid body where it only stands close to it.
const GRAZED: usize = 2;
/// Share of an object's volume in which something was measured that no object explains, for it to be likely that one stands there.
const MEASURED_SHARE: f64 = 1.0 / 3.0;
/// Share of an object's volume that may have been seen free where so much was measured: from afar a rim is cut off and noise frays
/// what is left.
const FRAYED_SHARE: f64 = 0.5;
/// What goes on so high above an object's foot, in its heights, is not of it; and so near to a wall, in voxels, is the wall. Within
/// a voxel of where walls are taken out of the clouds, everything is.
const ABOVE: f64 = 1.5;
const WALL_BLUR: f64 = 3.0;
/// What is known so well is not taken for two things that blur into each other.
const SURE: f64 = 0.8;
/// An object that is longer than so many diameters of a thing may be more than one where it is not known what it is.
const LARGE: f64 = 2.0;
/// How far above an unseen place the top of a body that fills it is looked for, metres.
const ROOF_M: f64 = 0.5;
/// The columns of an object's volume that are asked for, in diameters from its middle, and the levels, in heights from its foot.
const COLUMNS: [(f64, f64); 5] = [(0.0, 0.0), (0.35, 0.0), (-0.35, 0.0), (0.0, 0.35), (0.0, -0.35)];
const LEVELS: [f64; 3] = [0.25, 0.6, 0.95];

/// Two unit vectors that span a surface.
pub(super) fn across(surface: &KnownSurface) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if surface.up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let first = surface.up.cross(&helper).normalize();
    (first, surface.up.cross(&first))
}

/// Places on a surface where the middle of an object can be; beyond the outline too while that is not all of it.
pub(super) fn grid(surface: &KnownSurface, diameter_m: f64) -> Vec<Point3<f64>> {
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

/// The places that stand for a square of the grid, nearest to its middle first.
pub(super) fn around(surface: &KnownSurface, place: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    const STEPS: [f64; 4] = [-0.125, 0.125, -0.375, 0.375];
    let (e1, e2) = across(surface);
    let place = *place;
    let steps = STEPS.into_iter().flat_map(|a| STEPS.into_iter().map(move |b| (a, b)));
    steps.map(move |(a, b)| place + (e1 * a + e2 * b) * GRID_M)
}

/// An object that could stand at a place unnoticed.
pub(super) struct Unseen {
    /// Its points that no view settled.
    pub points: Vec<Point3<f64>>,
    /// Whether so much was measured there, apart from all objects that are believed in, that something does stand there.
    pub likely: bool,
}

/// An object that stood at a place, if it could stand there unnoticed. What was measured there and belongs to no object that is believed
/// in may be its own; close to one it may as well be that one's.
pub(super) fn unseen_volume(
    surface: &KnownSurface,
    space: &Space,
    standing: &[&Track],
    centre: &Point3<f64>,
    (height_m, diameter_m): (f64, f64),
) -> Option<Unseen> {
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
    ((0..COLUMNS.len()).filter(is_inside).count() <= GRAZED).then_some(Unseen { points: unseen, likely })
}

/// Whether a point lies aside of the round body that was found in what was measured of an object.
fn is_beyond_body(track: &Track, point: &Point3<f64>, up: &Vector3<f64>, margin_m: f64) -> bool {
    let radius_m = track.evidence.radius_m;
    radius_m > 0.0 && (point - track.position_m).cross(up).norm() > radius_m + margin_m
}

/// Whether a measured surface lies over an unseen point, with nothing seen free between: it is within a solid body.
fn is_roofed(space: &Space, point: &Point3<f64>, up: &Vector3<f64>) -> bool {
    let step_m = space.voxel_m();
    let above = (0..(ROOF_M / step_m) as usize).map(|k| space.cell(&(point + up * (k as f64 * step_m))));
    above.into_iter().find(|cell| *cell != Cell::Unseen) == Some(Cell::Occupied)
}

#[cfg(test)]
mod tests {
    use descry_memory::RecordId;
    use descry_perception::Intrinsics;
    use descry_perception::nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use descry_perception::recognise::Evidence;
    use descry_perception::visibility::DepthMap;

    use super::*;

    /// What a camera two metres above a table has seen of a disc of 7 cm at a height: what is below it is unseen.
    fn seen_from_above(disc_m: f64) -> Space {
        let intrinsics = Intrinsics { width: 320, height: 240, fx: 500.0, fy: 500.0, cx: 160.0, cy: 120.0 };
        let depth_m = |n: usize| {
            let (u, v) = ((n % 320) as f64 - 160.0, (n / 320) as f64 - 120.0);
            let above = 2.0 - disc_m;
            if (u * above / 500.0).hypot(v * above / 500.0) < 0.035 { above as f32 } else { 2.0 }
        };
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let world_from_camera = Isometry3::from_parts(Translation3::new(0.0, 0.0, 2.0), down);
        let depths_m = (0..320 * 240).map(depth_m).collect();
        let mut space = Space::default();
        space.integrate(&DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m });
        space
    }

    /// What a camera one metre before a cup has seen of it from the side: a piece of its middle, so high and so wide to either side.
    fn seen_from_the_side(low_m: f64, high_m: f64, aside_m: f64) -> Space {
        let intrinsics = Intrinsics { width: 320, height: 240, fx: 500.0, fy: 500.0, cx: 160.0, cy: 120.0 };
        let depth_m = |n: usize| {
            let (u, v) = ((n % 320) as f64 - 160.0, (n / 320) as f64 - 120.0);
            let (aside, height) = (u / 500.0, 0.05 - v / 500.0);
            let is_seen = aside.abs() < aside_m && height > low_m && height < high_m;
            // From afar noise is as wide as the cup.
            let noise_m = 0.015 * ((n * 7919) % 5) as f64 - 0.03;
            let front_m = (0.035_f64.powi(2) - aside * aside).max(0.0).sqrt();
            if is_seen { (1.0 - front_m + noise_m) as f32 } else { 3.0 }
        };
        // Along +x, with the image's rows downwards.
        let ahead = UnitQuaternion::from_euler_angles(
            -std::f64::consts::FRAC_PI_2,
            0.0,
            -std::f64::consts::FRAC_PI_2,
        );
        let world_from_camera = Isometry3::from_parts(Translation3::new(-1.0, 0.0, 0.05), ahead);
        let depths_m = (0..320 * 240).map(depth_m).collect();
        let mut space = Space::default();
        space.integrate(&DepthMap { intrinsics, camera_from_world: world_from_camera.inverse(), depths_m });
        space
    }

    #[test]
    fn what_is_left_of_a_thing_seen_from_afar_may_be_the_whole() {
        let left = |low_m: f64, high_m: f64, surface: &KnownSurface| {
            let space = seen_from_the_side(low_m, high_m, 0.03);
            unseen_volume(surface, &space, &[], &Point3::origin(), (0.104, 0.07)).map(|hidden| hidden.likely)
        };
        assert_eq!(left(0.0, 0.075, &table()), Some(true), "its rim was cut off");
        assert_eq!(left(0.0, 0.02, &table()), None, "too little is left of it");
        let boundless = KnownSurface { whole: false, ..table() };
        assert_eq!(left(0.0, 0.075, &boundless), None);
    }

    #[test]
    fn what_was_measured_of_a_wall_is_no_thing() {
        let likely = |seen_up_to_m: f64, surface: &KnownSurface| {
            let space = seen_from_the_side(0.0, seen_up_to_m, 0.5);
            unseen_volume(surface, &space, &[], &Point3::origin(), (0.104, 0.07)).map(|hidden| hidden.likely)
        };
        let before_wall = |wall_m: f64| {
            let floor = [(-2.0, -2.0), (wall_m, -2.0), (wall_m, 2.0), (-2.0, 2.0)];
            let floor = floor.map(|(x, y)| Point3::new(x, y, -0.7)).to_vec();
            KnownSurface { floor, ..table() }
        };
        assert_eq!(likely(0.2, &table()), Some(true));
        assert_eq!(likely(0.2, &before_wall(0.01)), Some(false), "a wall stands there");
        assert_eq!(likely(0.11, &before_wall(0.01)), Some(false), "a wall of which little was seen");
        assert_eq!(likely(0.11, &before_wall(0.15)), Some(true), "the wall is too far behind it");
    }

    #[test]
    fn nothing_is_looked_for_in_a_vessel() {
        let hidden = |standing: &[&Track]| {
            let at = Point3::origin();
            unseen_volume(&table(), &Space::default(), standing, &at, (0.104, 0.06)).is_some()
        };
        let known = Track {
            unknown: 0.05,
            kinds: vec![("cup".into(), 0.95)],
            probabilities: vec![("cup B".into(), 0.95)],
            ..disc()
        };
        assert!(hidden(&[]));
        assert!(hidden(&[&disc()]), "of what is not known it may be a part");
        assert!(!hidden(&[&known]));
    }

    fn table() -> KnownSurface {
        let corners = [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)];
        KnownSurface {
            symbol: "table".into(),
            name: "table".into(),
            room: None,
            floor: Vec::new(),
            outline: corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec(),
            up: Vector3::z(),
            whole: true,
            doubtful: None,
            placed: None,
        }
    }

    /// An object of which the disc is the top.
    fn disc() -> Track {
        let round = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 12.0;
            Point3::new(0.04 * angle.cos(), 0.04 * angle.sin(), 0.0)
        };
        Track {
            id: 0,
            on: "table".into(),
            position_m: Point3::origin(),
            position_sigma_m: 0.002,
            size_m: [0.07, 0.07, 0.1],
            footprint_m: (0..12).map(round).collect(),
            probabilities: vec![("cup A".into(), 0.01)],
            kinds: vec![("cup".into(), 0.01)],
            unknown: 0.99,
            seen_fraction: 0.5,
            viewpoints_m: vec![],
            evidence: Evidence::default(),
            cites: vec![RecordId(1)],
            first_ns: 0,
            last_ns: 0,
        }
    }

    #[test]
    fn strips_between_others_may_be_of_one_thing() {
        let likely = |pieces: &[&Track]| {
            let space = seen_from_the_side(0.0, 0.075, 0.03);
            let hidden = unseen_volume(&table(), &space, pieces, &Point3::origin(), (0.104, 0.07));
            hidden.map(|hidden| hidden.likely)
        };
        let piece = |wide_m: f64| {
            let narrow = |p: Point3<f64>| Point3::new(p.x * wide_m / 0.08, p.y, 0.0);
            let footprint_m = disc().footprint_m.into_iter().map(narrow);
            Track { size_m: [0.07, wide_m, 0.1], footprint_m: footprint_m.collect(), ..disc() }
        };
        assert_eq!(likely(&[&piece(0.03)]), Some(true));
        assert_eq!(likely(&[&piece(0.06)]), None, "so much of it was seen that it is known not to be it");
        let known = Track {
            unknown: 0.05,
            kinds: vec![("box".into(), 0.95)],
            probabilities: vec![("box".into(), 0.95)],
            ..piece(0.03)
        };
        assert_eq!(likely(&[&known]), None);
        assert_eq!(likely(&[&Track { size_m: [0.07, 0.03, 0.16], ..piece(0.03) }]), None, "higher than it");
        assert_eq!(likely(&[&Track { size_m: [0.12, 0.03, 0.1], ..piece(0.03) }]), None, "longer");
    }

    /// Whether a cup of 7 cm may stand unnoticed under what was seen.
    fn check(disc_m: f64, cup_m: f64, standing: &[&Track], expected: bool) {
        let hidden =
            unseen_volume(&table(), &seen_from_above(disc_m), standing, &Point3::origin(), (cup_m, 0.07));
        assert_eq!(hidden.is_some(), expected, "disc at {disc_m} m, {} objects", standing.len());
    }

    #[test]
    fn what_was_measured_and_no_object_explains_is_likely_something() {
        let likely = |disc_m: f64, standing: &[&Track]| {
            let space = seen_from_above(disc_m);
            let hidden = unseen_volume(&table(), &space, standing, &Point3::origin(), (0.104, 0.07));
            hidden.map(|hidden| hidden.likely)
        };
        assert_eq!(likely(0.104, &[]), Some(true));
        assert_eq!(likely(0.20, &[]), Some(false), "it stands below what was measured");
        assert_eq!(likely(0.104, &[&disc()]), None);
    }

    #[test]
    fn what_is_one_piece_with_something_larger_may_be_it() {
        let likely = |disc_m: f64, piece: &Track| {
            let space = seen_from_above(disc_m);
            let hidden = unseen_volume(&table(), &space, &[piece], &Point3::origin(), (0.104, 0.07));
            hidden.map(|hidden| hidden.likely)
        };
        let wide = |scale: f64| {
            let footprint_m = disc().footprint_m.iter().map(|p| p * scale).collect();
            Track { size_m: [0.07 * scale, 0.07, 0.3], footprint_m, ..disc() }
        };
        assert_eq!(likely(0.104, &wide(4.0)), Some(true), "a cup beside a box, both seen as one thing");
        assert_eq!(likely(0.20, &wide(4.0)), None, "the place is below the box");
        assert_eq!(likely(0.104, &wide(1.5)), None, "hardly larger than a cup");
        let known = Track {
            unknown: 0.05,
            kinds: vec![("tray".into(), 0.95)],
            probabilities: vec![("tray".into(), 0.95)],
            ..wide(4.0)
        };
        assert_eq!(likely(0.104, &known), None, "it is known what it is");
        let beside = |aside_m: f64| {
            let evidence = Evidence { radius_m: 0.05, ..Evidence::default() };
            Track { position_m: Point3::new(aside_m, 0.0, 0.0), evidence, ..known.clone() }
        };
        assert_eq!(
            likely(0.104, &beside(0.1)),
            Some(true),
            "a cup beside a known cylinder, seen as one thing"
        );
        assert_eq!(likely(0.104, &beside(0.02)), None, "it is of the cylinder");
    }

    #[test]
    fn a_rim_that_no_object_explains_may_be_its_own() {
        check(0.104, 0.104, &[], true);
        check(0.104, 0.104, &[&disc()], false);
        // What stands under a roof that is an object stands within a solid body.
        check(0.20, 0.104, &[&disc()], false);
        check(0.0, 0.104, &[], false);
    }
}
