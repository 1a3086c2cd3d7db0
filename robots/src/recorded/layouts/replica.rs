//! The Replica data set as rendered for NICE-SLAM and its successors.

use super::pieces::{self, Gathered, by_number, json};
use crate::input::InputError;
use crate::recorded::folder::{read as text, shown};
use crate::recorded::picture;
use crate::recorded::pose;
use crate::recorded::reading::Conventions;
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Stated};
use serde::Deserialize;
use std::path::Path;

/// Units of a depth image in a metre where no camera file states it. From: the data set's `cam_params.json`.
const DEPTH_SCALE: f64 = 6553.5;
const CAMERA: &str = "cam_params.json";

#[derive(Deserialize)]
struct Parameters {
    camera: Camera,
}

#[derive(Deserialize)]
struct Camera {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    scale: Option<f64>,
}

pub(super) fn is(path: &Path) -> bool {
    path.join("traj.txt").is_file() && path.join("results").is_dir()
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let images = pieces::images(&folder.join("results"))?;
    let (depths, others): (Vec<_>, Vec<_>) =
        images.into_iter().partition(|(name, _)| name.starts_with("depth"));
    let Some((_, first)) = depths.first() else {
        let problem = "no depth images";
        return Err(InputError::whole(
            shown(&folder.join("results")),
            problem,
            "depth000000.png is expected there",
        ));
    };
    let colours = by_number(others.into_iter().filter(|(name, _)| name.starts_with("frame")).collect());
    let mut notes = Vec::new();
    let beside = [folder.join(CAMERA), folder.parent().unwrap_or(folder).join(CAMERA)];
    let stated = beside.iter().find(|file| file.is_file());
    let parameters: Option<Parameters> = stated.map(|file| json(file)).transpose()?;
    let camera = match (asked.camera, stated, &parameters) {
        (None, Some(file), Some(Parameters { camera: Camera { fx, fy, cx, cy, .. } })) => {
            let camera = CameraSettings { fx: *fx, fy: *fy, cx: *cx, cy: *cy };
            pieces::fitting(camera, picture::size_of(first)?, &shown(file))?
        }
        _ => pieces::camera(folder, asked, first, None, &mut notes)?,
    };
    let file = folder.join("traj.txt");
    let content = text(&file)?;
    let rows = pose::rows(&shown(&file), &content)?;
    if rows.len() != depths.len() {
        let problem = format!("{} poses for {} depth images in results/", rows.len(), depths.len());
        let mend = "write one line a frame, in the order of the frames";
        return Err(InputError::at(&shown(&file), &content, content.trim_end().len(), problem, mend));
    }
    let mut gathered = Gathered::default();
    for ((name, depth), (byte, row)) in depths.into_iter().zip(rows) {
        if row.len() != 16 {
            let problem = format!("{} numbers in a line, expected 16", row.len());
            return Err(InputError::at(
                &shown(&file),
                &content,
                byte,
                problem,
                "write a 4x4 matrix row by row",
            ));
        }
        let pose = pieces::pose_of(&format!("{}, pose of {name}", shown(&file)), &row)?;
        let colour = pieces::number(&name).and_then(|n| colours.get(&n)).cloned();
        gathered.add(name, camera, pose, (depth, colour));
    }
    notes.extend(gathered.notes());
    let scale = parameters.and_then(|p| p.camera.scale).filter(|s| s.is_finite() && *s > 0.0);
    Ok(Stated {
        frames: gathered.frames,
        images: Box::new(gathered.files),
        reading: Conventions::usual(scale.unwrap_or(DEPTH_SCALE)),
        whole: true,
        registered: true,
        up: None,
        notes,
    })
}
