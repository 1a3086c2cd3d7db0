//! Folder of PCD files, each with its sensor pose as `VIEWPOINT`.

use crate::input::{self, InputError};
use crate::recorded::folder::{names, shown, stem};
use crate::recorded::picture::RawDepth;
use crate::recorded::reading::{self, Conventions};
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Images, Stated, StatedFrame, pairs};
use descry_perception::files::read_cloud;
use descry_perception::visibility::estimate_intrinsics;
use descry_perception::{Cloud, Intrinsics};
use image::RgbImage;
use nalgebra::{Isometry3, Point3, Vector3};
use std::path::{Path, PathBuf};

/// Maximum size of a file, bytes. From: chosen.
const MOST_BYTES: u64 = 1 << 30;
/// Minimum share of the points that a camera must project to their own pixels. From: chosen.
const EXPLAINED: f64 = 0.9;
/// Minimum and maximum number of rows and columns of the image made from a cloud without pixels.
/// From: chosen.
const SIDE: [f64; 2] = [64.0, 320.0];
/// Minimum number of cloud points for each pixel of that image; with fewer, the image has holes.
/// From: chosen.
const POINTS_PER_PIXEL: f64 = 4.0;
/// Share of the points that the virtual camera has in view. From: chosen.
const IN_VIEW: f64 = 0.98;
/// Minimum half angle of the virtual camera, as a slope. From: chosen.
const NARROWEST: f64 = 0.05;
/// Maximum half angle of the virtual camera, as a slope. From: chosen.
const WIDEST: f64 = 2.0;

pub(super) fn is(path: &Path) -> bool {
    path.is_dir() && !files(path).is_empty()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let is_pcd = |name: &String| Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("pcd"));
    names(folder).unwrap_or_default().into_iter().filter(is_pcd).map(|name| folder.join(name)).collect()
}

/// Coordinate frame in which a file gives its points.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Points {
    InSensor,
    InWorld,
}

/// Both possible frames of the points; the first is the one that the PCD format defines.
const FRAMES: [Points; 2] = [Points::InSensor, Points::InWorld];

/// A file with its sensor pose, and the pose of the camera in the frame of the points.
#[derive(Clone, Debug)]
struct Seen {
    path: PathBuf,
    viewpoint: Isometry3<f64>,
    points_from_camera: Isometry3<f64>,
}

/// All files of a folder, as images of one camera.
#[derive(Clone, Debug)]
struct Pcds {
    files: Vec<Seen>,
    camera: Intrinsics,
    organised: bool,
    coloured: bool,
}

/// Summary of a file; arrays have one entry for each of [`FRAMES`].
struct Summary {
    path: PathBuf,
    viewpoint: Isometry3<f64>,
    coloured: bool,
    /// Camera that projects nearly all points to their own pixels, if there is one.
    cameras: [Option<Intrinsics>; 2],
    looks: [Look; 2],
}

/// A virtual camera at the sensor, directed at the middle of the points.
#[derive(Clone, Copy, Debug)]
struct Look {
    points_from_camera: Isometry3<f64>,
    /// Half angle within which the share [`IN_VIEW`] of the points lies, as a slope.
    reach: f64,
    /// Number of points in front of the camera.
    points: usize,
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    if asked.camera.is_some() {
        let problem = "the points of a cloud need no camera";
        return Err(InputError::whole(shown(folder), problem, "leave --camera out"));
    }
    let mut first = [None; 2];
    let mut all = Vec::new();
    for path in files(folder) {
        let summary = Summary::read(path, &first)?;
        if all.is_empty() {
            first = summary.cameras;
        }
        all.push(summary);
    }
    let Some(one) = all.first() else {
        return Err(InputError::whole(shown(folder), "no clouds", "PCD files are expected there"));
    };
    if all.len() > 1 && all.iter().all(|s| s.viewpoint == one.viewpoint) {
        let problem = "all files state the same VIEWPOINT: nothing says from where each was seen";
        let mend = "write the pose of the sensor into each, or look at one with `descry recognise`";
        return Err(InputError::whole(shown(folder), problem, mend));
    }
    let explained = |k: usize| first[k].filter(|_| all.iter().all(|s| s.cameras[k].is_some()));
    if let Some((k, camera)) = (0..2).find_map(|k| Some((k, explained(k)?))) {
        let pcds = Pcds::organised(&all, FRAMES[k], camera);
        return Ok(pcds.stated(FRAMES[k], "pixels as a camera has them"));
    }
    if all.len() == 1 && one.viewpoint == Isometry3::identity() {
        let problem = "nothing says from where its points were seen: it has no pixels, and VIEWPOINT is left as it begins";
        let mend = "write the pose of the sensor as VIEWPOINT; of a merged cloud nothing can be said not to be there: look at it with `descry recognise`";
        return Err(InputError::whole(shown(&one.path), problem, mend));
    }
    let mut both = Vec::new();
    for (points, note) in FRAMES
        .into_iter()
        .zip(["points in the frame of the sensor", "points in the world, seen from VIEWPOINT"])
    {
        let stated = Pcds::loose(&all, points).stated(points, note);
        both.push((reading::agreement(&stated.reading, &pairs(&stated)?), stated));
    }
    // As the format defines it, unless the views say otherwise.
    let in_world = both[1].0 > both[0].0 + reading::MARGIN;
    Ok(both.swap_remove(usize::from(in_world)).1)
}

fn load(path: &Path) -> Result<(Cloud, Isometry3<f64>), InputError> {
    let bytes = input::read_bytes(path, MOST_BYTES).map_err(|e| {
        InputError::whole(shown(path), format!("cannot be read: {e}"), "a PCD file is expected")
    })?;
    let loaded = read_cloud(&bytes).map_err(|e| {
        let place = format!("{}, {}", shown(path), e.place);
        InputError::whole(place, format!("expected {}, found {}", e.expected, e.found), e.mend)
    })?;
    if loaded.cloud.count_finite() == 0 {
        return Err(InputError::whole(shown(path), "no point is finite", "leave the file out"));
    }
    Ok((loaded.cloud, loaded.viewpoint))
}

impl Points {
    /// Pose of the sensor in the frame of the points.
    fn pose_of_sensor(self, viewpoint: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Points::InSensor => Isometry3::identity(),
            Points::InWorld => *viewpoint,
        }
    }
}

impl Summary {
    /// Reads a file; `first` holds the cameras of the first file. A camera that is missing there is
    /// estimated.
    fn read(path: PathBuf, first: &[Option<Intrinsics>; 2]) -> Result<Summary, InputError> {
        let (cloud, viewpoint) = load(&path)?;
        let from_sensor = FRAMES.map(|points| points.pose_of_sensor(&viewpoint));
        let camera = |k: usize| {
            let seen = cloud.transformed(&from_sensor[k].inverse());
            first[k].or_else(|| estimate_intrinsics(&seen)).filter(|camera| explains(camera, &seen))
        };
        let looks = from_sensor.map(|from_sensor| Look::at(&cloud, from_sensor.translation.vector.into()));
        Ok(Summary {
            cameras: [camera(0), camera(1)],
            looks,
            coloured: cloud.colours.is_some(),
            viewpoint,
            path,
        })
    }
}

/// True if the camera projects nearly all points of the cloud to their own pixels; false for a cloud without
/// pixels.
fn explains(camera: &Intrinsics, cloud: &Cloud) -> bool {
    let Some(grid) = cloud.grid.filter(|g| (g.width, g.height) == (camera.width, camera.height)) else {
        return false;
    };
    let mut counts = (0_usize, 0_usize);
    for (i, point) in cloud.points.iter().enumerate().filter(|(_, p)| p.z.is_finite()) {
        let near = camera.project(&point.cast()).is_some_and(|(u, v)| {
            (u - (i % grid.width) as f64).abs() < 1.0 && (v - (i / grid.width) as f64).abs() < 1.0
        });
        counts = (counts.0 + usize::from(near), counts.1 + 1);
    }
    counts.0 as f64 >= EXPLAINED * counts.1 as f64
}

impl Look {
    fn at(cloud: &Cloud, eye: Point3<f64>) -> Look {
        let rays = || {
            let finite = cloud.points.iter().filter(|p| p.iter().all(|c| c.is_finite()));
            finite.filter_map(|p| (p.cast::<f64>() - eye).try_normalize(1e-9))
        };
        let forward = rays().sum::<Vector3<f64>>().try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let down = if forward.z.abs() < 0.9 { -Vector3::z() } else { Vector3::x() };
        let points_from_camera = Isometry3::face_towards(&eye, &(eye + forward), &down);
        let mut slopes: Vec<f64> = rays()
            .map(|ray| points_from_camera.inverse_transform_vector(&ray))
            .filter(|ray| ray.z > 0.0)
            .map(|ray| (ray.x / ray.z).abs().max((ray.y / ray.z).abs()))
            .collect();
        slopes.sort_unstable_by(f64::total_cmp);
        let at = (slopes.len() as f64 * IN_VIEW) as usize;
        let reach = slopes.get(at).copied().unwrap_or(0.0).clamp(NARROWEST, WIDEST);
        Look { points_from_camera, reach, points: slopes.len() }
    }
}

impl Pcds {
    fn organised(all: &[Summary], points: Points, camera: Intrinsics) -> Pcds {
        let seen = |s: &Summary| Seen {
            path: s.path.clone(),
            viewpoint: s.viewpoint,
            points_from_camera: points.pose_of_sensor(&s.viewpoint),
        };
        let coloured = all.iter().all(|s| s.coloured);
        Pcds { files: all.iter().map(seen).collect(), camera, organised: true, coloured }
    }

    /// Converts clouds without pixels to images of one virtual camera, placed at each viewpoint.
    fn loose(all: &[Summary], points: Points) -> Pcds {
        let look = |s: &'_ Summary| -> (f64, usize, Seen) {
            let Look { points_from_camera, reach, points } = s.looks[usize::from(points == Points::InWorld)];
            (reach, points, Seen { path: s.path.clone(), viewpoint: s.viewpoint, points_from_camera })
        };
        let looks: Vec<(f64, usize, Seen)> = all.iter().map(look).collect();
        let reach = looks.iter().map(|(reach, _, _)| *reach).fold(NARROWEST, f64::max);
        let fewest = looks.iter().map(|(_, points, _)| *points).min().unwrap_or(0);
        let side = (fewest as f64 / POINTS_PER_PIXEL).sqrt().clamp(SIDE[0], SIDE[1]) as usize;
        let middle = 0.5 * (side - 1) as f64;
        let focal = middle / reach;
        let camera = Intrinsics { width: side, height: side, fx: focal, fy: focal, cx: middle, cy: middle };
        let files = looks.into_iter().map(|(_, _, seen)| seen).collect();
        Pcds { files, camera, organised: false, coloured: false }
    }

    fn stated(self, points: Points, note: &str) -> Stated {
        let Intrinsics { fx, fy, cx, cy, .. } = self.camera;
        let frame = |seen: &Seen| StatedFrame {
            name: stem(&seen.path.file_name().unwrap_or_default().to_string_lossy()).to_string(),
            camera: CameraSettings { fx, fy, cx, cy },
            pose: match (self.organised, points) {
                (true, _) => seen.viewpoint,
                (false, Points::InSensor) => seen.viewpoint * seen.points_from_camera,
                (false, Points::InWorld) => seen.points_from_camera,
            },
        };
        let mut notes = vec![format!("read as {note}")];
        if !self.organised {
            notes.push(format!("clouds without pixels become images of {0}x{0}", self.camera.width));
        }
        Stated {
            frames: self.files.iter().map(frame).collect(),
            reading: Conventions::usual(1.0),
            whole: false,
            registered: self.coloured,
            up: None,
            notes,
            images: Box::new(self),
        }
    }
}

impl Images for Pcds {
    fn depth(&self, frame: usize) -> Result<RawDepth, InputError> {
        let seen = &self.files[frame];
        let (cloud, _) = load(&seen.path)?;
        let cloud = cloud.transformed(&seen.points_from_camera.inverse());
        let (width, height) = (self.camera.width, self.camera.height);
        let units = if self.organised {
            cloud.points.iter().map(|p| p.z).collect()
        } else {
            let mut units = vec![f32::NAN; width * height];
            for point in cloud.points.iter().filter(|p| p.z.is_finite()) {
                let pixel = self.camera.project(&point.cast()).and_then(|(u, v)| self.camera.pixel(u, v));
                if let Some(depth) = pixel.map(|pixel| &mut units[pixel]) {
                    *depth = depth.min(point.z);
                }
            }
            units
        };
        Ok(RawDepth { width, height, units })
    }

    fn colour(&self, frame: usize) -> Result<Option<RgbImage>, InputError> {
        if !self.coloured {
            return Ok(None);
        }
        let (cloud, _) = load(&self.files[frame].path)?;
        let bytes = cloud.colours.map(|colours| colours.into_flattened());
        let image =
            bytes.and_then(|b| RgbImage::from_raw(self.camera.width as u32, self.camera.height as u32, b));
        Ok(image)
    }

    fn coloured(&self) -> bool {
        self.coloured
    }
}
