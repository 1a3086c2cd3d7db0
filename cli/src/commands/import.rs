//! `descry import RECORDING DIR`: a recording in a published layout becomes one in descry's own.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use descry_agent::exit::{CommandError, Exit};
use descry_robots::recorded::CameraSettings;
use descry_robots::recorded::import::{Imported, Options, SPACING_M};
use descry_robots::recorded::layouts::{Asked, LAYOUTS};
use descry_robots::recorded::reading::{Axes, Given, Poses};
use serde_json::json;

use crate::commands::input;

/// Arguments of `descry import`.
#[derive(clap::Args)]
#[command(long_about = about())]
pub struct Arguments {
    /// The recording: a folder, or the file of a bag
    recording: PathBuf,
    /// New folder for it in descry's own layout, for `--robot recorded:DIR`
    #[arg(value_name = "DIR")]
    into: PathBuf,
    /// Layout of the recording [default: told from its files]
    #[arg(long, value_name = "NAME")]
    layout: Option<String>,
    /// Depth camera in pixels, where the recording does not state it
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = camera)]
    camera: Option<CameraSettings>,
    /// Units of a depth image in a metre: 1000 for millimetres [default: as the layout defines, checked
    /// against the views]
    #[arg(long, value_name = "NUMBER", value_parser = positive)]
    depth_scale: Option<f64>,
    /// Unit of the positions in metres: 1, or 0.001 for millimetres, or 0.0254 for inches [default: as
    /// --depth-scale]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pose_unit: Option<f64>,
    /// Direction of the poses: world-from-camera, or camera-from-world (extrinsics) [default: as
    /// --depth-scale]
    #[arg(long, value_name = "DIRECTION", value_parser = poses)]
    poses: Option<Poses>,
    /// Axes of the camera in the poses: optical (x right, y down, z forward), opengl (x right, y up, z
    /// backward) or body (x forward, y left, z up) [default: as --depth-scale]
    #[arg(long, value_parser = axes)]
    axes: Option<Axes>,
    /// Topic of the depth images in a bag that has several
    #[arg(long)]
    topic: Option<String>,
    /// Least distance between frames that are kept, metres, where a turn of 1 rad counts as 0.6 m; 0 keeps all
    #[arg(long, value_name = "METRES", default_value_t = SPACING_M)]
    spacing: f64,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Time between two lines of progress.
const PROGRESS: Duration = Duration::from_secs(2);

/// Help text of the command, with the list of layouts.
fn about() -> String {
    let lines: Vec<String> = LAYOUTS.iter().map(|l| format!("\n  {:<10} {}", l.name, l.files)).collect();
    format!("Import a recording in a published layout, told from its files:{}", lines.concat())
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let options = Options {
        asked: Asked {
            layout: arguments.layout.clone(),
            camera: arguments.camera,
            topic: arguments.topic.clone(),
        },
        given: Given {
            poses: arguments.poses,
            axes: arguments.axes,
            pose_unit_m: arguments.pose_unit,
            depth_scale: arguments.depth_scale,
        },
        spacing_m: Some(arguments.spacing),
    };
    input::narrate(&format!("reading {}", arguments.recording.display()));
    let imported = Imported::open(&arguments.recording, &options).map_err(CommandError::bad_input)?;
    input::narrate(&format!("layout {}: {}", imported.layout.name, imported.layout.files));
    imported.notes.iter().for_each(|note| input::narrate_fitted(note));
    let mut said = Instant::now();
    let mut progress = |done: usize, all: usize| {
        if said.elapsed() >= PROGRESS {
            said = Instant::now();
            input::narrate(&format!("{done} of {all} frames written"));
        }
    };
    imported.write(&arguments.into, &mut progress).map_err(CommandError::bad_input)?;
    let into = arguments.into.display();
    if arguments.json {
        input::print_json(&json!({
            "layout": imported.layout.name,
            "frames": imported.frames.len(),
            "notes": imported.notes,
            "depth_scale": imported.reading.depth_scale,
            "pose_unit_m": imported.reading.pose_unit_m,
            "poses": imported.reading.poses.name(),
            "axes": imported.reading.axes.name(),
            "folder": into.to_string(),
        }))?;
    } else {
        input::print_text(&format!("{into}: {} frames, for --robot recorded:{into}", imported.frames.len()))?;
    }
    Ok(Exit::Done)
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "expected a number above zero".into())
}

fn camera(text: &str) -> Result<CameraSettings, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    match numbers.unwrap_or_default()[..] {
        [fx, fy, cx, cy] => Ok(CameraSettings { fx, fy, cx, cy }),
        _ => Err("expected four numbers such as 525,525,319.5,239.5".into()),
    }
}

fn poses(text: &str) -> Result<Poses, String> {
    named(text, &Poses::ALL, Poses::name)
}

fn axes(text: &str) -> Result<Axes, String> {
    named(text, &Axes::ALL, Axes::name)
}

fn named<T: Copy>(text: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
    let names: Vec<&str> = all.iter().map(|one| name(*one)).collect();
    let found = all.iter().find(|one| name(**one) == text);
    found.copied().ok_or_else(|| format!("expected one of: {}", names.join(", ")))
}
