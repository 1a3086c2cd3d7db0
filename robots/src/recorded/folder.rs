//! Finding the frames of a recording on disk.

use crate::input::InputError;
use crate::recorded::pose::{self, MaybePose};
use crate::recorded::settings::{CameraSettings, Settings};
use descry_perception::Intrinsics;
use image::{ImageReader, RgbImage};
use nalgebra::Isometry3;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the file that says what a folder does not.
const SETTINGS_FILE: &str = "recording.toml";
/// Name of the file with the camera matrix.
const CAMERA_FILE: &str = "camera-intrinsics.txt";
const DEPTH_SUFFIX: &str = ".depth.png";
const POSE_SUFFIX: &str = ".pose.txt";
const COLOUR_SUFFIXES: [&str; 3] = [".color.jpg", ".color.jpeg", ".color.png"];
const LIST_DEPTH_ENDINGS: [&str; 2] = ["pgm", "png"];
const LIST_COLOUR_ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// A frame on disk and where it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredFrame {
    /// The station's name.
    pub name: String,
    /// 16 bits a pixel.
    pub depth: PathBuf,
    /// If there is one.
    pub colour: Option<PathBuf>,
    /// Where the camera was.
    pub world_from_camera: Isometry3<f64>,
}

/// A folder of frames, found and checked; pixels are read when they are asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// For people.
    pub name: String,
    /// In the order of their names (numbers by value). At least one.
    pub frames: Vec<StoredFrame>,
    /// The depth camera.
    pub intrinsics: Intrinsics,
    /// Index of the first station.
    pub start: usize,
    /// What `recording.toml` says.
    pub settings: Settings,
    /// Frames without a pose because tracking was lost: they are no stations.
    pub lost: Vec<String>,
}

/// A frame before its pose is known to exist.
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
    /// What is missing or wrong: the file, the line, what was expected, what to add.
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
        let size = size_of(&first.depth)?;
        for frame in &frames[1..] {
            let other = size_of(&frame.depth)?;
            if other != size {
                return Err(InputError::whole(
                    shown(&frame.depth),
                    format!("{}x{} pixels where the first frame has {}x{}", other.0, other.1, size.0, size.1),
                    "keep frames of one camera in one folder",
                ));
            }
        }
        let camera = camera(&folder, &settings)?;
        let intrinsics = Intrinsics {
            width: size.0,
            height: size.1,
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
        };
        let start = start_of(&frames, &settings, path)?;
        let own_name = folder.file_name().map(|n| n.to_string_lossy().into_owned());
        let name = settings.name.clone().or(own_name).unwrap_or_else(|| shown(&folder));
        Ok(Recording { name, frames, intrinsics, start, settings, lost })
    }

    /// Depths along z of a frame, metres, row by row; NaN where nothing returned.
    ///
    /// # Errors
    /// If the file cannot be read or holds no 16-bit image.
    pub fn depth_m(&self, frame: &StoredFrame) -> Result<Vec<f32>, InputError> {
        let image = decode(&frame.depth)?;
        let image::DynamicImage::ImageLuma16(image) = image else {
            return Err(InputError::whole(
                shown(&frame.depth),
                format!("{:?} pixels, expected one channel of 16 bits", image.color()),
                "store depth as 16-bit grey",
            ));
        };
        let scale = self.settings.depth_scale;
        let metres = |&d: &u16| match d {
            0 | u16::MAX => f32::NAN,
            d => (f64::from(d) / scale) as f32,
        };
        let metres = |d: &u16| match metres(d) {
            z if z.is_finite() && z > 0.0 => z,
            _ => f32::NAN,
        };
        Ok(image.as_raw().iter().map(metres).collect())
    }

    /// The colour image of a frame, if there is one.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn colour(&self, frame: &StoredFrame) -> Result<Option<RgbImage>, InputError> {
        frame.colour.as_deref().map(|path| Ok(decode(path)?.into_rgb8())).transpose()
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

fn read(path: &Path) -> Result<String, InputError> {
    fs::read_to_string(path).map_err(|e| {
        InputError::whole(shown(path), format!("cannot be read: {e}"), "a text file is expected here")
    })
}

/// The folder of the frames and what is said about it.
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

/// Names in a folder in the order in which people count: `9` before `10`.
fn names(folder: &Path) -> Result<Vec<String>, InputError> {
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

/// A name in pieces: text, then the value of the digits that follow, and so on.
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
            "give the folder that holds NAME.depth.png with NAME.pose.txt, or depth/NAME.pgm with pose.txt",
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
        let stem = Path::new(&file).file_stem().and_then(OsStr::to_str).unwrap_or(&file).to_string();
        let colour = LIST_COLOUR_ENDINGS
            .iter()
            .map(|e| folder.join("color").join(format!("{stem}.{e}")))
            .find(|p| p.is_file());
        Candidate { name: stem, depth: depth.join(&file), colour, pose }
    };
    Ok(files.into_iter().zip(poses).map(candidate).collect())
}

fn camera(folder: &Path, settings: &Settings) -> Result<CameraSettings, InputError> {
    if let Some(camera) = settings.camera {
        return Ok(camera);
    }
    let file = folder.join(CAMERA_FILE);
    if file.is_file() {
        return pose::camera_matrix(&shown(&file), &read(&file)?);
    }
    Err(InputError::whole(
        shown(folder),
        "nothing says which camera took the frames",
        format!(
            "add {CAMERA_FILE} (3x3), or a {SETTINGS_FILE} with the lines\n\n  [camera]\n  fx = 525.0\n  fy = 525.0\n  cx = 319.5\n  cy = 239.5\n\n\
             in the folder or elsewhere (then with the line folder = \"...\" first, and opened by its own name); these are the usual figures of a Kinect"
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

fn size_of(path: &Path) -> Result<(usize, usize), InputError> {
    let size = open(path)?.into_dimensions().map_err(|e| no_image(path, &e))?;
    Ok((size.0 as usize, size.1 as usize))
}

fn decode(path: &Path) -> Result<image::DynamicImage, InputError> {
    open(path)?.decode().map_err(|e| no_image(path, &e))
}

fn open(path: &Path) -> Result<ImageReader<std::io::BufReader<fs::File>>, InputError> {
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    reader.map_err(|e| InputError::whole(shown(path), format!("cannot be read: {e}"), "an image is expected"))
}

fn no_image(path: &Path, e: &image::ImageError) -> InputError {
    InputError::whole(shown(path), format!("is no image: {e}"), "store it again as PNG, JPEG or PGM")
}
