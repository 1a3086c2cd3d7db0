//! First message of a program, the *hello*: description of the body, and its map.

use crate::body::{Door, Room, Stamp, Station, SurfaceHint};
use crate::grid::OccupancyGrid;
use crate::parts::{self, Description, Footprint, Frames, Gripper, Head, Sense, Speeds};
use crate::program::message;
use crate::recorded::{Known, outline};
use descry_perception::Intrinsics;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use serde::Deserialize;

/// Supported version of the protocol.
pub const PROTOCOL: u32 = 1;
/// Maximum number of pixels in an image, and of cells in a map.
const MOST_CELLS: usize = 1 << 25;
/// Maximum number of readings in a sweep: all around, at a metre, a tenth of a millimetre apart.
const MOST_READINGS: usize = 65_536;
/// Maximum number of surfaces, rooms, doors or stations.
const MOST_NAMES: usize = 10_000;

/// First message of a program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Hello {
    /// Version of the protocol, checked before the rest is read.
    #[serde(rename = "protocol")]
    _protocol: u32,
    /// Name, for people and records.
    name: String,
    /// True if the body and its world are simulated.
    #[serde(default)]
    simulated: bool,
    /// Time on the body's clock at the start, nanoseconds.
    #[serde(default)]
    now_ns: Stamp,
    /// Base; left out for a body that stays at its only station.
    base: Option<Base>,
    /// Depth camera; left out if there is none.
    camera: Option<Camera>,
    /// Head that turns the camera; left out if none does.
    head: Option<Head>,
    /// Arm that pushes and grasps; left out if there is none.
    arm: Option<Arm>,
    /// Horizontal laser; left out if there is none.
    laser: Option<Laser>,
    /// Custom sensors.
    #[serde(default)]
    senses: Vec<Sense>,
    /// Names of the map frame and the base frame.
    #[serde(default)]
    frames: BodyFrames,
    /// Upward direction in the map frame; left out if unknown.
    up: Option<Vector3<f64>>,
    /// Standard deviation of the estimated position along each axis, metres.
    pose_sigma_m: f64,
    /// Standard deviation of the estimated heading, radians.
    pose_sigma_rad: f64,
    /// Map of the floor, whose cells follow as bytes; left out if there is none.
    map: Option<Map>,
    /// Support surfaces in the map.
    #[serde(default)]
    surfaces: Vec<SurfaceHint>,
    /// Rooms in the map.
    #[serde(default)]
    rooms: Vec<Room>,
    /// Doors in the map.
    #[serde(default)]
    doors: Vec<Door>,
    /// The only places where the body can stand; left out if it can stand anywhere.
    stations: Option<Vec<Station>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Base {
    /// Outline of the base on the floor, base frame, metres.
    footprint: Footprint,
    /// Driving speed, metres a second.
    linear_m_s: f64,
    /// Speed of turning on the spot, radians a second.
    angular_rad_s: f64,
    /// Distance that the footprint keeps from mapped obstacles, metres.
    #[serde(default = "default_clearance_m")]
    clearance_m: f64,
}

fn default_clearance_m() -> f64 {
    0.05
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    /// Number of pixels in a row.
    width: usize,
    /// Number of rows.
    height: usize,
    /// Focal length along x, pixels.
    fx: f64,
    /// Focal length along y, pixels.
    fy: f64,
    /// Column of the principal point.
    cx: f64,
    /// Row of the principal point.
    cy: f64,
    /// Minimum and maximum depth, metres.
    range_m: (f64, f64),
    /// Length of one unit of depth in images, metres.
    #[serde(default = "default_unit_m")]
    unit_m: f64,
    /// True if a colour image of the same pixels follows the depths.
    #[serde(default)]
    colour: bool,
    /// Maximum time by which a frame's stamp may precede its request, seconds.
    #[serde(default)]
    latency_s: f64,
    /// Name of the camera's optical frame.
    #[serde(default = "default_camera_frame")]
    frame: String,
    /// Pose of the camera in the base frame, if no head turns the camera; the base's own pose if left out.
    base_from_camera: Option<Isometry3<f64>>,
}

/// Maximum plausible latency, seconds; a larger value was probably meant as milliseconds.
const MOST_LATENCY_S: f64 = 2.0;

fn default_unit_m() -> f64 {
    0.001
}

fn default_camera_frame() -> String {
    "camera".into()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Arm {
    /// Reach from the base's centre, metres.
    reach_m: f64,
    /// Maximum width of a graspable object, metres; left out for an arm that only pushes.
    hand_opening_m: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Laser {
    /// Constant pose of the laser in the base frame.
    base_from_laser: Isometry3<f64>,
    /// Angle of the first reading, anticlockwise from straight ahead, radians.
    first_rad: f64,
    /// Angle from one reading to the next, radians.
    step_rad: f64,
    /// Number of readings in a sweep.
    readings: usize,
    /// Maximum range, metres.
    reach_m: f64,
    /// Name of the laser's frame.
    #[serde(default = "default_laser_frame")]
    frame: String,
}

fn default_laser_frame() -> String {
    "laser".into()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct BodyFrames {
    /// Name of the map frame.
    map: String,
    /// Name of the base frame.
    base: String,
}

impl Default for BodyFrames {
    fn default() -> Self {
        let Frames { map, base } = Frames::default();
        BodyFrames { map, base }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Map {
    /// Side of a cell, metres.
    resolution_m: f64,
    /// Outer corner of cell (0, 0), map frame, metres.
    origin_m: Point2<f64>,
    /// Number of cells along x.
    width: usize,
    /// Number of cells along y.
    height: usize,
}

/// Content of a parsed and checked hello.
pub(super) struct Greeting {
    pub known: Known,
    pub clearance_m: f64,
    /// Pose of a camera that no head turns, in the base frame.
    pub base_from_camera: Isometry3<f64>,
    pub pixels: PixelFormat,
}

/// Byte layout of a camera frame: metres in a unit of depth, and true if colour follows the depths.
#[derive(Clone, Copy)]
pub(super) struct PixelFormat {
    pub unit_m: f64,
    pub colour: bool,
}

impl PixelFormat {
    /// Size of a frame with this many pixels, bytes: 16 bits of depth a pixel, then red, green and blue if
    /// there is colour.
    pub fn bytes(&self, pixels: usize) -> usize {
        pixels * if self.colour { 5 } else { 2 }
    }
}

impl Hello {
    /// Checks the message; `cells` are the bytes after its line, the cells of the map.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn check(self, cells: &[u8]) -> Result<Greeting, String> {
        if self.now_ns < 0 {
            return Err(format!("now_ns is {}, expected nanoseconds from 0", self.now_ns));
        }
        let sigmas = [("pose_sigma_m", self.pose_sigma_m), ("pose_sigma_rad", self.pose_sigma_rad)];
        above_zero(&sigmas)?;
        at_most(&sigmas[..1], MOST_M, "metres, not millimetres")?;
        at_most(&sigmas[1..], MOST_SIGMA_RAD, "radians, not degrees")?;
        self.check_parts()?;
        self.check_names()?;
        let map = match &self.map {
            Some(map) => Some(map.grid(cells)?),
            None if cells.is_empty() => None,
            None => return Err(format!("{} bytes follow the hello, which has no map", cells.len())),
        };
        if map.is_none() && self.stations.as_ref().is_none_or(Vec::is_empty) {
            return Err("it has neither a map nor stations: there is nowhere to go".into());
        }
        if self.base.is_none() && self.stations.as_ref().is_none_or(|list| list.len() != 1) {
            return Err("it has no base: expected one station, where it is".into());
        }
        Ok(self.greeting(map))
    }

    fn check_parts(&self) -> Result<(), String> {
        if let Some(camera) = &self.camera {
            camera.check()?;
            if camera.base_from_camera.is_some() && self.head.is_some() {
                return Err(
                    "camera.base_from_camera is of a camera that no head turns, and there is a head".into()
                );
            }
        }
        if self.head.is_some() && self.camera.is_none() {
            return Err("there is a head, and no camera that it turns".into());
        }
        if let Some(base) = &self.base {
            base.check()?;
        }
        if let Some(h) = &self.head {
            let angles = [h.pan_limit_rad, h.tilt_down_rad, h.tilt_up_rad];
            if !(angles.iter().all(|a| a.is_finite() && *a >= 0.0) && finite3(&h.base_from_head)) {
                return Err("head: expected base_from_head in metres and three limits from 0".into());
            }
            at_most(
                &[("head.base_from_head", h.base_from_head.coords.amax())],
                MOST_M,
                "metres, not millimetres",
            )?;
        }
        if let Some(arm) = &self.arm {
            above_zero(&[
                ("arm.reach_m", arm.reach_m),
                ("arm.hand_opening_m", arm.hand_opening_m.unwrap_or(1.0)),
            ])?;
            at_most(&[("arm.reach_m", arm.reach_m)], MOST_M, "metres, not millimetres")?;
        }
        if let Some(laser) = &self.laser {
            laser.check()?;
        }
        match self.up {
            Some(up) if !(up.norm().is_finite() && up.norm() > 0.0) => {
                Err(format!("up is {up}, no direction"))
            }
            _ => Ok(()),
        }
    }

    fn check_names(&self) -> Result<(), String> {
        let names = |list: &[&str], what: &str| {
            if list.len() > MOST_NAMES {
                return Err(format!("{} {what}s, expected {MOST_NAMES} at most", list.len()));
            }
            let mut sorted = list.to_vec();
            sorted.sort_unstable();
            match sorted.windows(2).find(|w| w[0] == w[1]) {
                Some(w) => Err(format!("two {what}s are called \"{}\"", w[0])),
                None => Ok(()),
            }
        };
        names(&self.senses.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), "sense")?;
        names(&self.surfaces.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), "surface")?;
        names(&self.rooms.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), "room")?;
        names(&self.doors.iter().map(|d| d.name.as_str()).collect::<Vec<_>>(), "door")?;
        let stations = self.stations.as_deref().unwrap_or_default();
        names(&stations.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), "station")?;
        for station in stations {
            message::transform(&station.map_from_base)
                .map_err(|e| format!("station {}: {e}", station.name))?;
        }
        let told = |name: &str, (problem, mend): outline::Fault| format!("\"{name}\": {problem}; {mend}");
        for s in &self.surfaces {
            outline::check(&s.outline_m, outline::WIDEST_SURFACE_M).map_err(|f| told(&s.name, f))?;
            outline::check_height(s.height_m).map_err(|f| told(&s.name, f))?;
        }
        for r in &self.rooms {
            outline::check(&r.outline_m, outline::WIDEST_ROOM_M).map_err(|f| told(&r.name, f))?;
        }
        self.check_rooms()
    }

    /// Checks that surfaces and doors name existing rooms.
    fn check_rooms(&self) -> Result<(), String> {
        let rooms: Vec<&str> = self.rooms.iter().map(|room| room.name.as_str()).collect();
        let known = |what: &str, name: &str, room: &String| match rooms.contains(&room.as_str()) {
            true => Ok(()),
            false => {
                Err(format!("the {what} \"{name}\" is at the room \"{room}\", expected one of {rooms:?}"))
            }
        };
        for surface in &self.surfaces {
            surface.room.iter().try_for_each(|room| known("surface", &surface.name, room))?;
        }
        for Door { name, centre_m, along_rad, width_m, between } in &self.doors {
            between.iter().try_for_each(|room| known("door", name, room))?;
            if between[0] == between[1] {
                return Err(format!("the door \"{name}\" has the room \"{}\" on both sides", between[0]));
            }
            if !(centre_m.x.is_finite() && centre_m.y.is_finite() && along_rad.is_finite()) {
                return Err(format!(
                    "the door \"{name}\": expected centre_m in metres and along_rad in radians"
                ));
            }
            let width = format!("the width_m of the door \"{name}\"");
            above_zero(&[(width.as_str(), *width_m)])?;
            at_most(&[(width.as_str(), *width_m)], MOST_M, "metres, not millimetres")?;
        }
        Ok(())
    }

    fn greeting(self, map: Option<OccupancyGrid>) -> Greeting {
        let fixed = self.camera.as_ref().and_then(|c| message::transform(&c.base_from_camera?).ok());
        let pixels = self.camera.as_ref().map(|c| PixelFormat { unit_m: c.unit_m, colour: c.colour });
        let clearance_m = self.base.as_ref().map_or(0.0, |base| base.clearance_m);
        let description = Description {
            name: self.name,
            simulated: self.simulated,
            base: self.base.map(Base::part),
            head: self.head,
            arm: self.arm.map(Arm::part),
            camera: self.camera.map(Camera::part),
            laser: self.laser.map(Laser::part),
            senses: self.senses,
            frames: Frames { map: self.frames.map, base: self.frames.base },
            up: self.up.map(|up| up.normalize()),
            pose_sigma_m: self.pose_sigma_m,
            pose_sigma_rad: self.pose_sigma_rad,
        };
        let tidy = |s: Station| Station {
            map_from_base: message::transform(&s.map_from_base).unwrap_or(Isometry3::identity()),
            ..s
        };
        let known = Known {
            description,
            surfaces: self.surfaces,
            rooms: self.rooms,
            doors: self.doors,
            stations: self.stations.map(|list| list.into_iter().map(tidy).collect()),
            map,
            now_ns: self.now_ns,
        };
        Greeting {
            known,
            clearance_m,
            base_from_camera: fixed.unwrap_or(Isometry3::identity()),
            pixels: pixels.unwrap_or(PixelFormat { unit_m: default_unit_m(), colour: false }),
        }
    }
}

impl Base {
    fn check(&self) -> Result<(), String> {
        for (name, speed, least) in [
            ("base.linear_m_s", self.linear_m_s, Speeds::LEAST.linear_m_s),
            ("base.angular_rad_s", self.angular_rad_s, Speeds::LEAST.angular_rad_s),
        ] {
            if !(speed.is_finite() && speed >= least) {
                return Err(format!(
                    "{name} is {speed}, expected {least} or more: a slower body never arrives"
                ));
            }
        }
        let radius_m = self.footprint.radius_m();
        for (name, length_m) in
            [("the radius of base.footprint", radius_m), ("base.clearance_m", self.clearance_m)]
        {
            if !(0.0..=MOST_M).contains(&length_m) {
                return Err(format!("{name} is {length_m} m, expected 0 to {MOST_M}"));
            }
        }
        Ok(())
    }

    fn part(self) -> parts::Base {
        let speeds = Speeds { linear_m_s: self.linear_m_s, angular_rad_s: self.angular_rad_s };
        parts::Base { footprint: self.footprint, speeds }
    }
}

impl Camera {
    fn check(&self) -> Result<(), String> {
        above_zero(&[("camera.fx", self.fx), ("camera.fy", self.fy), ("camera.unit_m", self.unit_m)])?;
        let pixels = self.width.checked_mul(self.height).filter(|n| (1..=MOST_CELLS).contains(n));
        if pixels.is_none() {
            return Err(format!(
                "the camera has {} x {} pixels, expected 1 to {MOST_CELLS}",
                self.width, self.height
            ));
        }
        if !(self.cx.is_finite() && self.cy.is_finite()) {
            return Err("camera.cx and camera.cy are pixels".into());
        }
        if !(self.range_m.0 >= 0.0 && self.range_m.0 < self.range_m.1 && self.range_m.1.is_finite()) {
            return Err(format!("camera.range_m is {:?}, expected least and greatest depth", self.range_m));
        }
        if !(0.0..=MOST_LATENCY_S).contains(&self.latency_s) {
            return Err(format!("camera.latency_s is {}, expected 0 to {MOST_LATENCY_S} s", self.latency_s));
        }
        let fixed = self.base_from_camera.as_ref().map(message::transform).transpose();
        fixed.map(|_| ()).map_err(|e| format!("camera.base_from_camera: {e}"))
    }

    fn part(self) -> parts::Camera {
        let Camera { width, height, fx, fy, cx, cy, .. } = self;
        let intrinsics = Intrinsics { width, height, fx, fy, cx, cy };
        parts::Camera {
            frame: self.frame,
            intrinsics,
            range_m: self.range_m,
            colour: self.colour,
            latency_s: self.latency_s,
        }
    }
}

impl Arm {
    fn part(self) -> parts::Arm {
        let hand = self.hand_opening_m.map(|opening_m| Gripper { opening_m });
        parts::Arm { reach_m: self.reach_m, hand }
    }
}

impl Laser {
    fn check(&self) -> Result<(), String> {
        above_zero(&[("laser.step_rad", self.step_rad), ("laser.reach_m", self.reach_m)])?;
        let around = (1..=MOST_READINGS).contains(&self.readings)
            && self.step_rad * (self.readings - 1) as f64 <= std::f64::consts::TAU;
        if !(around && self.first_rad.is_finite()) {
            return Err(format!(
                "laser: {} readings from {} rad in steps of {} rad, expected 1 to {MOST_READINGS} over a full turn at most",
                self.readings, self.first_rad, self.step_rad
            ));
        }
        message::transform(&self.base_from_laser)
            .map(|_| ())
            .map_err(|e| format!("laser.base_from_laser: {e}"))
    }

    fn part(self) -> parts::Laser {
        let Laser { base_from_laser, first_rad, step_rad, readings, reach_m, frame } = self;
        let base_from_laser = message::transform(&base_from_laser).unwrap_or(Isometry3::identity());
        parts::Laser { frame, base_from_laser, first_rad, step_rad, readings, reach_m }
    }
}

impl Map {
    fn grid(&self, cells: &[u8]) -> Result<OccupancyGrid, String> {
        /// Range of valid cell sides, metres. From: chosen.
        const CELLS_M: (f64, f64) = (0.001, 10.0);
        if !(CELLS_M.0..=CELLS_M.1).contains(&self.resolution_m) {
            let (least, most) = CELLS_M;
            return Err(format!("map.resolution_m is {}, expected {least} to {most}", self.resolution_m));
        }
        if !(self.origin_m.x.is_finite() && self.origin_m.y.is_finite()) {
            return Err("map.origin_m is no place".into());
        }
        let count = self.width.checked_mul(self.height).filter(|n| (1..=MOST_CELLS).contains(n));
        let Some(count) = count else {
            return Err(format!(
                "the map has {} x {} cells, expected 1 to {MOST_CELLS}",
                self.width, self.height
            ));
        };
        if cells.len() != count {
            return Err(format!("{} bytes follow the hello, its map has {count} cells", cells.len()));
        }
        Ok(OccupancyGrid {
            resolution_m: self.resolution_m,
            origin_m: self.origin_m,
            width: self.width,
            height: self.height,
            occupied: cells.iter().map(|&c| c != 0).collect(),
        })
    }
}

/// Maximum plausible width or reach of a body, clearance, standard deviation of localisation, and width of a
/// door, metres. From: chosen.
const MOST_M: f64 = 10.0;
/// Maximum plausible standard deviation of the heading, radians. From: chosen, a third of a half turn.
const MOST_SIGMA_RAD: f64 = 1.0;

fn at_most(numbers: &[(&str, f64)], most: f64, unit: &str) -> Result<(), String> {
    match numbers.iter().find(|(_, x)| *x > most) {
        Some((name, x)) => Err(format!("{name} is {x}, expected {most} at most: {unit}")),
        None => Ok(()),
    }
}

fn finite3(p: &Point3<f64>) -> bool {
    p.iter().all(|x| x.is_finite())
}

fn above_zero(numbers: &[(&str, f64)]) -> Result<(), String> {
    match numbers.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
        Some((name, x)) => Err(format!("{name} is {x}, expected a number above zero")),
        None => Ok(()),
    }
}
