//! Renders a scene from the start and from poses around its surfaces, opening doors on the way:
//! `cargo run --release --example look -- SCENE.toml [SEED] [OUT]`.

use descry_robots::image::{GrayImage, Luma};
use descry_robots::nalgebra::Point3;
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Failure, Place, Pose2, Robot, SurfaceHint, Watch};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Radius of the ring of poses, metres.
const RING_M: f64 = 1.3;
const RING_POSES: usize = 5;
/// Maximum number of drives to a pose, as doors may be shut.
const TRIES: usize = 20;

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("give a scene file")?;
    let seed = arguments.next().map_or(Ok(1), |s| s.parse())?;
    let out = arguments.next().map_or_else(std::env::temp_dir, PathBuf::from);
    let spec = SceneSpec::parse(&file, &std::fs::read_to_string(&file)?)?;
    let robot = SimRobot::new(arrange(&spec, seed)?, SimOptions { seed, ..SimOptions::default() });
    let truth = robot.truth();
    for o in &truth.objects {
        let (surface, room) = (o.surface.as_deref().unwrap_or("-"), o.room.as_deref().unwrap_or("-"));
        println!(
            "{:16} {:.3} {:.3} {:.3} {surface}, {room}",
            o.name, o.centre_m.x, o.centre_m.y, o.centre_m.z
        );
    }
    for door in &truth.doors {
        println!("{} is {}", door.name, if door.shut { "shut" } else { "open" });
    }
    println!("target {:?}: {:?} of it visible from the start", truth.target, truth.target_visible_from_start);
    map(&robot).save(out.join("map.png"))?;
    for surface in robot.surfaces() {
        look_around(&robot, surface, &out).await?;
    }
    println!("pictures in {}", out.display());
    Ok(())
}

async fn look_around(robot: &SimRobot, surface: &SurfaceHint, out: &Path) -> Result<(), Box<dyn Error>> {
    let sum = surface.outline_m.iter().fold(Point3::origin(), |s: Point3<f64>, c| s + c.coords.push(0.0));
    let centre = Point3::from(sum.coords / surface.outline_m.len() as f64)
        + Point3::new(0.0, 0.0, surface.height_m).coords;
    let watch = Watch::default();
    for k in 0..=RING_POSES {
        if k > 0 {
            let angle = std::f64::consts::TAU * k as f64 / RING_POSES as f64;
            let (x_m, y_m) = (centre.x + RING_M * angle.cos(), centre.y + RING_M * angle.sin());
            if let Err(failure) = go(robot, &Place::Pose(Pose2::facing(x_m, y_m, &centre.xy()))).await {
                println!("{} {k}: {failure}", surface.name);
                continue;
            }
        }
        robot.look_at(&centre, &watch).await?;
        let sensed = robot.sense(&watch).await?;
        save(&sensed, &out.join(format!("{}-{k}", surface.name.replace(' ', "-"))))?;
    }
    Ok(())
}

/// Drives to a place and opens shut doors on the way.
async fn go(robot: &SimRobot, place: &Place) -> Result<(), Failure> {
    for _ in 0..TRIES {
        match robot.drive_to(place, &Watch::default()).await {
            Err(Failure::Blocked { by: Some(door), .. }) => {
                let opened = robot.open_door(&door, &Watch::default()).await;
                println!("{door}: {opened:?}");
            }
            driven => return driven.map(|_| ()),
        }
    }
    Err(Failure::Unreachable { because: "the doors stay shut".into() })
}

/// Picture of the map, four pixels a cell.
fn map(robot: &SimRobot) -> GrayImage {
    let Some(map) = robot.map() else { return GrayImage::new(1, 1) };
    GrayImage::from_fn(4 * map.width as u32, 4 * map.height as u32, |u, v| {
        let (column, row) = (u as usize / 4, map.height - 1 - v as usize / 4);
        Luma([if map.occupied[row * map.width + column] { 0 } else { 255 }])
    })
}

fn save(sensed: &descry_robots::Sensed, stem: &Path) -> Result<(), Box<dyn Error>> {
    if let Some(colour) = &sensed.colour {
        colour.image.save(stem.with_extension("colour.png"))?;
    }
    let width = sensed.intrinsics.width as u32;
    let grey = |u: u32, v: u32| match sensed.depth_m[(v * width + u) as usize] {
        z if z.is_finite() => Luma([(255.0 - 60.0 * z).clamp(1.0, 255.0) as u8]),
        _ => Luma([0]),
    };
    GrayImage::from_fn(width, sensed.intrinsics.height as u32, grey)
        .save(stem.with_extension("depth.png"))?;
    Ok(())
}
