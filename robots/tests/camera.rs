//! The simulated camera: ideal frames compared with the geometry of the scene, noisy ones with published
//! figures.

use descry_robots::head;
use descry_robots::nalgebra::{Isometry3, Point3};
use descry_robots::perception::Intrinsics;
use descry_robots::sim::frame::Frame;
use descry_robots::sim::noise::{DepthNoise, observe};
use descry_robots::sim::render::{render, visible_share};
use descry_robots::sim::shape::Shape;
use descry_robots::sim::world::{LABEL_OBJECT, LABEL_ROOM};
use descry_robots::sim::{Object, Scene, SceneSpec, Stand, arrange, body};
use descry_robots::{Pose2, sim};

const SCENE: &str = r#"
[[surface]]
name = "table"
size_m = [1.2, 0.8]
height_m = 0.72
yaw_deg = 20.0
[[obstacle]]
name = "stool"
position_m = [1.2, 1.2]
yaw_deg = 30.0
size_m = [0.4, 0.3, 0.5]
[start]
position_m = [-2.0, 0.0]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.09, base_diameter_m = 0.06, height_m = 0.12 }
[[object]]
name = "mug"
shape.mug = { diameter_m = 0.08, height_m = 0.095 }
[[object]]
name = "cone"
shape.cylinder = { diameter_m = 0.12, top_diameter_m = 0.04, height_m = 0.2 }
[[object]]
name = "canister"
shape.canister = { diameter_m = 0.09, height_m = 0.13, lid_diameter_m = 0.1, lid_height_m = 0.02 }
[[object]]
name = "box"
shape.box = { size_m = [0.2, 0.1, 0.15] }
"#;

fn scene(seed: u64) -> Scene {
    arrange(&SceneSpec::parse("scene.toml", SCENE).unwrap(), seed).unwrap()
}

/// Pose of the camera on a ring around the table, looking at its centre.
fn camera_pose(angle_rad: f64, radius_m: f64) -> Isometry3<f64> {
    let pose = Pose2::facing(radius_m * angle_rad.cos(), radius_m * angle_rad.sin(), &[0.0, 0.0].into());
    let head = body::HEAD;
    head::camera_towards(&head, &pose.isometry(), Some(&Point3::new(0.0, 0.0, 0.75)))
}

fn small_camera() -> Intrinsics {
    let c = body::intrinsics();
    Intrinsics { width: 160, height: 120, fx: c.fx / 4.0, fy: c.fy / 4.0, cx: 79.5, cy: 59.5 }
}

fn picture(scene: &Scene, map_from_camera: &Isometry3<f64>, camera: &Intrinsics) -> Frame {
    render(&scene.room, &scene.solids(), map_from_camera, camera, 0)
}

/// Depth of a point below the object's surface, metres (approximate; negative outside); the cavity of a cup
/// counts as outside.
fn inside(o: &Object, map_point: &Point3<f64>) -> f64 {
    let p = o.map_from_object.inverse_transform_point(map_point);
    let ring = p.x.hypot(p.y);
    let within_height = |height: f64| p.z.min(height - p.z);
    let cone = |base: f64, top: f64, height: f64| {
        (0.5 * (base + (top - base) * p.z / height) - ring).min(within_height(height))
    };
    let hollow = |rim: f64, base: f64, height: f64, wall: f64| {
        let slope = (rim - base) / height;
        let inner = 0.5 * (base + slope * p.z) - wall - ring;
        cone(base, rim, height).min((-inner).max(wall - p.z))
    };
    match &o.shape {
        Shape::Cup(c) => {
            hollow(c.diameter_m, c.base_diameter_m.unwrap_or(c.diameter_m), c.height_m, c.wall_m)
        }
        Shape::Mug(m) => {
            let body = hollow(m.diameter_m, m.diameter_m, m.height_m, m.wall_m);
            let minor = 0.5 * m.handle_thickness_m;
            let (x, z) = (p.x - 0.5 * m.diameter_m, p.z - 0.5 * m.height_m);
            let off_ring = x.hypot(z) - (m.handle_m - minor);
            let handle =
                if ring >= 0.5 * m.diameter_m { minor - off_ring.hypot(p.y) } else { f64::NEG_INFINITY };
            body.max(handle)
        }
        Shape::Cylinder(c) => cone(c.diameter_m, c.top_diameter_m.unwrap_or(c.diameter_m), c.height_m),
        Shape::Canister(c) => {
            let seam = c.height_m - c.lid_height_m;
            let body = (0.5 * c.diameter_m - ring).min(p.z.min(seam - p.z));
            let lid = (0.5 * c.lid_diameter_m - ring).min((p.z - seam).min(c.height_m - p.z));
            body.max(lid)
        }
        Shape::Box(b) => {
            let [x, y, z] = b.size_m;
            (0.5 * x - p.x.abs()).min(0.5 * y - p.y.abs()).min(within_height(z))
        }
        other => panic!("{other:?} stands in none of these scenes"),
    }
}

#[test]
fn every_pixel_is_the_first_surface_on_its_ray() {
    let camera = small_camera();
    let mut seen = [0usize; 5];
    for seed in 1..=4u64 {
        let scene = scene(seed);
        let pose = camera_pose(seed as f64 * 1.7, 0.9);
        let frame = picture(&scene, &pose, &camera);
        for i in (0..frame.depth_m.len()).step_by(3) {
            let (u, v) = ((i % camera.width) as f64, (i / camera.width) as f64);
            let at = |z: f64| pose * camera.unproject(u, v, z);
            let depth = f64::from(frame.depth_m[i]);
            // Nothing solid lies before the hit.
            for step in 1..200 {
                let p = at(depth * f64::from(step) / 200.0);
                let deepest = scene.objects.iter().map(|o| inside(o, &p)).fold(f64::NEG_INFINITY, f64::max);
                assert!(deepest < 2e-4, "seed {seed} pixel {i}: passes {deepest} m through something");
            }
            let hit = at(depth);
            match frame.label[i] {
                LABEL_ROOM => {
                    let [x, y] = scene.room.size_m.map(|s| 0.5 * s);
                    let gap = hit.z.abs().min((hit.x.abs() - x).abs()).min((hit.y.abs() - y).abs());
                    assert!(gap < 1e-5, "seed {seed} pixel {i}: {gap} m off floor and walls");
                }
                label if label >= LABEL_OBJECT => {
                    let k = usize::from(label - LABEL_OBJECT);
                    let gap = inside(&scene.objects[k], &hit).abs();
                    assert!(gap < 3e-4, "seed {seed} pixel {i}: {gap} m off {}", scene.objects[k].name);
                    seen[k] += 1;
                }
                _ => {}
            }
        }
    }
    assert!(seen.iter().all(|&n| n > 15), "{seen:?} pixels of each object");
}

#[test]
fn what_stands_above_the_table_hides_it() {
    let scene = scene(2);
    let frame = picture(&scene, &camera_pose(0.3, 1.2), &small_camera());
    let table = scene.surfaces[0].map_from_top();
    let pose = camera_pose(0.3, 1.2);
    let camera = small_camera();
    let mut on_top = 0;
    for (i, &label) in frame.label.iter().enumerate() {
        let (u, v) = ((i % camera.width) as f64, (i / camera.width) as f64);
        let p = table.inverse_transform_point(&(pose * camera.unproject(u, v, f64::from(frame.depth_m[i]))));
        if label == sim::world::LABEL_FURNITURE && p.z.abs() < 1e-5 {
            assert!(p.x.abs() < 0.6 + 1e-5 && p.y.abs() < 0.4 + 1e-5);
            on_top += 1;
        }
    }
    assert!(on_top > 1000, "{on_top} pixels of the table top");
}

#[test]
fn threads_change_nothing() {
    let scene = scene(3);
    let camera = small_camera();
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let frame = picture(&scene, &camera_pose(1.0, 1.3), &camera);
            let depth = observe(&frame, &DepthNoise::default(), (0.4, 5.0), 9, 4);
            (frame, depth.iter().map(|z| z.to_bits()).collect::<Vec<_>>())
        })
    };
    assert_eq!(run(1), run(4));
    let frame = run(1).0;
    let other = observe(&frame, &DepthNoise::default(), (0.4, 5.0), 9, 5);
    assert_ne!(
        run(1).1,
        other.iter().map(|z| z.to_bits()).collect::<Vec<_>>(),
        "each frame has its own noise"
    );
}

#[test]
fn shares_agree_with_whole_pictures() {
    let camera = small_camera();
    for seed in 1..=6 {
        let scene = scene(seed);
        let pose = camera_pose(seed as f64, 1.4);
        let frame = picture(&scene, &pose, &camera);
        for k in 0..scene.objects.len() {
            let label = LABEL_OBJECT + k as u16;
            let mut alone = scene.clone();
            alone
                .objects
                .iter_mut()
                .enumerate()
                .filter(|(i, _)| *i != k)
                .for_each(|(_, o)| o.stands = Stand::Away);
            alone.surfaces.clear();
            alone.obstacles.clear();
            let count = |f: &Frame| f.label.iter().filter(|&&l| l == label).count() as f64;
            let all = count(&picture(&alone, &pose, &camera));
            let expected = count(&frame) / all;
            let share = visible_share(&scene, label, &pose, &camera, 1).unwrap();
            assert!(
                (share - expected).abs() < 1e-9,
                "seed {seed} object {k}: {share}, {expected} in the picture"
            );
        }
    }
}

/// A wall at right angles (cosine 1) or slanted, everywhere at the same depth.
fn flat(depth_m: f32, cosine: f32) -> Frame {
    let intrinsics = body::intrinsics();
    let pixels = intrinsics.width * intrinsics.height;
    Frame {
        intrinsics,
        stamp_ns: 0,
        depth_m: vec![depth_m; pixels],
        cosine: vec![cosine; pixels],
        label: vec![0; pixels],
        colour: vec![[0; 3]; pixels],
    }
}

#[test]
fn noise_along_the_ray_is_as_published() {
    for (z, deg) in [(0.8f64, 0.0f64), (1.5, 0.0), (2.5, 0.0), (1.5, 60.0), (1.5, 80.0)] {
        let cosine = deg.to_radians().cos() as f32;
        let seen = observe(&flat(z as f32, cosine), &DepthNoise::default(), (0.4, 5.0), 1, 1);
        let n = seen.len() as f64;
        let mean = seen.iter().map(|&d| f64::from(d)).sum::<f64>() / n;
        let sigma = (seen.iter().map(|&d| (f64::from(d) - mean).powi(2)).sum::<f64>() / n).sqrt();
        let steep = deg / (90.0 - deg);
        let axial = 0.0012 + 0.0019 * (z - 0.4).powi(2) + 0.0001 * steep * steep / z.sqrt();
        // A step of disparity spreads over its width evenly.
        let step = z * z / (body::intrinsics().fx * 0.075 * 8.0);
        let expected = axial.hypot(step / 12f64.sqrt());
        assert!((sigma / expected - 1.0).abs() < 0.04, "{z} m, {deg}°: σ {sigma}, expected {expected}");
        assert!((mean - z).abs() < 0.0006 * z, "{z} m, {deg}°: mean {mean}");
    }
    let grazing = observe(&flat(1.5, 86f32.to_radians().cos()), &DepthNoise::default(), (0.4, 5.0), 1, 1);
    assert!(grazing.iter().all(|z| z.is_nan()), "nothing returns beyond 85°");
    let far = observe(&flat(6.0, 1.0), &DepthNoise::default(), (0.4, 5.0), 1, 1);
    assert!(far.iter().all(|z| z.is_nan()), "nothing returns beyond the range");
}

/// A near wall on the right half of the picture before a far one.
fn step_edge() -> Frame {
    let mut frame = flat(2.0, 1.0);
    let width = frame.intrinsics.width;
    for (i, z) in frame.depth_m.iter_mut().enumerate() {
        if i % width >= width / 2 {
            *z = 1.2;
        }
    }
    frame
}

#[test]
fn holes_come_in_patches_and_as_many_as_asked_for() {
    let frame = flat(1.5, 1.0);
    let lost = |holes: f64| {
        let seen = observe(&frame, &DepthNoise { holes, ..DepthNoise::default() }, (0.4, 5.0), 1, 1);
        seen.iter().map(|z| z.is_nan()).collect::<Vec<bool>>()
    };
    assert!(lost(0.0).iter().all(|lost| !lost));
    let holed = lost(0.1);
    let share = holed.iter().filter(|lost| **lost).count() as f64 / holed.len() as f64;
    assert!((share - 0.1).abs() < 0.001, "{share}");
    // White noise would lose one in ten of the neighbours of what is lost.
    let pairs = holed.windows(2).filter(|pair| pair[0]);
    let (both, all) = pairs.fold((0, 0), |(both, all), pair| (both + usize::from(pair[1]), all + 1));
    assert!(10 * both > 7 * all, "{both} of {all}");
}

#[test]
fn edges_waver_by_the_lateral_noise_and_cast_a_shadow() {
    let frame = step_edge();
    let width = frame.intrinsics.width;
    let calm = DepthNoise { edge_loss: 0.0, ..DepthNoise::default() };
    let seen = observe(&frame, &calm, (0.4, 5.0), 1, 1);
    let near = |z: &f32| (z - 1.2).abs() < 0.1;
    let share_at = |offset: i64| {
        let column = (width as i64 / 2 + offset) as usize;
        let column_pixels: Vec<f32> = seen.iter().skip(column).step_by(width).copied().collect();
        column_pixels.iter().filter(|z| near(z)).count() as f64 / column_pixels.len() as f64
    };
    // A pixel takes its depth from a place σ = 0.8 px aside, rounded: Φ(-0.5/0.8) = 0.27 of the first column come from beyond the edge.
    assert!((share_at(0) - 0.73).abs() < 0.06, "{}", share_at(0));
    assert!((share_at(1) - 0.97).abs() < 0.03, "{}", share_at(1));
    assert!(share_at(4) > 0.995);
    // The projector, to the right, does not light f·b·(1/1.2 − 1/2) = 14.7 px left of the edge.
    let shadow_px = frame.intrinsics.fx * 0.075 * (1.0 / 1.2 - 1.0 / 2.0);
    let lost = (0..width / 2).filter(|&u| seen[100 * width + u].is_nan()).count() as f64;
    assert!((lost - shadow_px).abs() <= 2.0, "{lost} px of shadow, expected {shadow_px}");
    let lossy = observe(&frame, &DepthNoise { edge_loss: 1.0, ..calm }, (0.4, 5.0), 1, 1);
    assert!(
        lossy.iter().skip(width / 2).step_by(width).all(|z| z.is_nan()),
        "pixels beside the edge are lost"
    );
}
