//! Level surfaces in rooms with tables, and the distinction of floor and table, seen by a
//! time-of-flight camera: noise grows with depth, some returns are missing, and edges have mixed
//! pixels.

use crate::tabletop::pile::Pile;
use crate::tabletop::{Draws, TABLE_M};
use descry_perception::nalgebra::{
    Isometry3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::{
    Region, Role, Sign, Surface, SurfaceError, SurfaceOptions, find_surface, find_surfaces,
};
use descry_perception::{Cloud, Intrinsics, Scene, View, Visibility};

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 270.0, fy: 270.0, cx: 159.5, cy: 119.5 };
/// Share of the pixels without a return.
const HOLES: f64 = 0.03;

/// Lowest and highest corner, metres.
type Block = ([f64; 3], [f64; 3]);

const fn top(x: [f64; 2], y: [f64; 2], z: f64) -> Block {
    ([x[0], y[0], z - 0.03], [x[1], y[1], z])
}

fn thing(x: f64, y: f64, z: f64, size: [f64; 3]) -> Block {
    let half = [size[0] / 2.0, size[1] / 2.0];
    ([x - half[0], y - half[1], z], [x + half[0], y + half[1], z + size[2]])
}

/// A top on four legs.
fn table(x: [f64; 2], y: [f64; 2], z: f64) -> Vec<Block> {
    let leg = |x: f64, y: f64| ([x - 0.03, y - 0.03, 0.0], [x + 0.03, y + 0.03, z - 0.03]);
    let ends = |[low, high]: [f64; 2]| [low + 0.05, high - 0.05];
    let legs = ends(x).into_iter().flat_map(|x| ends(y).map(|y| leg(x, y)));
    legs.chain([top(x, y, z)]).collect()
}

const FLOOR: Block = ([-6.0, -6.0, -0.1], [6.0, 6.0, 0.0]);
const WALL: Block = ([-6.0, 0.5, 0.0], [6.0, 0.6, 2.6]);

fn room(parts: &[&[Block]]) -> Vec<Block> {
    parts.concat()
}

/// Depth along a ray, in units of the ray, at which the ray enters a block.
fn enters(block: &Block, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let (mut enter, mut leave) = (0.05, f64::INFINITY);
    for k in 0..3 {
        let (a, b) = ((block.0[k] - eye[k]) / ray[k], (block.1[k] - eye[k]) / ray[k]);
        enter = f64::max(enter, a.min(b));
        leave = f64::min(leave, a.max(b));
    }
    (enter < leave).then_some(enter)
}

fn pose(eye: [f64; 3], target: [f64; 3]) -> Isometry3<f64> {
    let eye = Point3::from(eye);
    let forward = (Point3::from(target) - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let turn = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&turn))
}

/// View of a camera; a share of the pixels that hit the floor shows mirror images.
fn look(room: &[Block], world_from_camera: Isometry3<f64>, mirrored: f64, draws: &mut Draws) -> View {
    let eye = Point3::from(world_from_camera.translation.vector);
    let depth = |u: f64, v: f64| {
        let ray = world_from_camera.rotation * CAMERA.unproject(u, v, 1.0).coords;
        let hits = room.iter().filter_map(|block| enters(block, &eye, &ray));
        (hits.fold(f64::INFINITY, f64::min), ray)
    };
    let depths: Vec<f32> = (0..CAMERA.width * CAMERA.height)
        .map(|i| {
            let (u, v) = ((i % CAMERA.width) as f64, (i / CAMERA.width) as f64);
            let (near, ray) = depth(u, v);
            let (beside, _) = depth(u + 0.7, v + 0.2);
            let mixed = if draws.next() < 0.3 { 0.5 * (near + beside) } else { near };
            let on_floor = (eye.z + mixed * ray.z).abs() < 0.01;
            let mirror = if on_floor && draws.next() < mirrored { 1.5 } else { 1.0 };
            let measured = mixed * mirror * (1.0 + 0.002 * draws.normal()) + 0.001 * draws.normal();
            if draws.next() < HOLES || measured > 6.0 { f32::NAN } else { measured as f32 }
        })
        .collect();
    View {
        stamp_ns: 0,
        cloud: CAMERA.cloud_from_depth(&depths).expect("the camera is sound"),
        intrinsics: Some(CAMERA),
        world_from_camera,
        pose_sigma_m: 0.0,
        pose_sigma_rad: 0.0,
    }
}

/// Views from several places at a target, in the world.
struct Looks<'a> {
    room: &'a [Block],
    eyes: &'a [[f64; 3]],
    target: [f64; 3],
    mirrored: f64,
}

impl Looks<'_> {
    fn take(&self, seed: u64) -> (Cloud, Visibility) {
        let mut draws = Draws(seed);
        let look = |eye: &[f64; 3]| look(self.room, pose(*eye, self.target), self.mirrored, &mut draws);
        let views: Vec<View> = self.eyes.iter().map(look).collect();
        let mut cloud = Cloud::default();
        views.iter().for_each(|v| cloud.append(&v.cloud.finite().transformed(&v.world_from_camera)));
        (cloud, Visibility::from_views(&views))
    }
}

const AROUND: [[f64; 3]; 3] = [[1.9, -0.9, 1.35], [-1.7, -1.2, 1.3], [0.2, -2.2, 1.4]];

/// The expected best surface.
#[derive(Debug)]
enum Best {
    Table { height_m: f64, above_floor: bool },
    Untold,
    OnlyFloor,
}

fn is_as_expected(expected: &Best, found: &Result<Surface, SurfaceError>) -> bool {
    match (expected, found) {
        (Best::Table { height_m, above_floor }, Ok(s)) => {
            let floor = s.above_floor_m.is_some_and(|h| (h - height_m).abs() < 0.03);
            s.role == Role::Support && (s.offset_m - height_m).abs() < 0.015 && floor == *above_floor
        }
        (Best::Untold, Ok(s)) => s.role == Role::Untold && matches!(s.because, Sign::NoEdge { .. }),
        (Best::OnlyFloor, Err(SurfaceError::OnlyFloor { .. })) => true,
        _ => false,
    }
}

#[test]
fn the_floor_is_never_a_table() {
    let small = table([-0.5, 0.5], [-0.3, 0.3], 0.72);
    let things = [thing(0.1, 0.0, 0.72, [0.08, 0.08, 0.12]), thing(-0.2, 0.1, 0.72, [0.2, 0.14, 0.25])];
    let on_floor = [thing(0.2, 0.1, 0.0, [0.3, 0.2, 0.25]), thing(-0.4, 0.2, 0.0, [0.2, 0.2, 0.3])];
    let carton = [thing(-0.1, 0.0, 0.72, [0.34, 0.26, 0.06])];
    let set = room(&[&[FLOOR], &small, &things]);
    let by_wall = room(&[&[FLOOR, WALL], &small, &things]);
    let (empty, bare) = (small_room(), room(&[&[FLOOR], &on_floor]));
    let flat = room(&[&[FLOOR], &small, &carton]);
    let desk = room(&[&[top([-2.0, 2.0], [-2.0, 2.0], 0.72)], &things]);
    let seen = |room, eyes, target| Looks { room, eyes, target, mirrored: 0.0 };
    let table = |above_floor| Best::Table { height_m: 0.72, above_floor };
    let middle = [0.0, 0.0, 0.7];
    let cases = [
        ("a table seen from three places", seen(&set, &AROUND, middle), table(true)),
        ("a table from one place", seen(&set, &AROUND[..1], middle), table(true)),
        ("a table far off", seen(&set, &[[3.0, -1.0, 1.5]], middle), table(true)),
        ("an empty table", seen(&empty, &AROUND, middle), table(true)),
        ("a table at a wall", seen(&by_wall, &AROUND, middle), table(true)),
        ("a table with a flat box", seen(&flat, &AROUND, middle), table(true)),
        ("a mirroring floor", Looks { mirrored: 0.1, ..seen(&set, &AROUND, middle) }, table(true)),
        ("a floor with boxes", seen(&bare, &[[1.6, -1.2, 1.3]], [0.0, 0.3, 0.0]), Best::OnlyFloor),
        (
            "a mirroring floor with boxes",
            Looks { mirrored: 0.1, ..seen(&bare, &[[1.6, -1.2, 1.3]], [0.0, 0.3, 0.0]) },
            Best::OnlyFloor,
        ),
        ("a small piece of floor", seen(&bare, &[[0.0, -0.4, 0.9]], [0.0, 0.1, 0.0]), Best::Untold),
        ("a table that fills the view", seen(&desk, &[[0.0, -0.6, 1.3]], middle), Best::Untold),
    ];
    for (what, looks, expected) in &cases {
        for (seed, up) in [(1, None), (2, Some(Vector3::z_axis())), (3, None)] {
            let (cloud, visibility) = looks.take(seed);
            let options = SurfaceOptions { up, ..SurfaceOptions::default() };
            let found = find_surface(&cloud, &visibility, &options);
            assert!(is_as_expected(expected, &found), "{what}, seed {seed}: {expected:?}, found {found:?}");
        }
    }
    // The map tells what the view does not.
    let (cloud, visibility) = cases[cases.len() - 1].1.take(1);
    let options = SurfaceOptions { height_band_m: Some((0.6, 0.85)), ..SurfaceOptions::default() };
    let told = find_surface(&cloud, &visibility, &options).expect("a table");
    assert_eq!((told.role, told.because), (Role::Support, Sign::Asked));
}

/// Number of separate objects; a sparse one may be in pieces.
fn things(scene: &Scene) -> usize {
    let mut apart: Vec<Point3<f64>> = Vec::new();
    for segment in &scene.segments {
        let first = segment.points[0];
        if apart.iter().all(|p| (p - first).norm() > 0.25) {
            apart.push(first);
        }
    }
    apart.len()
}

fn bounds(scene: &Scene) -> Vec<([f64; 3], [f64; 3], usize)> {
    let of = |s: &descry_perception::segment::Segment| {
        let end = |pick: fn(f64, f64) -> f64| {
            s.points.iter().fold(None, |end: Option<[f64; 3]>, p| {
                let p: [f64; 3] = (scene.surface.surface_from_world.inverse() * p).coords.into();
                Some(end.map_or(p, |e| [0, 1, 2].map(|k| pick(e[k], p[k]))))
            })
        };
        (end(f64::min).unwrap_or_default(), end(f64::max).unwrap_or_default(), s.points.len())
    };
    scene.segments.iter().map(of).collect()
}

fn small_room() -> Vec<Block> {
    room(&[&[FLOOR], &table([-0.5, 0.5], [-0.3, 0.3], 0.72)])
}

fn region(x: [f64; 2], y: [f64; 2]) -> Region {
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    Region { corners: corners.map(|[x, y]| Point3::new(x, y, 0.0)).into(), margin_m: 0.08 }
}

#[test]
fn one_table_among_several_is_found_where_the_map_has_it() {
    let large = ([-1.2, 0.2], [-0.4, 0.4]);
    let up = Some(Unit::new_normalize(Vector3::z()));
    // (what, the other table's place and height)
    let others = [
        ("of the same height", [0.7, 1.3], 0.72),
        ("a centimetre higher", [0.7, 1.3], 0.73),
        ("much lower", [0.7, 1.3], 0.45),
        ("standing at it", [0.2, 0.8], 0.72),
    ];
    for (what, x, z) in others {
        let y = [-0.3, 0.3];
        let set = [thing(-0.6, 0.0, 0.72, [0.1, 0.1, 0.15]), thing(x[0] + 0.3, 0.0, z, [0.08, 0.08, 0.1])];
        let room = room(&[&[FLOOR], &table(large.0, large.1, 0.72), &table(x, y, z), &set]);
        let eyes = [[1.9, -1.4, 1.35], [-1.7, -1.5, 1.3], [0.2, 2.0, 1.4]];
        let (cloud, seen) =
            Looks { room: &room, eyes: &eyes, target: [0.1, 0.0, 0.6], mirrored: 0.0 }.take(5);
        for (asked, height_m, middle) in
            [(region(large.0, large.1), 0.72, -0.5), (region(x, y), z, x[0] + 0.3)]
        {
            let surface = SurfaceOptions { up, region: Some(asked), ..SurfaceOptions::default() };
            let scene = segment(&cloud, &seen, &SceneOptions { surface, ..SceneOptions::default() })
                .unwrap_or_else(|why| panic!("the other {what}: {why}"));
            let found = &scene.surface;
            let ends = found.hull.iter().map(|p| p.x);
            let (low, high) = (ends.clone().fold(9.0, f64::min), ends.fold(-9.0, f64::max));
            let off = (0.5 * (low + high) - middle).abs();
            assert!((found.offset_m - height_m).abs() < 0.01 && off < 0.12, "the other {what}: {found:?}");
            assert_eq!(things(&scene), 1, "the other {what}: things at {middle}: {:?}", bounds(&scene));
        }
    }
    // Nothing is where nothing stands.
    let (cloud, seen) =
        Looks { room: &small_room(), eyes: &AROUND, target: [0.0, 0.0, 0.7], mirrored: 0.0 }.take(5);
    let options = SurfaceOptions {
        up,
        region: Some(region([2.0, 2.6], [-0.3, 0.3])),
        height_band_m: Some((0.6, 0.85)),
        ..SurfaceOptions::default()
    };
    let found = find_surface(&cloud, &seen, &options);
    assert!(matches!(found, Err(SurfaceError::NotFound { .. })), "{found:?}");
}

#[test]
fn what_lies_on_a_shelf_above_is_not_on_the_table() {
    let shelf = [top([-0.5, 0.5], [0.05, 0.35], 1.12), thing(0.1, 0.15, 1.12, [0.1, 0.1, 0.12])];
    let cup = [thing(0.2, -0.2, 0.72, [0.08, 0.08, 0.1])];
    let room = room(&[&[FLOOR, WALL], &table([-0.7, 0.7], [-0.4, 0.4], 0.72), &shelf, &cup]);
    let eyes = [[0.9, -1.4, 1.75], [-0.7, -1.5, 1.7], [0.1, -1.6, 1.3]];
    let (cloud, seen) = Looks { room: &room, eyes: &eyes, target: [0.0, 0.0, 0.8], mirrored: 0.0 }.take(2);
    let up = Some(Unit::new_normalize(Vector3::z()));
    // A far corner of the board that hardly returned anything is no thing.
    for (band, height_m) in [((0.6, 0.85), 0.72), ((1.0, 1.2), 1.12)] {
        let surface = SurfaceOptions { up, height_band_m: Some(band), ..SurfaceOptions::default() };
        let all = find_surfaces(&cloud, &seen, &surface).expect("a table and a shelf");
        let roles: Vec<_> = all.iter().map(|s| (s.offset_m, s.role, s.because.to_string())).collect();
        assert_eq!(all.iter().filter(|s| s.role == Role::Support).count(), 2, "{roles:?}");
        let scene =
            segment(&cloud, &seen, &SceneOptions { surface, fewest_points: 300, ..SceneOptions::default() })
                .expect("a table");
        assert!((scene.surface.offset_m - height_m).abs() < 0.01);
        assert_eq!(things(&scene), 1, "at {height_m} m: {:?}", bounds(&scene));
    }
}

#[test]
fn what_hides_a_table_stands_on_it() {
    for seed in 10_001..=10_012 {
        let mut draws = Draws(seed);
        let view = Pile::drawn(&mut draws).look(&mut draws);
        let cloud = view.cloud.transformed(&view.world_from_camera);
        let seen = Visibility::from_views(std::slice::from_ref(&view));
        let scene = segment(&cloud, &seen, &SceneOptions::default()).expect("a table");
        let off_m = scene.surface.middle().z - TABLE_M;
        assert!(off_m.abs() < 0.01, "seed {seed}: {off_m} m off the table");
        let is_thing = |label: &u32| *label >= 20;
        let labels = view.cloud.labels.unwrap_or_default();
        let held = scene.segments.iter().flat_map(|s| &s.indices).filter(|i| is_thing(&labels[**i as usize]));
        let share = held.count() as f64 / labels.iter().filter(|label| is_thing(label)).count() as f64;
        assert!(share > 0.9, "seed {seed}: {share} of the returns of things");
    }
}

#[test]
fn a_tilted_surface_has_its_height_where_it_is() {
    let up = Some(Unit::new_normalize(Vector3::z()));
    let looks = Looks { room: &small_room(), eyes: &AROUND, target: [0.0, 0.0, 0.7], mirrored: 0.0 };
    let (cloud, seen) = looks.take(5);
    let level = find_surface(&cloud, &seen, &SurfaceOptions { up, ..SurfaceOptions::default() });
    let level = level.expect("a table");
    let options =
        SurfaceOptions { up, height_band_m: Some((0.64, 0.80)), region: None, ..SurfaceOptions::default() };
    let far = Translation3::new(4.0, 3.0, 0.0);
    // (tilt about its middle, how much higher, whether it lies between the heights)
    for (tilt_rad, higher_m, expected) in
        [(0.0, 0.0, true), (0.07, 0.0, true), (-0.07, 0.0, true), (0.03, 0.12, false), (-0.03, 0.12, false)]
    {
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt_rad);
        let up_there = Translation3::new(0.0, 0.0, 0.72 + higher_m);
        let there = Isometry3::from_parts(far * up_there, tilt) * Translation3::new(0.0, 0.0, -0.72);
        let found = options.wants(&level.moved(&there));
        assert_eq!(found, expected, "tilted by {tilt_rad}, {higher_m} m higher");
    }
}

#[test]
fn a_wide_plane_that_is_seen_sparsely_is_one() {
    // Ten metres by ten, a point every ten centimetres.
    let at = |k: usize| Point3::new((k % 100) as f32 * 0.1, (k / 100) as f32 * 0.1, 0.0);
    let cloud = Cloud::from_points((0..10_000).map(at).collect());
    let options = SurfaceOptions { up: Some(Vector3::z_axis()), ..SurfaceOptions::default() };
    let found = find_surfaces(&cloud, &Visibility::default(), &options).expect("a surface");
    let areas_m2: Vec<f64> = found.iter().map(|surface| surface.area_m2).collect();
    assert!(areas_m2.len() == 1 && (90.0..110.0).contains(&areas_m2[0]), "{areas_m2:?}");
}

#[test]
fn where_nobody_says_it_up_is_told_by_what_is_seen_or_not_at_all() {
    let cup = |x: f64, y: f64| thing(x, y, 0.72, [0.08, 0.08, 0.11]);
    let things =
        [cup(0.1, 0.0), cup(-0.15, 0.08), cup(-0.05, -0.15), thing(0.2, 0.15, 0.72, [0.1, 0.06, 0.2])];
    let set = room(&[&[FLOOR, WALL], &table([-0.5, 0.5], [-0.3, 0.3], 0.72), &things]);
    // The front of a cupboard, with its knobs.
    let knobs = [-0.4, 0.0, 0.4].map(|x| ([x, -0.03, 1.0], [x + 0.02, 0.0, 1.1]));
    let front = room(&[&[FLOOR, ([-1.5, 0.0, 0.0], [1.5, 0.6, 2.4])], &knobs]);
    let quarter = std::f64::consts::FRAC_PI_2;
    let (aslant, above, ahead) = ([0.3, -1.2, 1.5], [0.0, -0.06, 1.7], [0.0, -1.0, 1.1]);
    // (what, room, from where to where, turned by, whether the table must be found; otherwise it may be)
    let cases = [
        ("as cameras are held", &set, aslant, [0.0, 0.0, 0.7], 0.0, true),
        ("rolled by 15°", &set, aslant, [0.0, 0.0, 0.7], 0.26, true),
        ("from straight above", &set, above, [0.0, 0.0, 0.7], 0.0, true),
        ("from straight above, turned", &set, above, [0.0, 0.0, 0.7], 1.0, true),
        ("on its side", &set, aslant, [0.0, 0.0, 0.7], quarter, false),
        ("on its other side", &set, aslant, [0.0, 0.0, 0.7], -quarter, false),
        ("upside down", &set, aslant, [0.0, 0.0, 0.7], 2.0 * quarter, false),
        ("a front", &front, ahead, [0.0, 0.0, 1.1], 0.0, false),
        ("a front, turned", &front, ahead, [0.0, 0.0, 1.1], quarter, false),
    ];
    for (what, room, eye, target, rolled_rad, must) in cases {
        for seed in 1..=3 {
            let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rolled_rad);
            let view = look(room, pose(eye, target) * roll, 0.0, &mut Draws(seed));
            let cloud = view.cloud.transformed(&view.world_from_camera);
            let seen = Visibility::from_views(std::slice::from_ref(&view));
            let found = find_surface(&cloud, &seen, &SurfaceOptions::default());
            let is_right = match &found {
                Ok(s) => s.up.z > 0.99 && (s.offset_m - 0.72).abs() < 0.015,
                Err(SurfaceError::UpUntold) => !must,
                Err(_) => false,
            };
            assert!(is_right, "{what}, seed {seed}: {found:?}");
        }
    }
}

#[test]
fn a_ball_has_no_table() {
    // As much of it as is seen from two radii above.
    let at = |k: usize| {
        let (turn, high) = (2.4 * k as f64, 1.0 - 0.5 * k as f64 / 40_000.0);
        let wide = (1.0 - high * high).sqrt();
        Point3::new((wide * turn.cos()) as f32, (wide * turn.sin()) as f32, high as f32)
    };
    let cloud = Cloud::from_points((0..40_000).map(at).collect());
    for eye in [Point3::new(0.0, 0.0, 2.0), Point3::new(0.6, 0.0, 2.0)] {
        let seen = Visibility::from_viewpoints(&cloud, &[eye]);
        let found = find_surface(&cloud, &seen, &SurfaceOptions::default());
        assert!(matches!(found, Err(SurfaceError::UpUntold)), "{found:?}");
    }
}
