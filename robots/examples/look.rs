//! Renders a scene from the start and from around its first surface: `cargo run --release --example look -- SCENE.toml [SEED] [OUT]`.

use descry_robots::image::{GrayImage, Luma};
use descry_robots::nalgebra::Point3;
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Place, Pose2, Robot, Watch};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Poses on a ring of this radius, metres.
const RING_M: f64 = 1.4;
const RING_POSES: usize = 5;

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
        println!("{:16} at {:.3} {:.3} {:.3}", o.name, o.centre_m.x, o.centre_m.y, o.centre_m.z);
    }
    println!("target {:?}: {:?} of it visible from the start", truth.target, truth.target_visible_from_start);
    let Some(surface) = robot.surfaces().first() else { return Ok(()) };
    let sum = surface.outline_m.iter().fold(Point3::origin(), |s: Point3<f64>, c| s + c.coords.push(0.0));
    let centre = Point3::from(sum.coords / surface.outline_m.len() as f64)
        + Point3::new(0.0, 0.0, surface.height_m).coords;
    let watch = Watch::default();
    for k in 0..=RING_POSES {
        if k > 0 {
            let angle = std::f64::consts::TAU * k as f64 / RING_POSES as f64;
            let (x_m, y_m) = (centre.x + RING_M * angle.cos(), centre.y + RING_M * angle.sin());
            let driven = robot.drive_to(&Place::Pose(Pose2::facing(x_m, y_m, &centre.xy())), &watch).await?;
            println!("pose {k}: {:.2} m, {:.1} s", driven.distance_m, driven.duration_s);
        }
        robot.look_at(&centre, &watch).await?;
        let sensed = robot.sense(&watch).await?;
        save(&sensed, &out.join(format!("look-{k}")))?;
    }
    println!("pictures in {}", out.display());
    Ok(())
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
