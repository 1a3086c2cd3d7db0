//! Pieces that several layouts share: folders of images, matrices, JSON, the camera.

use crate::input::InputError;
use crate::recorded::folder::{CAMERA_FILE, names, read, shown, stem};
use crate::recorded::picture;
use crate::recorded::pose;
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Files, StatedFrame};
use nalgebra::Isometry3;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// File extensions of colour images.
const COLOURS: [&str; 3] = ["png", "jpg", "jpeg"];

/// Images in a folder in natural order, each by its name without extension and its path; empty for a missing
/// folder.
pub(super) fn images(folder: &Path) -> Result<Vec<(String, PathBuf)>, InputError> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let ending = |n: &str| Path::new(n).extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
    let is_image = |n: &String| ending(n).is_some_and(|e| COLOURS.contains(&e.as_str()) || e == "pgm");
    let found = names(folder)?.into_iter().filter(is_image);
    Ok(found.map(|name| (stem(&name).to_string(), folder.join(name))).collect())
}

/// First existing folder among the named ones; the first name if none exists.
pub(super) fn either(folder: &Path, names: &[&str]) -> PathBuf {
    let found = names.iter().map(|name| folder.join(name)).find(|path| path.is_dir());
    found.unwrap_or_else(|| folder.join(names[0]))
}

/// Depth images of a folder, as [`images`]; an error if there are none.
pub(super) fn depths(folder: &Path) -> Result<Vec<(String, PathBuf)>, InputError> {
    let found = images(folder)?;
    if found.is_empty() {
        let problem = "no depth images";
        return Err(InputError::whole(shown(folder), problem, "16-bit PNG files are expected there"));
    }
    Ok(found)
}

/// Images by the number at the end of their names, by which they belong to images in other folders.
pub(super) fn by_number(images: Vec<(String, PathBuf)>) -> BTreeMap<u64, PathBuf> {
    images.into_iter().filter_map(|(name, path)| Some((number(&name)?, path))).collect()
}

/// Number at the end of a name: 12 of `frame000012`; `None` without one.
pub(super) fn number(name: &str) -> Option<u64> {
    let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    name[name.len() - digits..].parse().ok()
}

/// Camera that the user gives, or that of a file beside the frames, or else the data set's default, which
/// holds for images of [`USUAL_SIZE`].
pub(super) fn camera(
    folder: &Path,
    asked: &Asked,
    depth: &Path,
    usual: Option<(CameraSettings, &str)>,
    notes: &mut Vec<String>,
) -> Result<CameraSettings, InputError> {
    let size = picture::size_of(depth)?;
    if let Some(camera) = asked.camera {
        return fitting(camera, size, "--camera");
    }
    let file = folder.join(CAMERA_FILE);
    if file.is_file() {
        return pose::camera_matrix(&shown(&file), &read(&file)?, size);
    }
    match usual {
        Some((camera, whose)) if size == USUAL_SIZE => {
            notes.push(format!("the folder does not say which camera took the frames: taken as {whose}"));
            Ok(camera)
        }
        _ => Err(InputError::whole(
            shown(folder),
            format!("nothing says which camera took the frames of {}x{} pixels", size.0, size.1),
            format!(
                "give it in pixels as --camera FX,FY,CX,CY, or add {CAMERA_FILE} (fx 0 cx / 0 fy cy / 0 0 1)"
            ),
        )),
    }
}

/// Image size for which a data set's default camera holds, columns and rows: that of the first consumer depth
/// cameras.
const USUAL_SIZE: (usize, usize) = (640, 480);

/// Checks that the focal lengths are positive and the principal point lies in an image of this size, columns
/// and rows.
pub(super) fn fitting(
    camera: CameraSettings,
    size: (usize, usize),
    place: &str,
) -> Result<CameraSettings, InputError> {
    let finite = [camera.fx, camera.fy].into_iter().all(|f| f.is_finite() && f > 0.0);
    let problem = match camera.off_image(size) {
        _ if !finite => {
            format!("focal lengths of {} and {}, expected pixels above zero", camera.fx, camera.fy)
        }
        Some((_, problem)) => problem,
        None => return Ok(camera),
    };
    Err(InputError::whole(place, problem, "give the camera of the depth images"))
}

/// Reads a JSON file; a syntax error is displayed with its line.
pub(super) fn json<T: DeserializeOwned>(file: &Path) -> Result<T, InputError> {
    let text = read(file)?;
    serde_json::from_str(&text).map_err(|e| {
        let start: usize = text.split_inclusive('\n').take(e.line().saturating_sub(1)).map(str::len).sum();
        let byte = start + e.column().saturating_sub(1);
        InputError::at(&shown(file), &text, byte, e.to_string(), "write what this layout defines")
    })
}

/// Pose from the sixteen numbers of a 4x4 matrix, row by row; `None` if one is not finite.
pub(super) fn pose_of(place: &str, rows: &[f64]) -> Result<Option<Isometry3<f64>>, InputError> {
    let text: Vec<String> = rows.chunks(4).map(|r| format!("{} {} {} {}", r[0], r[1], r[2], r[3])).collect();
    pose::matrix_pose(place, &text.join("\n"))
}

/// Frames whose pose is known, with their images, and the number of the others.
#[derive(Default)]
pub(super) struct Gathered {
    pub frames: Vec<StatedFrame>,
    pub files: Files,
    lost: usize,
    unposed: usize,
}

impl Gathered {
    /// Adds a frame; without a pose, the frame is only counted as lost by tracking.
    pub(super) fn add(
        &mut self,
        name: String,
        camera: CameraSettings,
        pose: Option<Isometry3<f64>>,
        files: (PathBuf, Option<PathBuf>),
    ) {
        match pose {
            Some(pose) => {
                self.frames.push(StatedFrame { name, camera, pose });
                self.files.0.push(files);
            }
            None => self.lost += 1,
        }
    }

    /// Counts a frame to which no pose belongs.
    pub(super) fn without_pose(&mut self) {
        self.unposed += 1;
    }

    /// Notes on frames that were left out.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.lost > 0 {
            notes.push(format!(
                "{} frames are left out: tracking was lost (their poses are not finite)",
                self.lost
            ));
        }
        if self.unposed > 0 {
            notes.push(format!("{} frames are left out: no pose belongs to them", self.unposed));
        }
        notes
    }
}
