//! 7-Scenes: frames side by side, whose camera is stated on the data set's page alone.

use super::pieces::{self, Gathered};
use crate::input::InputError;
use crate::recorded::folder::{CAMERA_FILE, names, read as text, shown};
use crate::recorded::pose;
use crate::recorded::reading::Conventions;
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Stated};
use std::path::Path;

const DEPTH: &str = ".depth.png";
/// Units of a depth image in a metre. From: the data set's page.
const DEPTH_SCALE: f64 = 1000.0;
/// Camera of the data set's depth images. From: the data set's page.
const KINECT: CameraSettings = CameraSettings { fx: 585.0, fy: 585.0, cx: 320.0, cy: 240.0 };

/// True for a folder with 7-Scenes frames and without a camera file; with one, the folder is in descry's own
/// layout.
pub(super) fn is(path: &Path) -> bool {
    !path.join(CAMERA_FILE).is_file()
        && names(path).is_ok_and(|names| names.iter().any(|name| frame(name).is_some()))
}

/// Name of the frame of a depth image file: `frame-` and six digits; `None` for other files.
fn frame(name: &str) -> Option<&str> {
    let stem = name.strip_suffix(DEPTH)?;
    let digits = stem.strip_prefix("frame-")?;
    (digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_digit())).then_some(stem)
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let names = names(folder)?;
    let stems: Vec<&str> = names.iter().filter_map(|name| frame(name)).collect();
    let Some(first) = stems.first() else {
        let problem = "no depth images";
        return Err(InputError::whole(shown(folder), problem, "frame-000000.depth.png is expected there"));
    };
    let mut notes = Vec::new();
    let first = folder.join(format!("{first}{DEPTH}"));
    let whose = "the Kinect of the data set (585 585 320 240)";
    let camera = pieces::camera(folder, asked, &first, Some((KINECT, whose)), &mut notes)?;
    let mut gathered = Gathered::default();
    for stem in stems {
        let file = folder.join(format!("{stem}.pose.txt"));
        if !file.is_file() {
            gathered.without_pose();
            continue;
        }
        let pose = pose::matrix_pose(&shown(&file), &text(&file)?)?;
        let colour = Some(folder.join(format!("{stem}.color.png"))).filter(|path| path.is_file());
        gathered.add(stem.to_string(), camera, pose, (folder.join(format!("{stem}{DEPTH}")), colour));
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
