//! Import of recordings in published layouts: resolves units, selects frames, and gives a robot or a
//! recording in descry's own layout.

use crate::body::Colour;
use crate::input::InputError;
use crate::recorded::folder::{CAMERA_FILE, SETTINGS_FILE, check_distances, shown};
use crate::recorded::footage::Footage;
use crate::recorded::layouts::{self, Asked, Layout, Stated};
use crate::recorded::picture::RawDepth;
use crate::recorded::reading::{self, Conventions, Given};
use crate::recorded::settings::{CameraSettings, Settings};
use crate::recorded::stated::pairs;
use crate::request::Pixels;
use descry_perception::Intrinsics;
use image::{ImageBuffer, Luma};
use nalgebra::{Isometry3, Vector3};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Default minimum distance between selected frames, metres. From: chosen.
pub const SPACING_M: f64 = 0.2;
/// Typical distance of the scene, metres, by which a rotation of the camera counts as a displacement.
/// From: chosen.
const LEVER_M: f64 = 0.6;
/// Maximum angle between the stated up and the mean upward direction of the images, radians; beyond it the
/// stated up is dropped. From: chosen, that of perception.
const HELD_RAD: f64 = 1.2;
/// Distance of the first pose from the origin, metres, beyond which all positions are recentred, since single
/// precision blurs large coordinates. From: chosen.
const FARTHEST_M: f64 = 100.0;
/// Units in a metre of depth images that are converted from floating point: steps of half a millimetre, up to
/// 32 m.
const FINE_SCALE: f64 = 2000.0;

/// Choices of the user.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Facts that the user gives because the folder does not state them.
    pub asked: Asked,
    /// Units and conventions that the user gives.
    pub given: Given,
    /// Minimum distance between selected frames, metres; 0 keeps all, `None` means [`SPACING_M`].
    pub spacing_m: Option<f64>,
}

/// A recording in a published layout, with its units resolved and its frames selected.
pub struct Imported {
    /// Name for people.
    pub name: String,
    /// Published layout of the files.
    pub layout: &'static Layout,
    /// Units and conventions of the numbers in the files.
    pub reading: Conventions,
    /// Selected frames.
    pub frames: Vec<ImportedFrame>,
    /// Depth camera of all frames.
    pub intrinsics: Intrinsics,
    /// Settings of the recording in descry's own layout.
    pub settings: Settings,
    /// Notes for people: reasons, assumptions, frames that were left out.
    pub notes: Vec<String>,
    stated: Stated,
}

/// A selected frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedFrame {
    /// Name of the station.
    pub name: String,
    /// Pose of the camera's optical frame in the world, metres.
    pub world_from_camera: Isometry3<f64>,
    index: usize,
}

impl Imported {
    /// Reads a recording in a published layout.
    ///
    /// # Errors
    /// An unknown layout, a missing or broken part, or units that remain ambiguous: with the place and a fix.
    pub fn open(path: &Path, options: &Options) -> Result<Imported, InputError> {
        let (layout, stated) = layouts::read(path, &options.asked)?;
        let mut notes = stated.notes.clone();
        let doubt = |(problem, mend)| InputError::whole(shown(path), problem, mend);
        let (reading, note) =
            reading::settle(&stated.reading, &options.given, &pairs(&stated)?).map_err(doubt)?;
        notes.push(note);
        let mut poses: Vec<Isometry3<f64>> =
            stated.frames.iter().map(|f| reading.world_from_camera(&f.pose)).collect();
        notes.extend(recentre(&mut poses));
        let up = stated.up.filter(|up| are_held_upright(&poses, up));
        if stated.up != up {
            notes.push("the frame of the poses should have z up by its name, but the cameras are not held so: up is told from the views".into());
        }
        check_distances(path, poses.iter().zip(&stated.frames).map(|(pose, f)| (f.name.as_str(), pose)))?;
        let kept = spaced(&poses, options.spacing_m.unwrap_or(SPACING_M));
        if kept.len() < poses.len() {
            notes.push(format!(
                "{} of {} frames are kept: the others show what these show",
                kept.len(),
                poses.len()
            ));
        }
        let frame = |&index: &usize| ImportedFrame {
            name: stated.frames[index].name.clone(),
            world_from_camera: poses[index],
            index,
        };
        let frames: Vec<ImportedFrame> = kept.iter().map(frame).collect();
        let first = stated.images.depth(kept[0])?;
        let camera = stated.frames[kept[0]].camera;
        let own = path.canonicalize().ok().and_then(|p| Some(p.file_stem()?.to_string_lossy().into_owned()));
        let name = own.unwrap_or_else(|| shown(path));
        let settings = Settings {
            name: Some(name.clone()),
            depth_scale: if stated.whole { reading.depth_scale } else { FINE_SCALE },
            up,
            registered: stated.registered,
            camera: Some(camera),
            ..Settings::default()
        };
        let intrinsics = camera.with_size((first.width, first.height));
        Ok(Imported { name, layout, reading, frames, intrinsics, settings, notes, stated })
    }

    /// Depth image of a frame, resampled to the common camera, in the units of the files.
    fn depth(&self, frame: &ImportedFrame) -> Result<RawDepth, InputError> {
        let depth = self.stated.images.depth(frame.index)?;
        let size = (self.intrinsics.width, self.intrinsics.height);
        if (depth.width, depth.height) != size {
            return Err(InputError::whole(
                &frame.name,
                format!(
                    "{}x{} pixels where the first frame has {}x{}",
                    depth.width, depth.height, size.0, size.1
                ),
                "keep frames of one camera in one recording",
            ));
        }
        Ok(self.resampled(depth, &self.stated.frames[frame.index].camera))
    }

    /// True if a frame has the common camera, so that its files can be copied unchanged.
    fn is_verbatim(&self, frame: &ImportedFrame) -> bool {
        Some(self.stated.frames[frame.index].camera) == self.settings.camera
    }

    /// Resamples a depth image of the camera `from` to the common camera at the same place; pixels outside
    /// become NaN.
    fn resampled(&self, depth: RawDepth, from: &CameraSettings) -> RawDepth {
        if Some(*from) == self.settings.camera {
            return depth;
        }
        let from = from.with_size((depth.width, depth.height));
        let unit = |pixel: usize| {
            let (column, row) = ((pixel % depth.width) as f64, (pixel / depth.width) as f64);
            let there = from.project(&self.intrinsics.unproject(column, row, 1.0));
            there.and_then(|(u, v)| from.pixel(u, v)).map_or(f32::NAN, |pixel| depth.units[pixel])
        };
        RawDepth { units: (0..depth.units.len()).map(unit).collect(), ..depth }
    }

    /// Writes the selected frames in descry's own layout into a new or empty folder; `progress` receives the
    /// numbers of frames written and of all frames.
    ///
    /// # Errors
    /// If the folder holds something, cannot be written, or a frame cannot be read.
    pub fn write(&self, into: &Path, progress: &mut dyn FnMut(usize, usize)) -> Result<(), InputError> {
        let failed = |path: &Path, e: std::io::Error| {
            InputError::whole(
                shown(path),
                format!("cannot be written: {e}"),
                "choose a folder that can be written",
            )
        };
        fs::create_dir_all(into).map_err(|e| failed(into, e))?;
        if fs::read_dir(into).map_err(|e| failed(into, e))?.next().is_some() {
            return Err(InputError::whole(shown(into), "is not empty", "choose a new folder"));
        }
        for (done, frame) in self.frames.iter().enumerate() {
            progress(done, self.frames.len());
            self.write_frame(into, frame).map_err(|e| match e {
                Failed::Input(e) => e,
                Failed::Output(path, e) => failed(&path, e),
            })?;
        }
        let CameraSettings { fx, fy, cx, cy } = self.settings.camera.unwrap_or(CameraSettings {
            fx: self.intrinsics.fx,
            fy: self.intrinsics.fy,
            cx: self.intrinsics.cx,
            cy: self.intrinsics.cy,
        });
        let matrix = format!("{fx} 0 {cx}\n0 {fy} {cy}\n0 0 1\n");
        for (name, text) in [(CAMERA_FILE, matrix), (SETTINGS_FILE, self.settings_text())] {
            let path = into.join(name);
            fs::write(&path, text).map_err(|e| failed(&path, e))?;
        }
        progress(self.frames.len(), self.frames.len());
        Ok(())
    }

    fn write_frame(&self, into: &Path, frame: &ImportedFrame) -> Result<(), Failed> {
        let path = |ending: &str| into.join(format!("{}.{ending}", frame.name));
        let m = frame.world_from_camera.to_homogeneous();
        let mut pose = String::new();
        for row in m.row_iter() {
            let _ = writeln!(pose, "{} {} {} {}", row[0], row[1], row[2], row[3]);
        }
        let out = |path: std::path::PathBuf| move |e| Failed::Output(path, e);
        fs::write(path("pose.txt"), pose).map_err(out(path("pose.txt")))?;
        let files = self.stated.images.files(frame.index).filter(|_| self.is_verbatim(frame));
        let ending = |p: &Path| p.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let depth = path("depth.png");
        match files {
            Some((from, _)) if ending(from).is_some_and(|e| e == "png") => {
                fs::copy(from, &depth).map_err(|e| Failed::Output(from.into(), e))?;
            }
            _ => {
                write_depth(&depth, &self.depth(frame)?, self.reading.depth_scale, self.settings.depth_scale)
                    .map_err(out(depth.clone()))?
            }
        }
        if let Some((from, ending)) =
            files.and_then(|(_, colour)| colour).and_then(|from| Some((from, ending(from)?)))
        {
            let to = path(&format!("color.{ending}"));
            fs::copy(from, &to).map_err(|e| Failed::Output(from.into(), e))?;
        } else if let Some(image) = self.stated.images.colour(frame.index)? {
            let to = path("color.png");
            image.save(&to).map_err(|e| Failed::Output(to.clone(), std::io::Error::other(e)))?;
        }
        Ok(())
    }

    fn settings_text(&self) -> String {
        let mut text = format!("# Imported from the layout {}.\n", self.layout.name);
        for note in &self.notes {
            let _ = writeln!(text, "# {}", note.replace('\n', " "));
        }
        let Settings { depth_scale, registered, up, .. } = &self.settings;
        let name = toml::Value::String(self.name.clone());
        let _ = writeln!(text, "name = {name}\ndepth_scale = {depth_scale:?}\nregistered = {registered}");
        if let Some(up) = up {
            let _ = writeln!(text, "up = {up:?}");
        }
        text
    }

    /// True if any frame has colour.
    pub(crate) fn coloured(&self) -> bool {
        self.stated.images.coloured()
    }
}

impl Footage for Imported {
    fn pixels(&self, station: usize) -> Result<Pixels, String> {
        let frame = &self.frames[station];
        let depth = self.depth(frame).map_err(|e| e.to_string())?;
        let scale = self.reading.depth_scale;
        let metres: Vec<f32> = depth.units.iter().map(|d| (f64::from(*d) / scale) as f32).collect();
        let cloud = self.intrinsics.cloud_from_depth(&metres);
        let mut cloud = cloud.map_err(|e| format!("{}: {e}", frame.name))?;
        let image = self.stated.images.colour(frame.index).map_err(|e| e.to_string())?;
        let registered = self.settings.registered && self.is_verbatim(frame);
        if let Some(image) = image.as_ref().filter(|i| registered && i.pixels().len() == metres.len()) {
            cloud.colours = Some(image.pixels().map(|p| p.0).collect());
        }
        Ok(Pixels { cloud, colour: image.map(|image| Colour { image, registered }) })
    }
}

/// Failure to read a frame, or to write a file.
enum Failed {
    Input(InputError),
    Output(std::path::PathBuf, std::io::Error),
}

impl From<InputError> for Failed {
    fn from(e: InputError) -> Failed {
        Failed::Input(e)
    }
}

/// Writes a 16-bit depth image, converting units from one scale to another.
fn write_depth(path: &Path, depth: &RawDepth, from: f64, to: f64) -> std::io::Result<()> {
    let unit = |d: f32| match (f64::from(d) * to / from).round() {
        d if d >= 1.0 && d < f64::from(u16::MAX) => d as u16,
        _ => 0,
    };
    let pixels: Vec<u16> = depth.units.iter().map(|d| unit(*d)).collect();
    let image = ImageBuffer::<Luma<u16>, _>::from_raw(depth.width as u32, depth.height as u32, pixels);
    let image = image.ok_or_else(|| std::io::Error::other("the depth image has no such size"))?;
    image.save(path).map_err(std::io::Error::other)
}

/// True if the mean upward direction of the images is within [`HELD_RAD`] of `up`.
fn are_held_upright(poses: &[Isometry3<f64>], up: &[f64; 3]) -> bool {
    let upper: Vector3<f64> = poses.iter().map(|pose| -(pose * Vector3::y())).sum();
    upper.angle(&Vector3::from(*up)) < HELD_RAD
}

/// Shifts positions by whole metres if the first is far from the origin; returns a note with the offset, else
/// `None`.
fn recentre(poses: &mut [Isometry3<f64>]) -> Option<String> {
    let offset: Vector3<f64> = poses.first()?.translation.vector.map(f64::round);
    if offset.norm() <= FARTHEST_M {
        return None;
    }
    poses.iter_mut().for_each(|pose| pose.translation.vector -= offset);
    Some(format!("positions are recentred: {} {} {} m is taken off each", offset.x, offset.y, offset.z))
}

/// Indices of the frames to keep, each at least `spacing_m` from all earlier kept ones; a rotation counts as
/// the displacement of the scene that it causes.
fn spaced(poses: &[Isometry3<f64>], spacing_m: f64) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for (i, pose) in poses.iter().enumerate() {
        let apart_m = |&k: &usize| {
            let (there, turn) = (&poses[k], pose.rotation.angle_to(&poses[k].rotation));
            (pose.translation.vector - there.translation.vector).norm() + LEVER_M * turn
        };
        if kept.iter().all(|k| apart_m(k) >= spacing_m) {
            kept.push(i);
        }
    }
    kept
}
