//! Recording as a folder of depth frames with poses, in descry's own layouts.

use crate::input::InputError;
use crate::recorded::picture;
use crate::recorded::pose::{self, MaybePose};
use crate::recorded::settings::{CameraSettings, Settings};
use descry_perception::Intrinsics;
use image::RgbImage;
use nalgebra::Isometry3;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the settings file.
pub(crate) const SETTINGS_FILE: &str = "recording.toml";
/// Name of the file with the camera matrix.
pub(crate) const CAMERA_FILE: &str = "camera-intrinsics.txt";
const DEPTH_SUFFIX: &str = ".depth.png";
const POSE_SUFFIX: &str = ".pose.txt";
const COLOUR_SUFFIXES: [&str; 3] = [".color.jpg", ".color.jpeg", ".color.png"];
const LIST_DEPTH_ENDINGS: [&str; 2] = ["pgm", "png"];
const LIST_COLOUR_ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// Maximum median distance of the frames' poses from the first pose, metres.
const FARTHEST_TYPICAL_M: f64 = 100.0;

/// A frame on disk with its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredFrame {
    /// Name of the frame and of its station.
    pub name: String,
    /// Depth image, 16 bits a pixel.
    pub depth: PathBuf,
    /// Colour image, if there is one.
    pub colour: Option<PathBuf>,
    /// Pose of the camera's optical frame in the world of the recording, metres.
    pub world_from_camera: Isometry3<f64>,
}

/// A folder of frames, checked; pixels are read on demand.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Name for people.
    pub name: String,
    /// Frames, at least one, in natural order of their names (numbers by value).
    pub frames: Vec<StoredFrame>,
    /// The depth camera.
    pub intrinsics: Intrinsics,
    /// Index in `frames` of the station where the body starts.
    pub start: usize,
    /// Contents of `recording.toml`.
    pub settings: Settings,
    /// Names of the frames without a pose because tracking was lost; they are not stations.
    pub lost: Vec<String>,
}

/// A frame whose pose may be missing.
struct Candidate {
    name: String,
    depth: PathBuf,
    colour: Option<PathBuf>,
    pose: MaybePose,
}

impl Recording {
    /// Opens a folder of frames, or a `recording.toml` that names one.
    ///
    /// # Errors
    /// A missing or invalid part, with the file, the line, the expectation and a fix.
    pub fn open(path: &Path) -> Result<Recording, InputError> {
        let (folder, settings) = find(path)?;
        let candidates =
            if folder.join("depth").is_dir() { listed(&folder)? } else { side_by_side(&folder)? };
        let (mut frames, mut lost) = (Vec::new(), Vec::new());
        for c in candidates {
            match c.pose {
                Some(world_from_camera) => frames.push(StoredFrame {
                    name: c.name,
                    depth: c.depth,
                    colour: c.colour,
                    world_from_camera,
                }),
                None => {
                    tracing::warn!(
                        frame = c.name,
                        "its pose is not finite: tracking was lost, so this is no station"
                    );
                    lost.push(c.name);
                }
            }
        }
        let Some(first) = frames.first() else {
            return Err(InputError::whole(
                shown(&folder),
                "no frame has a pose of finite numbers",
                "record again; a body needs at least one place to stand",
            ));
        };
        let size = picture::size_of(&first.depth)?;
        for frame in &frames[1..] {
            let other = picture::size_of(&frame.depth)?;
            if other != size {
                return Err(InputError::whole(
                    shown(&frame.depth),
                    format!("{}x{} pixels where the first frame has {}x{}", other.0, other.1, size.0, size.1),
                    "keep frames of one camera in one folder",
                ));
            }
        }
        check_distances(&folder, frames.iter().map(|f| (f.name.as_str(), &f.world_from_camera)))?;
        let camera = camera(&folder, &settings, size)?;
        let intrinsics = camera.with_size(size);
        let start = start_of(&frames, &settings, path)?;
        let own_name = folder.file_name().map(|n| n.to_string_lossy().into_owned());
        let name = settings.name.clone().or(own_name).unwrap_or_else(|| shown(&folder));
        Ok(Recording { name, frames, intrinsics, start, settings, lost })
    }

    /// Depths along z of a frame, metres, row by row; NaN without a return.
    ///
    /// # Errors
    /// If the file cannot be read or is not a 16-bit image.
    pub fn depth_m(&self, frame: &StoredFrame) -> Result<Vec<f32>, InputError> {
        let scale = self.settings.depth_scale;
        let metres = |d: f32| match (f64::from(d) / scale) as f32 {
            z if z.is_finite() && z > 0.0 => z,
            _ => f32::NAN,
        };
        Ok(picture::depth(&frame.depth)?.units.into_iter().map(metres).collect())
    }

    /// The colour image of a frame, if there is one.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn colour(&self, frame: &StoredFrame) -> Result<Option<RgbImage>, InputError> {
        frame.colour.as_deref().map(picture::colour).transpose()
    }
}

pub(crate) fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// Reads a text file.
pub(crate) fn read(path: &Path) -> Result<String, InputError> {
    crate::input::read_text(path).map_err(|e| {
        InputError::whole(shown(path), format!("cannot be read: {e}"), "a text file is expected here")
    })
}

/// Finds the folder of the frames, and reads its settings.
fn find(path: &Path) -> Result<(PathBuf, Settings), InputError> {
    let (folder, file) = if path.is_dir() {
        (path.to_path_buf(), path.join(SETTINGS_FILE))
    } else if path.is_file() {
        (path.parent().unwrap_or(Path::new(".")).to_path_buf(), path.to_path_buf())
    } else {
        let mend = format!("give a folder of frames or a {SETTINGS_FILE}");
        return Err(InputError::whole(shown(path), "there is no such folder", mend));
    };
    if !file.is_file() {
        return Ok((folder, Settings::default()));
    }
    let text = read(&file)?;
    let settings = Settings::parse(&shown(&file), &text)?;
    let folder = settings.folder.as_ref().map_or(folder.clone(), |f| folder.join(f));
    if !folder.is_dir() {
        let at = text.find("folder").unwrap_or(0);
        let problem = format!("there is no folder {}", folder.display());
        return Err(InputError::at(&shown(&file), &text, at, problem, "write it as seen from this file"));
    }
    Ok((folder, settings))
}

/// Names of the entries of a folder in natural order: `9` before `10`.
pub(crate) fn names(folder: &Path) -> Result<Vec<String>, InputError> {
    let listed = fs::read_dir(folder).and_then(|entries| {
        entries
            .map(|e| e.map(|e| e.file_name().to_string_lossy().into_owned()))
            .collect::<Result<Vec<_>, _>>()
    });
    let mut names = listed.map_err(|e| {
        InputError::whole(shown(folder), format!("cannot be listed: {e}"), "a folder of frames is expected")
    })?;
    names.sort_by(|a, b| by_number(a).cmp(&by_number(b)).then_with(|| a.cmp(b)));
    Ok(names)
}

/// Key for natural order: alternating text and numbers.
fn by_number(name: &str) -> Vec<(String, u128)> {
    let mut pieces = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let text_end = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, after) = rest.split_at(text_end);
        let digits_end = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        let (digits, after) = after.split_at(digits_end);
        pieces.push((text.to_string(), digits.parse().unwrap_or(0)));
        rest = after;
    }
    pieces
}

fn side_by_side(folder: &Path) -> Result<Vec<Candidate>, InputError> {
    let names = names(folder)?;
    let stems: Vec<&str> = names.iter().filter_map(|n| n.strip_suffix(DEPTH_SUFFIX)).collect();
    if stems.is_empty() {
        return Err(InputError::whole(
            shown(folder),
            "no frames: neither NAME.depth.png files nor a folder depth/",
            "give the folder that holds NAME.depth.png with NAME.pose.txt, or depth/NAME.pgm with pose.txt, or a recording in a layout that \
             `descry import --help` lists",
        ));
    }
    let alone = names.iter().filter_map(|n| n.strip_suffix(POSE_SUFFIX)).find(|n| !stems.contains(n));
    if let Some(stem) = alone {
        return Err(InputError::whole(
            shown(&folder.join(format!("{stem}{POSE_SUFFIX}"))),
            format!("a pose without a frame {stem}{DEPTH_SUFFIX}"),
            "add the frame or remove the pose",
        ));
    }
    stems
        .into_iter()
        .map(|stem| {
            let pose_file = folder.join(format!("{stem}{POSE_SUFFIX}"));
            if !pose_file.is_file() {
                return Err(InputError::whole(
                    shown(&folder.join(format!("{stem}{DEPTH_SUFFIX}"))),
                    format!("its pose {stem}{POSE_SUFFIX} is missing"),
                    "add it (4x4 world_from_camera, metres) or remove the frame",
                ));
            }
            let colour =
                COLOUR_SUFFIXES.iter().map(|s| folder.join(format!("{stem}{s}"))).find(|p| p.is_file());
            Ok(Candidate {
                name: stem.to_string(),
                depth: folder.join(format!("{stem}{DEPTH_SUFFIX}")),
                colour,
                pose: pose::matrix_pose(&shown(&pose_file), &read(&pose_file)?)?,
            })
        })
        .collect()
}

fn listed(folder: &Path) -> Result<Vec<Candidate>, InputError> {
    let depth = folder.join("depth");
    let ends = |name: &str| Path::new(name).extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
    let is_depth = |n: &String| ends(n).is_some_and(|e| LIST_DEPTH_ENDINGS.contains(&e.as_str()));
    let files: Vec<String> = names(&depth)?.into_iter().filter(is_depth).collect();
    let pose_file = folder.join("pose.txt");
    if !pose_file.is_file() {
        return Err(InputError::whole(
            shown(&pose_file),
            "there is no such file",
            "add it: a line tx ty tz qx qy qz qw for each frame of depth/",
        ));
    }
    for pair in files.windows(2) {
        if stem(&pair[0]) == stem(&pair[1]) {
            return Err(InputError::whole(
                shown(&depth),
                format!("{} and {} are both frame {}", pair[0], pair[1], stem(&pair[0])),
                "remove one of them",
            ));
        }
    }
    let text = read(&pose_file)?;
    let poses = pose::listed_poses(&shown(&pose_file), &text)?;
    if poses.len() != files.len() {
        return Err(InputError::at(
            &shown(&pose_file),
            &text,
            text.trim_end().len(),
            format!("{} poses for {} frames in depth/", poses.len(), files.len()),
            "write one line a frame, in the order of the frames' names",
        ));
    }
    let candidate = |(file, pose): (String, MaybePose)| {
        let stem = stem(&file).to_string();
        let colour = LIST_COLOUR_ENDINGS
            .iter()
            .map(|e| folder.join("color").join(format!("{stem}.{e}")))
            .find(|p| p.is_file());
        Candidate { name: stem, depth: depth.join(&file), colour, pose }
    };
    Ok(files.into_iter().zip(poses).map(candidate).collect())
}

/// Name of a file without its extension; the whole name if it has none.
pub(crate) fn stem(file: &str) -> &str {
    Path::new(file).file_stem().and_then(OsStr::to_str).unwrap_or(file)
}

/// Rejects poses whose median distance from the first is larger than a building: they are probably not in
/// metres.
pub(crate) fn check_distances<'a>(
    folder: &Path,
    mut poses: impl Iterator<Item = (&'a str, &'a Isometry3<f64>)>,
) -> Result<(), InputError> {
    let Some((first, from)) = poses.next() else { return Ok(()) };
    let mut distances_m: Vec<f64> =
        poses.map(|(_, pose)| (pose.translation.vector - from.translation.vector).norm()).collect();
    distances_m.sort_unstable_by(f64::total_cmp);
    match distances_m.get(distances_m.len() / 2) {
        Some(&median_m) if median_m > FARTHEST_TYPICAL_M => Err(InputError::whole(
            shown(folder),
            format!(
                "the poses lie {median_m:.0} m from that of frame {first} (the median), expected {FARTHEST_TYPICAL_M} m at most"
            ),
            "are they in metres? write translations in metres, not in millimetres",
        )),
        _ => Ok(()),
    }
}

fn camera(folder: &Path, settings: &Settings, size: (usize, usize)) -> Result<CameraSettings, InputError> {
    if let Some(camera) = settings.camera {
        let wrong = |(_, problem): (usize, String)| {
            InputError::whole(
                shown(folder),
                format!("[camera]: {problem}"),
                "give the camera of these frames",
            )
        };
        return camera.off_image(size).map_or(Ok(camera), |off| Err(wrong(off)));
    }
    let file = folder.join(CAMERA_FILE);
    if file.is_file() {
        return pose::camera_matrix(&shown(&file), &read(&file)?, size);
    }
    let (columns, rows) = size;
    Err(InputError::whole(
        shown(folder),
        "nothing says which camera took the frames",
        format!(
            "add {CAMERA_FILE} (fx 0 cx / 0 fy cy / 0 0 1), or a {SETTINGS_FILE} with the lines\n\n  [camera]\n  fx = ...\n  fy = ...\n  cx = ...\n  cy = ...\n\n\
             in the folder or elsewhere (then with the line folder = \"...\" first, and opened by its own name). The figures are those of the \
             camera's calibration for images of {columns}x{rows} pixels, in pixels; its driver or data sheet states them"
        ),
    ))
}

fn start_of(frames: &[StoredFrame], settings: &Settings, path: &Path) -> Result<usize, InputError> {
    let Some(wanted) = &settings.start else { return Ok(0) };
    frames.iter().position(|f| &f.name == wanted).ok_or_else(|| {
        InputError::whole(
            shown(path),
            format!("start = \"{wanted}\" is no frame of this recording"),
            format!("one of: {}", frames.iter().map(|f| f.name.as_str()).collect::<Vec<_>>().join(", ")),
        )
    })
}
