//! Redwood and Open3D: a folder of depth images and a trajectory as `.log` or `.json`.

use super::pieces::{self, Gathered, by_number, depths, json};
use crate::input::InputError;
use crate::recorded::folder::{names, read as text, shown};
use crate::recorded::picture;
use crate::recorded::pose;
use crate::recorded::reading::{Conventions, Poses};
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Stated};
use nalgebra::Isometry3;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Units of a depth image in a metre. From: the data set's page.
const DEPTH_SCALE: f64 = 1000.0;
/// Camera of the sequences. From: the data set's page, the factory's values of a PrimeSense.
const PRIMESENSE: CameraSettings = CameraSettings { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 };

/// Open3D's `PinholeCameraIntrinsic`.
#[derive(Deserialize)]
struct Intrinsic {
    /// Column by column.
    intrinsic_matrix: [f64; 9],
}

/// An entry of Open3D's `PinholeCameraTrajectory`.
#[derive(Deserialize)]
struct Parameters {
    /// World to camera, column by column.
    extrinsic: [f64; 16],
    intrinsic: Intrinsic,
}

#[derive(Deserialize)]
struct Trajectory {
    parameters: Vec<Parameters>,
}

impl Intrinsic {
    fn camera(&self) -> CameraSettings {
        let k = &self.intrinsic_matrix;
        CameraSettings { fx: k[0], fy: k[4], cx: k[6], cy: k[7] }
    }
}

pub(super) fn is(path: &Path) -> bool {
    path.join("depth").is_dir() && trajectory(path).is_some()
}

/// File of the trajectory in the folder: one that ends in `.log`, or else a JSON file with `trajectory` in
/// its name.
fn trajectory(folder: &Path) -> Option<PathBuf> {
    let names = names(folder).ok()?;
    let json = |n: &&String| n.ends_with(".json") && n.contains("trajectory");
    let found = names.iter().find(|n| n.ends_with(".log")).or_else(|| names.iter().find(json));
    found.map(|name| folder.join(name))
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let file = trajectory(folder).ok_or_else(|| {
        let problem = "no trajectory: neither a .log nor a trajectory.json of Open3D";
        InputError::whole(shown(folder), problem, "add it to the folder, beside depth/")
    })?;
    let depths = depths(&folder.join("depth"))?;
    let colours = pieces::images(&pieces::either(folder, &["color", "image", "rgb"]))?;
    let in_order = (colours.len() == depths.len()).then(|| colours.clone());
    let colours = by_number(colours);
    let mut notes = Vec::new();
    let size = picture::size_of(&depths[0].1)?;
    let (poses, own, direction) = if file.extension().is_some_and(|e| e == "json") {
        let read: Trajectory = json(&file)?;
        let own = read.parameters.first().map(|p| p.intrinsic.camera());
        let rows = |p: &Parameters| {
            let row = |r: usize| [0, 4, 8, 12].map(|c| p.extrinsic[c + r]);
            [row(0), row(1), row(2), row(3)].concat()
        };
        let pose = |(i, p)| pieces::pose_of(&format!("{}, entry {i} of parameters", shown(&file)), &rows(p));
        let poses = read.parameters.iter().enumerate().map(pose);
        let poses: Result<Vec<_>, _> = poses.collect();
        ((0..).zip(poses?).collect(), own, Poses::CameraFromWorld)
    } else {
        (log(&file)?, None, Poses::WorldFromCamera)
    };
    let camera = match (asked.camera, own, beside(folder)) {
        (None, Some(own), _) => pieces::fitting(own, size, &shown(&file))?,
        (None, None, Some(beside)) => {
            let read: Intrinsic = json(&beside)?;
            pieces::fitting(read.camera(), size, &shown(&beside))?
        }
        _ => {
            let whose = "the data set's PrimeSense (525 525 319.5 239.5)";
            pieces::camera(folder, asked, &depths[0].1, Some((PRIMESENSE, whose)), &mut notes)?
        }
    };
    if let Some((last, _)) = poses.iter().find(|(index, _)| *index >= depths.len()) {
        let problem = format!("a pose of frame {last}, and depth/ has {} images", depths.len());
        return Err(InputError::whole(shown(&file), problem, "are these the images of this trajectory?"));
    }
    let mut gathered = Gathered::default();
    let posed = poses.len();
    for (index, pose) in poses {
        let (name, depth) = &depths[index];
        let colour = pieces::number(name).and_then(|n| colours.get(&n)).cloned();
        let colour = colour.or_else(|| in_order.as_ref().map(|all| all[index].1.clone()));
        gathered.add(name.clone(), camera, pose, (depth.clone(), colour));
    }
    (posed..depths.len()).for_each(|_| gathered.without_pose());
    notes.extend(gathered.notes());
    Ok(Stated {
        frames: gathered.frames,
        images: Box::new(gathered.files),
        reading: Conventions { poses: direction, ..Conventions::usual(DEPTH_SCALE) },
        whole: true,
        registered: true,
        up: None,
        notes,
    })
}

/// File of Open3D's `PinholeCameraIntrinsic` in the folder: a JSON file with `camera` or `intrinsic` in its
/// name.
fn beside(folder: &Path) -> Option<PathBuf> {
    let says = |n: &String| n.ends_with(".json") && (n.contains("intrinsic") || n.contains("camera"));
    names(folder).ok()?.into_iter().find(|n| says(n) && !n.contains("trajectory")).map(|n| folder.join(n))
}

/// Poses of a `.log` file, each with the number of its frame (the first of three numbers in a line before the
/// matrix); `None` for a pose that is not finite.
fn log(file: &Path) -> Result<Vec<(usize, Option<Isometry3<f64>>)>, InputError> {
    let content = text(file)?;
    let rows = pose::rows(&shown(file), &content)?;
    let at = |byte: usize, problem: String| {
        let mend = "an entry has a line of three numbers and four lines of a camera-to-world matrix";
        InputError::at(&shown(file), &content, byte, problem, mend)
    };
    let mut poses = Vec::new();
    for entry in rows.chunks(5) {
        let (byte, head) = &entry[0];
        if head.len() != 3 || !(head[0] >= 0.0 && head[0].fract() == 0.0) {
            return Err(at(*byte, format!("{} numbers, expected three whole ones", head.len())));
        }
        if entry.len() < 5 {
            return Err(at(
                content.trim_end().len(),
                "the end of the file, expected four lines of a matrix".into(),
            ));
        }
        if let Some((byte, row)) = entry[1..].iter().find(|(_, row)| row.len() != 4) {
            return Err(at(*byte, format!("{} numbers in a line, expected 4", row.len())));
        }
        let numbers: Vec<f64> = entry[1..].iter().flat_map(|(_, row)| row.clone()).collect();
        let line = content[..*byte].matches('\n').count() + 1;
        poses.push((
            head[0] as usize,
            pieces::pose_of(&format!("{}, entry at line {line}", shown(file)), &numbers)?,
        ));
    }
    // Some writers number all entries alike; then the frames are in order.
    let rises = poses.windows(2).all(|pair| pair[0].0 < pair[1].0);
    if !rises {
        poses.iter_mut().enumerate().for_each(|(i, (index, _))| *index = i);
    }
    Ok(poses)
}
