//! Settings of a folder of frames, for facts that the frames do not contain.

use crate::input::{self, InputError, Objection, Step};
use crate::parts::Speeds;
use crate::recorded::outline;
use descry_perception::Intrinsics;
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Minimum turning speed, degrees a second; a slower body would never finish a turn.
const LEAST_ANGULAR_DEG_S: f64 = 0.01;

/// Contents of `recording.toml`; every key is optional.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Name for people; the folder's name if left out.
    pub name: Option<String>,
    /// Folder of the frames, relative to this file.
    pub folder: Option<String>,
    /// Units of a depth image in a metre.
    pub depth_scale: f64,
    /// Name of the station where the body starts; the first frame if left out.
    pub start: Option<String>,
    /// Upward direction in the world of the poses.
    pub up: Option<[f64; 3]>,
    /// True if colour and depth image show the same point at the same pixel.
    pub registered: bool,
    /// Standard deviation of the positions along each axis, metres.
    pub pose_sigma_m: f64,
    /// Standard deviation of the orientations about each axis, degrees.
    pub pose_sigma_deg: f64,
    /// Driving speed between stations, metres a second.
    pub linear_m_s: f64,
    /// Turning speed between stations, degrees a second.
    pub angular_deg_s: f64,
    /// Minimum and maximum depth of the camera, metres.
    pub range_m: [f64; 2],
    /// Depth camera; that of `camera-intrinsics.txt` if left out.
    pub camera: Option<CameraSettings>,
    /// Surfaces at known positions in the world of the poses, where z is up.
    #[serde(rename = "surface")]
    pub surfaces: Vec<SurfaceSettings>,
}

/// A surface at a known position, with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSettings {
    /// Name for people.
    pub name: String,
    /// Corners of the surface in order, along the world's x and y, metres.
    pub outline_m: Vec<[f64; 2]>,
    /// Height of the top along the world's z, metres.
    pub height_m: f64,
}

/// A pinhole camera, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Focal length along x.
    pub fx: f64,
    /// Focal length along y.
    pub fy: f64,
    /// Column of the principal point.
    pub cx: f64,
    /// Row of the principal point.
    pub cy: f64,
}

impl Default for Settings {
    /// Depths in millimetres, poses good to 3 cm and 1°, a body as slow as the published navigation module
    /// (0.3 m/s, 30°/s).
    fn default() -> Self {
        Settings {
            name: None,
            folder: None,
            depth_scale: 1000.0,
            start: None,
            up: None,
            registered: false,
            pose_sigma_m: 0.03,
            pose_sigma_deg: 1.0,
            linear_m_s: 0.3,
            angular_deg_s: 30.0,
            range_m: [0.4, 8.0],
            camera: None,
            surfaces: Vec::new(),
        }
    }
}

impl Settings {
    /// Parses a `recording.toml`; `file` is the name of the file in messages.
    ///
    /// # Errors
    /// The first fault, with its place in the text and a fix.
    pub fn parse(file: &str, text: &str) -> Result<Settings, InputError> {
        let settings: Settings = input::parse_toml(file, text)?;
        settings.check().map_err(|objection| input::draw(file, text, objection))?;
        Ok(settings)
    }

    fn check(&self) -> Result<(), Objection> {
        let least = [
            ("depth_scale", self.depth_scale, 0.0),
            ("pose_sigma_m", self.pose_sigma_m, 0.0),
            ("pose_sigma_deg", self.pose_sigma_deg, 0.0),
            ("linear_m_s", self.linear_m_s, Speeds::LEAST.linear_m_s),
            ("angular_deg_s", self.angular_deg_s, LEAST_ANGULAR_DEG_S),
        ];
        for (key, value, least) in least {
            if !(value.is_finite() && value > 0.0 && value >= least) {
                let expected =
                    if least > 0.0 { format!("{least} or more") } else { "a number above zero".into() };
                let problem = format!("found {value:?}, expected {expected}");
                return Err(objection(vec![Step::Key(key)], problem, "leave it out for the usual value"));
            }
        }
        if let Some(up) = self.up {
            let length = up.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(length.is_finite() && length > 0.0) {
                let problem = format!("{up:?} is no direction");
                return Err(objection(vec![Step::Key("up")], problem, "such as [0.0, 0.0, 1.0]"));
            }
        }
        self.check_surfaces()?;
        let [near, far] = self.range_m;
        if !(near >= 0.0 && near < far) {
            let problem = format!("[{near}, {far}] is no range");
            return Err(objection(vec![Step::Key("range_m")], problem, "least and greatest depth in metres"));
        }
        self.camera.map_or(Ok(()), |camera| camera.check())
    }

    fn check_surfaces(&self) -> Result<(), Objection> {
        for (n, surface) in self.surfaces.iter().enumerate() {
            let at = |key| vec![Step::Key("surface"), Step::Index(n), Step::Key(key)];
            if let Some(before) = self.surfaces[..n].iter().position(|s| s.name == surface.name) {
                let problem =
                    format!("surfaces {} and {} are both called \"{}\"", before + 1, n + 1, surface.name);
                return Err(objection(at("name"), problem, "give each surface a name of its own"));
            }
            let corners: Vec<Point2<f64>> = surface.outline_m.iter().map(|&c| c.into()).collect();
            outline::check(&corners, outline::WIDEST_SURFACE_M).map_err(|(problem, mend)| {
                objection(at("outline_m"), format!("\"{}\": {problem}", surface.name), mend)
            })?;
            outline::check_height(surface.height_m)
                .map_err(|(problem, mend)| objection(at("height_m"), problem, mend))?;
            let is_upright = self.up.is_none_or(|[x, y, z]| z > 0.99 * (x * x + y * y + z * z).sqrt());
            if !is_upright {
                let problem = "surfaces can be named only where the world's z is up".to_string();
                return Err(objection(at("name"), problem, "leave the surfaces out, or turn the poses"));
            }
        }
        Ok(())
    }
}

impl CameraSettings {
    fn check(&self) -> Result<(), Objection> {
        let at = |key| vec![Step::Key("camera"), Step::Key(key)];
        for (key, value) in [("fx", self.fx), ("fy", self.fy)] {
            if !(value.is_finite() && value > 0.0) {
                let problem = format!("found {value}, expected a focal length above zero");
                return Err(objection(at(key), problem, "in pixels"));
            }
        }
        for (key, value) in [("cx", self.cx), ("cy", self.cy)] {
            if !value.is_finite() {
                let problem = format!("found {value}, expected a pixel");
                return Err(objection(at(key), problem, "a number"));
            }
        }
        Ok(())
    }

    /// Intrinsics of the camera for images of a size, columns and rows.
    pub(crate) fn with_size(&self, (width, height): (usize, usize)) -> Intrinsics {
        Intrinsics { width, height, fx: self.fx, fy: self.fy, cx: self.cx, cy: self.cy }
    }

    /// Axis (0 for x, 1 for y) along which the principal point lies outside an image of this size, columns
    /// and rows, with a description; `None` if it is inside.
    pub(crate) fn off_image(&self, size: (usize, usize)) -> Option<(usize, String)> {
        let axes = [("cx", self.cx, size.0, "columns"), ("cy", self.cy, size.1, "rows")];
        let off = axes.into_iter().position(|(_, at, most, _)| !(0.0..=most as f64).contains(&at))?;
        let (name, at, most, what) = axes[off];
        Some((off, format!("{name} is {at}, expected a pixel of the image, which has {most} {what}")))
    }
}

fn objection(path: Vec<Step>, problem: String, mend: &str) -> Objection {
    Objection { path, problem, mend: mend.into() }
}
