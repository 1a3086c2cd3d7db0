//! `descry recognise CLOUD…`: the surface and the objects in point clouds, without the agent.

use std::path::{Path, PathBuf};

use descry_agent::exit::{CommandError, Exit};
use descry_domains::load::{DEFAULT, Domain};
use descry_domains::looking::perceive;
use descry_perception::files::read_cloud;
use descry_perception::nalgebra::{Point3, Unit, Vector3};
use descry_perception::recognise::{Descry, ObjectModel, Percept, Published, Recogniser};
use descry_perception::segment::{Scene, SceneOptions, segment};
use descry_perception::{Cloud, View, Visibility};
use serde_json::{Value, json};

use crate::commands::input;

/// Arguments of `descry recognise`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Clouds: PCD, PLY, NPY, LAS, or text (XYZ, CSV, PTS)
    #[arg(required = true)]
    clouds: Vec<PathBuf>,
    /// Folder of object files [default: those of the domain tabletop]
    #[arg(long, value_name = "DIR")]
    objects: Option<PathBuf>,
    /// Recogniser: descry, or published (the score of Niemueller et al., Towards Deliberative Active Perception
    /// using Persistent Memory)
    #[arg(long, default_value = "descry", value_parser = ["descry", "published"])]
    recogniser: String,
    /// Position of the sensor in the frame of the cloud, metres [default: as stated in the file, or the
    /// origin]
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    viewpoint: Option<[f64; 3]>,
    /// Upward direction in the frame of the cloud [default: estimated from the cloud, or unknown]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    up: Option<[f64; 3]>,
    /// Draw the cloud as SVG, with each object tinted and labelled; for a single cloud
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Maximum size of a cloud file, bytes: some fifty million points, more than any sensor delivers at once.
const MOST_CLOUD_BYTES: u64 = 1 << 30;

/// Recognition result for a cloud file.
struct Seen {
    path: String,
    points: usize,
    notes: Vec<String>,
    cloud: Cloud,
    found: Result<(Scene, Vec<Percept>), String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let objects = match &arguments.objects {
        Some(folder) => descry_domains::load::objects(folder),
        None => Domain::load(DEFAULT).map(|d| d.objects),
    };
    let objects = objects.map_err(CommandError::bad_input)?;
    let recogniser: &dyn Recogniser = match arguments.recogniser.as_str() {
        "published" => &Published::default(),
        _ => &Descry::default(),
    };
    let seen: Vec<Seen> = arguments
        .clouds
        .iter()
        .map(|path| look(path, arguments, recogniser, &objects))
        .collect::<Result<_, _>>()?;
    if let Some(path) = &arguments.picture {
        draw(path, &seen)?;
    }
    if arguments.json {
        input::print_json(&json!({ "clouds": seen.iter().map(as_json).collect::<Vec<_>>() }))?;
    } else {
        for cloud in &seen {
            input::print_text(&as_text(cloud))?;
        }
    }
    // No surface in a cloud is an honest no.
    Ok(if seen.iter().all(|s| s.found.is_ok()) { Exit::Done } else { Exit::No })
}

fn look(
    path: &Path,
    arguments: &Arguments,
    recogniser: &dyn Recogniser,
    objects: &[ObjectModel],
) -> Result<Seen, CommandError> {
    let shown = path.display().to_string();
    let bytes = input::read(path, MOST_CLOUD_BYTES).map_err(|e| match e {
        CommandError::BadInput(why) => CommandError::BadInput(format!(
            "{why}\n  expected a point cloud: PCD, PLY, NPY, LAS, XYZ, CSV or PTS"
        )),
        other => other,
    })?;
    let loaded = read_cloud(&bytes).map_err(|e| CommandError::BadInput(format!("{shown}, {e}")))?;
    let (cloud, mut notes) = (loaded.cloud, loaded.notes);
    let points = cloud.points.len();
    let view = View::alone(cloud);
    let stated =
        Some(Point3::from(loaded.viewpoint.translation.vector)).filter(|eye| *eye != Point3::origin());
    let (visibility, note) = seen_from(&view, arguments.viewpoint.map(Point3::from), stated);
    notes.extend(note.map(str::to_string));
    let mut options = SceneOptions::default();
    options.surface.up = arguments.up.map(|up| Unit::new_normalize(Vector3::from(up)));
    let found = segment(&view.cloud, &visibility, &options)
        .map(|scene| {
            let percepts = recogniser.recognise(&scene, &visibility, objects);
            (scene, percepts)
        })
        .map_err(|e| e.to_string());
    let doubt = found.iter().find_map(|(scene, _)| scene.surface.doubt());
    notes.extend(doubt.map(|doubt| format!("the table {doubt}")));
    Ok(Seen { path: shown, points, notes, cloud: view.cloud, found })
}

/// Visibility of a cloud, with a note for the user. The pixels of an organised cloud tell which space was
/// seen through; for others, the sensor's position is taken from the option `told` or else from the file.
pub fn seen_from(
    view: &View,
    told: Option<Point3<f64>>,
    stated: Option<Point3<f64>>,
) -> (Visibility, Option<&'static str>) {
    let organised = Visibility::from_views(std::slice::from_ref(view));
    if !organised.maps.is_empty() {
        return (
            organised,
            told.map(|_| "--viewpoint is left out: an organised cloud tells it by its pixels"),
        );
    }
    let known = told.or(stated);
    let visibility = Visibility::from_viewpoints(&view.cloud, &[known.unwrap_or(Point3::origin())]);
    let unknown = "the file does not say where the sensor stood: taken at the origin; give --viewpoint";
    (visibility, known.is_none().then_some(unknown))
}

/// Parses three finite numbers, separated by commas.
pub fn triple(text: &str) -> Result<[f64; 3], String> {
    let number = |word: &str| word.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    let numbers = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    numbers.ok_or_else(|| "expected three numbers such as 0,-0.5,1.2".to_string())
}

/// Parses a direction: three numbers, not all zero.
pub fn direction(text: &str) -> Result<[f64; 3], String> {
    let up = triple(text)?;
    let length = Vector3::from(up).norm();
    match length.is_finite() && length > 0.0 {
        true => Ok(up),
        false => Err("expected a direction such as 0,0,1".to_string()),
    }
}

fn draw(path: &Path, seen: &[Seen]) -> Result<(), CommandError> {
    let [only] = seen else {
        return Err(CommandError::BadInput("--picture draws one cloud: name one".into()));
    };
    let Ok((scene, percepts)) = &only.found else { return Ok(()) };
    let drawn = descry_pages::picture::svg(&only.cloud, &scene.surface, percepts)?;
    std::fs::write(path, drawn)
        .map_err(|e| CommandError::BadInput(format!("--picture {}: {e}", path.display())))
}

fn as_json(seen: &Seen) -> Value {
    let mut value = json!({ "cloud": seen.path, "points": seen.points, "notes": seen.notes });
    match &seen.found {
        Ok((scene, percepts)) => {
            value["table"] = json!(scene.surface);
            value["objects"] = json!(percepts);
        }
        Err(why) => {
            value["table"] = Value::Null;
            value["objects"] = json!([]);
            value["why"] = json!(why);
        }
    }
    value
}

fn as_text(seen: &Seen) -> String {
    let mut lines = vec![format!("{}: {} points", seen.path, seen.points)];
    lines.extend(seen.notes.iter().map(|note| format!("  note: {note}")));
    match &seen.found {
        Ok((scene, percepts)) => {
            let s = &scene.surface;
            lines.push(format!(
                "  table: {:.2} m2, {} points within {:.1} mm",
                s.area_m2,
                s.points,
                s.residual_m * 1e3
            ));
            lines.extend(percepts.iter().map(|p| format!("  {}", perceive::in_a_line(p))));
        }
        Err(why) => lines.push(format!("  no table: {why}")),
    }
    lines.join("\n")
}
