//! TUM RGB-D: images named by stamps, and a trajectory with separate stamps.

use super::pieces::{self, Gathered};
use crate::input::InputError;
use crate::recorded::folder::{read as text, shown, stem};
use crate::recorded::pose;
use crate::recorded::reading::Conventions;
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Stated};
use nalgebra::Isometry3;
use std::path::{Path, PathBuf};

const TRAJECTORY: &str = "groundtruth.txt";
/// Units of a depth image in a metre. From: the data set's page on file formats.
const DEPTH_SCALE: f64 = 5000.0;
/// Maximum difference between the stamps of depth and colour image, seconds. From: the data set's
/// tool `associate.py`.
const BESIDE_S: f64 = 0.02;
/// Longest gap of the trajectory across which a pose is interpolated, seconds. From: chosen, ten poses of the
/// slowest trajectory.
const GAP_S: f64 = 0.1;
/// Cameras of the sequences (fx, fy, cx, cy in pixels), by a word in the folder's path. From: the data set's
/// page on intrinsics.
const CAMERAS: [(&str, [f64; 4]); 3] = [
    ("freiburg1", [517.3, 516.5, 318.6, 255.3]),
    ("freiburg2", [520.9, 521.0, 325.1, 249.7]),
    ("freiburg3", [535.4, 539.2, 320.1, 247.6]),
];
/// The data set's default camera (fx, fy, cx, cy in pixels), for unknown sequences.
const USUAL: [f64; 4] = [525.0, 525.0, 319.5, 239.5];

pub(super) fn is(path: &Path) -> bool {
    path.join(TRAJECTORY).is_file() && (path.join("depth.txt").is_file() || path.join("depth").is_dir())
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let trajectory = trajectory(&folder.join(TRAJECTORY))?;
    let depths = stamped(folder, "depth")?;
    let colours = stamped(folder, "rgb")?;
    let Some((_, first)) = depths.first() else {
        let problem = "no depth images: neither depth.txt nor depth/ names one";
        return Err(InputError::whole(shown(folder), problem, "16-bit PNG files are expected in depth/"));
    };
    let mut notes = Vec::new();
    let camera = camera(folder, asked, first, &mut notes)?;
    let mut gathered = Gathered::default();
    for (stamp_s, depth) in &depths {
        let Some(pose) = at(&trajectory, *stamp_s) else {
            gathered.without_pose();
            continue;
        };
        let beside = nearest(&colours, *stamp_s).filter(|(s, _)| (s - stamp_s).abs() <= BESIDE_S);
        let name = stem(&depth.file_name().unwrap_or_default().to_string_lossy()).to_string();
        gathered.add(name, camera, Some(pose), (depth.clone(), beside.map(|(_, path)| path.clone())));
    }
    if let (true, Some((first_s, _)), Some((from_s, _)), Some((to_s, _))) =
        (gathered.frames.is_empty(), depths.first(), trajectory.first(), trajectory.last())
    {
        let problem =
            format!("its stamps go from {from_s} to {to_s}, and the first depth image is of {first_s}");
        let mend = "stamps of images and poses are of one clock, in seconds";
        return Err(InputError::whole(shown(&folder.join(TRAJECTORY)), problem, mend));
    }
    notes.extend(gathered.notes());
    Ok(Stated {
        frames: gathered.frames,
        images: Box::new(gathered.files),
        reading: Conventions::usual(DEPTH_SCALE),
        whole: true,
        registered: true,
        up: None,
        notes,
    })
}

fn camera(
    folder: &Path,
    asked: &Asked,
    depth: &Path,
    notes: &mut Vec<String>,
) -> Result<CameraSettings, InputError> {
    let of = |[fx, fy, cx, cy]: [f64; 4]| CameraSettings { fx, fy, cx, cy };
    let calibration = folder.join("calibration.txt");
    if asked.camera.is_none() && calibration.is_file() {
        let rows = pose::rows(&shown(&calibration), &text(&calibration)?)?;
        let numbers: Option<[f64; 4]> = rows.first().and_then(|(_, row)| row.get(..4)?.try_into().ok());
        let found = numbers.ok_or_else(|| {
            let problem = "expected the four numbers fx fy cx cy";
            InputError::whole(shown(&calibration), problem, "write them in one line, in pixels")
        })?;
        return pieces::fitting(of(found), crate::recorded::picture::size_of(depth)?, &shown(&calibration));
    }
    let name = shown(&folder.canonicalize().unwrap_or(folder.to_path_buf()));
    let known = CAMERAS.iter().find(|(word, _)| name.contains(word));
    let usual = match known {
        Some((word, numbers)) => (of(*numbers), format!("that of the sequences {word}")),
        None => (of(USUAL), "that of the data set (525 525 319.5 239.5)".to_string()),
    };
    pieces::camera(folder, asked, depth, Some((usual.0, &usual.1)), notes)
}

type Stamped = Vec<(f64, PathBuf)>;

/// Images with their stamps in seconds, in time order: those listed in `NAME.txt`, or else the files in
/// folder `NAME`.
fn stamped(folder: &Path, name: &str) -> Result<Stamped, InputError> {
    let list = folder.join(format!("{name}.txt"));
    let mut found = Vec::new();
    if list.is_file() {
        let content = text(&list)?;
        for line in content.lines() {
            let mut words = line.split('#').next().unwrap_or("").split_whitespace();
            let (Some(stamp), file) = (words.next(), words.next()) else { continue };
            let byte = stamp.as_ptr() as usize - content.as_ptr() as usize;
            let (Some(stamp_s), Some(file)) = (stamp.parse::<f64>().ok().filter(|s| s.is_finite()), file)
            else {
                let problem = "expected a stamp in seconds and the file of an image";
                return Err(InputError::at(
                    &shown(&list),
                    &content,
                    byte,
                    problem,
                    "such as: 1305031102.16 depth/1305031102.16.png",
                ));
            };
            found.push((stamp_s, folder.join(file)));
        }
    } else {
        let images = pieces::images(&folder.join(name))?;
        found.extend(images.into_iter().filter_map(|(name, path)| Some((name.parse::<f64>().ok()?, path))));
    }
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(found)
}

/// Poses with their stamps in seconds, in time order, from lines `stamp tx ty tz qx qy qz qw`.
fn trajectory(file: &Path) -> Result<Vec<(f64, Isometry3<f64>)>, InputError> {
    let content = text(file)?;
    let mut found = Vec::new();
    for (byte, row) in pose::rows(&shown(file), &content)? {
        let Some((stamp_s, [x, y, z, qx, qy, qz, qw])) =
            row.split_first().and_then(|(s, rest)| Some((*s, <[f64; 7]>::try_from(rest).ok()?)))
        else {
            let problem = format!("{} numbers in a line, expected 8", row.len());
            return Err(InputError::at(
                &shown(file),
                &content,
                byte,
                problem,
                "write stamp tx ty tz qx qy qz qw",
            ));
        };
        let pose = pose::of_seven(&shown(file), &content, byte, [x, y, z, qx, qy, qz, qw])?;
        found.extend(pose.map(|pose| (stamp_s, pose)));
    }
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(found)
}

fn at(trajectory: &[(f64, Isometry3<f64>)], stamp_s: f64) -> Option<Isometry3<f64>> {
    pose::interpolated(trajectory, stamp_s, GAP_S)
}

fn nearest(stamped: &Stamped, stamp_s: f64) -> Option<&(f64, PathBuf)> {
    let after = stamped.partition_point(|(s, _)| *s < stamp_s);
    let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| stamped.get(i));
    beside.min_by(|(a, _), (b, _)| (a - stamp_s).abs().total_cmp(&(b - stamp_s).abs()))
}
