//! Planes of real rooms: two laser scans, registered onto each other, and five views of a dining room.

use super::plot::{Sheet, write};
use descry_perception::cloud::Cloud;
use descry_perception::mapping::{
    ClosureOptions, FieldOfView, MapOptions, RectifyOptions, RoomMap, Station, Survey, relocate,
};
use descry_perception::nalgebra::{
    Isometry2, Isometry3, Point2, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3,
};
use descry_perception::plane::{self, PlaneOptions};
use descry_perception::register::{self, Method, Prepared, RegisterOptions};
use descry_perception::{Intrinsics, files, voxel};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn data() -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        println!("\nskipped: no ../shared/data beside the workspace");
        return None;
    }
    Some(folder)
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Pose that moves the floor to z = 0, and the viewpoints moved by that pose; the floor is the largest
/// plane across `up` below the first viewpoint. `None` if no plane is found.
fn floored(
    cloud: &Cloud,
    up: Vector3<f64>,
    seen_from: &[Point3<f64>],
) -> Option<(Isometry3<f64>, Vec<Point3<f64>>)> {
    let thin = voxel::downsample(cloud, 0.03).ok()?;
    let options = PlaneOptions {
        tolerance_m: 0.03,
        rounds: 3000,
        tilt: Some((descry_perception::nalgebra::Unit::new_normalize(up), 0.3)),
        ..PlaneOptions::default()
    };
    let mut low = thin.finite();
    // The floor is below the camera.
    let eye = seen_from.first()?;
    low = low.filter(|p| (p.cast::<f64>() - eye).dot(&up) < -0.3);
    let found = plane::find(&low.points, &options).ok()?.plane;
    let turn = Rotation3::rotation_between(&found.normal, &Vector3::z())?;
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let pose = Isometry3::from_parts(Translation3::new(0.0, 0.0, -found.offset_m), turn);
    Some((pose, seen_from.iter().map(|p| pose * p).collect()))
}

fn print(name: &str, map: &RoomMap, points: usize, seconds: f64) {
    println!(
        "{name}: {points} points, {seconds:.2} s; main direction {}",
        map.main_rad.map_or("none".to_owned(), |m| format!("{:.1}°", m.to_degrees()))
    );
    for wall in map.walls.iter().take(8) {
        println!(
            "    wall {:>5.2} m long, {:>5.2} to {:>5.2} m high, {:>5.2} m², heading {:>6.1}°, {} stretches",
            wall.length_m(),
            wall.heights_m.0,
            wall.heights_m.1,
            wall.area_m2,
            wall.plane.normal.y.atan2(wall.plane.normal.x).to_degrees(),
            wall.stretches_m.len()
        );
    }
    for c in &map.cylinders {
        println!(
            "    cylinder of radius {:.2} m at ({:.2}, {:.2}), {:.2} to {:.2} m high, {:.0}° seen, rms {:.1} cm",
            c.radius_m,
            c.middle.x,
            c.middle.y,
            c.heights_m.0,
            c.heights_m.1,
            c.arc_rad().to_degrees(),
            100.0 * c.rms_m
        );
    }
    for level in map.levels.iter().take(6) {
        println!(
            "    level {:>5.2} m high, {:>5.2} m², seen from {}",
            level.height_m,
            level.area_m2,
            if level.faces_up { "above" } else { "below" }
        );
    }
}

fn sheet(map: &RoomMap, clouds: &[Station], scale: f64) -> Sheet {
    let places = clouds
        .iter()
        .flat_map(|s| s.points.iter().step_by(50).map(|p| Point2::new(f64::from(p.x), f64::from(p.y))));
    let near = places.filter(|p| p.coords.norm() < 12.0);
    let mut sheet = Sheet::around(near, scale);
    let poses = vec![Isometry2::identity(); clouds.len()];
    sheet.stations(clouds, &poses, f64::INFINITY);
    sheet.upright(map);
    sheet.levels(map);
    sheet
}

/// Maps the points of one place, seen from one or several viewpoints.
fn map(views: &[(Vec<Point3<f32>>, Point3<f64>)], edge_m: f64) -> Result<RoomMap, String> {
    let mut survey = Survey::new(edge_m).map_err(|e| e.to_string())?;
    for (points, eye) in views {
        // The survey takes points around the plumb line of the eye.
        let shift = Vector3::new(eye.x, eye.y, 0.0).cast::<f32>();
        let station = Station {
            points: points.iter().map(|p| p - shift).collect(),
            odom_from_level: Isometry2::identity(),
        };
        let pose = Isometry2::new(eye.xy().coords, 0.0);
        survey.add(&station, &pose, eye.z, f64::INFINITY, &(0.15..=1.6)).map_err(|e| e.to_string())?;
    }
    survey.map(&MapOptions::default()).map_err(|e| e.to_string())
}

fn scans(folder: &Path, out: Option<&Path>) -> Result<(), String> {
    let mut prepared = Vec::new();
    let mut sheets = Vec::new();
    for name in ["room_scan1", "room_scan2"] {
        let loaded =
            files::read_cloud(&read(&folder.join(format!("pcl/{name}.pcd")))?).map_err(|e| e.to_string())?;
        let cloud = loaded.cloud.finite();
        let Some((level, eyes)) = floored(&cloud, Vector3::z(), &[Point3::origin()]) else { continue };
        let points = cloud.transformed(&level).points;
        let before = Instant::now();
        let room = map(&[(points.clone(), eyes[0])], 0.1)?;
        print(name, &room, points.len(), before.elapsed().as_secs_f64());
        sheets.push((name, sheet(&room, &[level_station(points.clone())], 50.0)));
        prepared.push(Cloud::from_points(points));
    }
    let [first, second] = prepared.as_slice() else { return Err("no floor in a room scan".to_owned()) };
    let plan = by_plans(first, second)?;
    let pose = by_all_points(first, second, &plan)?;
    let moved = first.transformed(&pose).points;
    let eyes = [pose * Point3::new(0.0, 0.0, 1.0), Point3::new(0.0, 0.0, 1.0)];
    let views = [(moved, eyes[0]), (second.points.clone(), eyes[1])];
    let before = Instant::now();
    let both = map(&views, 0.1)?;
    print("both scans", &both, views.iter().map(|v| v.0.len()).sum(), before.elapsed().as_secs_f64());
    if let Some(dir) = out {
        let stations: Vec<Station> = views.into_iter().map(|(points, _)| level_station(points)).collect();
        sheets.push(("both", sheet(&both, &stations, 50.0)));
        write(dir, "room-scans.svg", &sheets)?;
    }
    Ok(())
}

fn level_station(points: Vec<Point3<f32>>) -> Station {
    Station { points, odom_from_level: Isometry2::identity() }
}

/// Relocates the first scan on the second by their floor plans alone, without an initial guess.
fn by_plans(first: &Cloud, second: &Cloud) -> Result<Isometry2<f64>, String> {
    let before = Instant::now();
    let station = |cloud: &Cloud| [level_station(cloud.points.clone())];
    let field = FieldOfView { right_rad: -PI, left_rad: PI, near_m: 0.3, far_m: 10.0 };
    let rectify = RectifyOptions { field, thin_m: 0.1, ..RectifyOptions::default() };
    let options =
        ClosureOptions { most_m: 4.0, heading_drift_rad: PI, explained: 0.4, ..ClosureOptions::default() };
    let here = [Isometry2::identity()];
    let plan = relocate((&station(second), &here), (&station(first), &here), &here[0], &rectify, &options)
        .map_err(|e| e.to_string())?
        .ok_or("the plans of the scans do not register")?;
    let found = plan.before_from_after;
    println!(
        "room_scan1 on room_scan2, plans from nothing: {:.0} % explained, shifted {:.2} {:.2} m, turned {:.1}°, {:.2} s",
        100.0 * plan.explained,
        found.translation.x,
        found.translation.y,
        found.rotation.angle().to_degrees(),
        before.elapsed().as_secs_f64()
    );
    Ok(found)
}

/// Refines the pose `plan` with all points.
fn by_all_points(first: &Cloud, second: &Cloud, plan: &Isometry2<f64>) -> Result<Isometry3<f64>, String> {
    let before = Instant::now();
    let thin = |cloud: &Cloud| voxel::downsample(cloud, 0.05).map_err(|e| e.to_string());
    let ready = |cloud: &Cloud| Prepared::with_normals(&cloud.points, 20).map_err(|e| e.to_string());
    let start = Isometry3::new(plan.translation.vector.push(0.0), Vector3::z() * plan.rotation.angle());
    let options = RegisterOptions {
        method: Method::PointToPlane,
        start_target_from_source: start,
        within_m: 0.2,
        robust_m: Some(0.03),
        ..RegisterOptions::default()
    };
    let best = register::align(&ready(&thin(first)?)?, &ready(&thin(second)?)?, &options)
        .map_err(|e| e.to_string())?;
    let shift = best.target_from_source.translation.vector;
    println!(
        "    then all points: {} of {} matched within 20 cm, residual {:.1} mm, shifted {:.2} {:.2} {:.2} m, turned {:.1}°, {}, {:.2} s",
        best.matched,
        best.of,
        1e3 * best.residual_m,
        shift.x,
        shift.y,
        shift.z,
        best.target_from_source.rotation.angle().to_degrees(),
        best.ending,
        before.elapsed().as_secs_f64()
    );
    Ok(best.target_from_source)
}

fn dining_room(folder: &Path, out: Option<&Path>) -> Result<(), String> {
    let folder = folder.join("dining_room");
    let camera = Intrinsics { width: 640, height: 480, fx: 518.0, fy: 519.0, cx: 325.5, cy: 253.5 };
    let poses = String::from_utf8(read(&folder.join("pose.txt"))?).map_err(|e| e.to_string())?;
    let mut all = Cloud::default();
    let mut views: Vec<(Cloud, Point3<f64>)> = Vec::new();
    for (i, line) in poses.lines().filter(|l| !l.trim().is_empty()).enumerate() {
        let v: Vec<f64> = line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let [x, y, z, qx, qy, qz, qw] = v[..] else {
            return Err(format!("pose {i}: seven numbers expected"));
        };
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
        let pose = Isometry3::from_parts(Translation3::new(x, y, z), turn);
        let depth = files::depth::read(&read(&folder.join(format!("depth/{}.pgm", i + 1)))?, 0.001)
            .map_err(|e| e.to_string())?;
        let cloud = camera.cloud_from_depth(&depth.depths_m).map_err(|e| e.to_string())?;
        let world = cloud.filter(|p| p.z < 5.0).transformed(&pose);
        all.append(&world);
        views.push((world, Point3::new(x, y, z)));
    }
    let eyes: Vec<Point3<f64>> = views.iter().map(|v| v.1).collect();
    // The first camera looks level: up is against its y axis.
    let Some((level, eyes)) = floored(&all, -Vector3::y(), &eyes) else {
        return Err("no floor in the dining room".to_owned());
    };
    let before = Instant::now();
    let seen: Vec<(Vec<Point3<f32>>, Point3<f64>)> =
        views.iter().zip(&eyes).map(|((cloud, _), eye)| (cloud.transformed(&level).points, *eye)).collect();
    let room = map(&seen, 0.05)?;
    print("dining_room", &room, seen.iter().map(|v| v.0.len()).sum(), before.elapsed().as_secs_f64());
    if let Some(dir) = out {
        let stations: Vec<Station> = seen
            .into_iter()
            .map(|(points, _)| Station { points, odom_from_level: Isometry2::identity() })
            .collect();
        write(dir, "dining-room.svg", &[("dining_room", sheet(&room, &stations, 100.0))])?;
    }
    Ok(())
}

/// Prints results on recorded real rooms: two laser scans and five views; nothing without the data.
pub fn rooms(out: Option<&Path>) -> Result<(), String> {
    let Some(folder) = data() else { return Ok(()) };
    println!("\nreal rooms: two laser scans, five views");
    scans(&folder, out)?;
    dining_room(&folder, out)
}
