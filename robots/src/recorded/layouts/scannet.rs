//! The ScanNet data set as its exporter writes it: folders of images and of poses with the same numbers.

use super::pieces::{self, Gathered, by_number, depths};
use crate::input::InputError;
use crate::recorded::folder::{read as text, shown};
use crate::recorded::picture;
use crate::recorded::pose;
use crate::recorded::reading::Conventions;
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Stated};
use std::path::Path;

/// Units of a depth image in a metre. From: the data set's page on its format (`depthShift`).
const DEPTH_SCALE: f64 = 1000.0;

pub(super) fn is(path: &Path) -> bool {
    path.join("pose").is_dir() && path.join("depth").is_dir()
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let depths = depths(&folder.join("depth"))?;
    let colours = by_number(pieces::images(&folder.join("color"))?);
    let mut notes = Vec::new();
    let camera = camera(folder, asked, &depths[0].1, &mut notes)?;
    let mut gathered = Gathered::default();
    for (name, depth) in depths {
        let file = folder.join("pose").join(format!("{name}.txt"));
        if !file.is_file() {
            gathered.without_pose();
            continue;
        }
        let pose = pose::matrix_pose(&shown(&file), &text(&file)?)?;
        let colour = pieces::number(&name).and_then(|n| colours.get(&n)).cloned();
        gathered.add(name, camera, pose, (depth, colour));
    }
    notes.extend(gathered.notes());
    Ok(Stated {
        frames: gathered.frames,
        images: Box::new(gathered.files),
        reading: Conventions::usual(DEPTH_SCALE),
        whole: true,
        registered: false,
        up: None,
        notes,
    })
}

/// Camera that the user gives, or that of `intrinsic/intrinsic_depth.txt`, a matrix of 4x4 or 3x3.
fn camera(
    folder: &Path,
    asked: &Asked,
    depth: &Path,
    notes: &mut Vec<String>,
) -> Result<CameraSettings, InputError> {
    let file = folder.join("intrinsic").join("intrinsic_depth.txt");
    if asked.camera.is_some() || !file.is_file() {
        return pieces::camera(folder, asked, depth, None, notes);
    }
    let content = text(&file)?;
    let rows = pose::rows(&shown(&file), &content)?;
    let row = |r: usize, c: usize| rows.get(r).and_then(|(_, row)| row.get(c).copied());
    let (Some(fx), Some(fy), Some(cx), Some(cy)) = (row(0, 0), row(1, 1), row(0, 2), row(1, 2)) else {
        let problem = "expected a matrix with fx 0 cx in its first line and 0 fy cy in its second";
        return Err(InputError::at(
            &shown(&file),
            &content,
            0,
            problem,
            "write the camera of the depth images",
        ));
    };
    pieces::fitting(CameraSettings { fx, fy, cx, cy }, picture::size_of(depth)?, &shown(&file))
}
