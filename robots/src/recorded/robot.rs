//! Implementation of the [`Robot`] trait for a recording.

use crate::body::{
    Colour, Door, Driven, Looked, Place, PoseEstimate, Progress, Robot, Room, Sensed, Stamp,
    StampedTransform, Station, SurfaceHint, Travel, Watch,
};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::input::InputError;
use crate::parts::{Base, Camera, Description, Footprint, Frames, Part, Speeds};
use crate::recorded::folder::{CAMERA_FILE, Recording, SETTINGS_FILE};
use crate::recorded::footage::Footage;
use crate::recorded::import::{Imported, Options};
use crate::recorded::layouts::layout_of;
use crate::recorded::settings::{Settings, SurfaceSettings};
use crate::recorded::tape::Known;
use crate::request::{Exposure, Pixels};
use descry_perception::Intrinsics;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Time that taking a frame costs on the body's clock, seconds.
const FRAME_S: f64 = 0.1;

/// A recording as a robot. The camera frame serves as the base frame; the robot stands at one of the recorded
/// frames and has no map.
pub struct RecordedRobot {
    frames: Box<dyn Footage>,
    description: Description,
    surfaces: Vec<SurfaceHint>,
    rooms: Vec<Room>,
    doors: Vec<Door>,
    stations: Vec<Station>,
    state: Mutex<State>,
}

struct State {
    at: usize,
    now_ns: Stamp,
}

impl RecordedRobot {
    /// Opens a folder of frames, a `recording.toml` that names one, or a recording in a published layout. For
    /// the latter, also returns notes for people on what was assumed.
    ///
    /// # Errors
    /// See [`Recording::open`] and [`Imported::open`].
    pub fn open(path: &Path) -> Result<(RecordedRobot, Vec<String>), InputError> {
        if is_foreign(path) {
            let imported = Imported::open(path, &Options::default())?;
            let layout = format!("read as {}: {}", imported.layout.name, imported.layout.files);
            let notes = [vec![layout], imported.notes.clone()].concat();
            return Ok((RecordedRobot::imported(imported), notes));
        }
        Ok((RecordedRobot::new(Recording::open(path)?), Vec::new()))
    }

    /// Creates a body at the recording's first station.
    pub fn new(recording: Recording) -> RecordedRobot {
        let frames = recording.frames.iter().map(|f| (f.name.clone(), f.world_from_camera)).collect();
        let coloured = recording.frames.iter().any(|f| f.colour.is_some());
        let known = known(&recording.name, recording.intrinsics, &recording.settings, frames, coloured);
        Self::of(known, recording.start, Box::new(recording))
    }

    /// Creates a body at the first frame of a recording in a published layout.
    pub fn imported(imported: Imported) -> RecordedRobot {
        let frames = imported.frames.iter().map(|f| (f.name.clone(), f.world_from_camera)).collect();
        let coloured = imported.coloured();
        let known = known(&imported.name, imported.intrinsics, &imported.settings, frames, coloured);
        Self::of(known, 0, Box::new(imported))
    }

    /// Creates a body that has recorded frames and starts at the station with index `start`. There must be at
    /// least one station; head, arm and map of `known` are ignored.
    pub fn of(known: Known, start: usize, frames: Box<dyn Footage>) -> RecordedRobot {
        let description =
            Description { head: None, arm: None, laser: None, senses: Vec::new(), ..known.description };
        let stations = known.stations.unwrap_or_default();
        let state = State { at: start.min(stations.len().saturating_sub(1)), now_ns: known.now_ns };
        let Known { surfaces, rooms, doors, .. } = known;
        RecordedRobot { description, surfaces, rooms, doors, stations, frames, state: Mutex::new(state) }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pass(&self, seconds: f64) -> Stamp {
        let mut state = self.lock();
        state.now_ns += (seconds * 1e9).round() as Stamp;
        state.now_ns
    }

    fn index(&self, place: &Place) -> Result<usize, Failure> {
        let because = match place {
            Place::Station(name) => match self.stations.iter().position(|s| &s.name == name) {
                Some(index) => return Ok(index),
                None => format!("{} has no station \"{name}\"", self.description.name),
            },
            Place::Pose(_) => {
                format!("{} can stand at its {} stations only", self.description.name, self.stations.len())
            }
        };
        Err(Failure::Unreachable { because })
    }

    /// Cost of a straight drive between two stations, by index: max(ds/v, dθ/ω) seconds.
    fn cost(&self, from: usize, to: usize) -> Travel {
        let (a, b) = (&self.stations[from].map_from_base, &self.stations[to].map_from_base);
        let distance_m = (a.translation.vector - b.translation.vector).norm();
        let turned_rad = a.rotation.angle_to(&b.rotation);
        Travel { distance_m, duration_s: self.description.duration_s(distance_m, turned_rad) }
    }

    fn play(&self) -> Result<Sensed, Failure> {
        let Some(camera) = &self.description.camera else { return Err(self.description.lacks(Part::Camera)) };
        let stamp_ns = self.pass(FRAME_S);
        let at = self.lock().at;
        let pixels =
            self.frames.pixels(at).map_err(|because| Failure::SensorDropped { because, stamp_ns })?;
        let map_from_camera = self.stations[at].map_from_base;
        let frames = &self.description.frames;
        let link = |parent: &str, child: &str, parent_from_child| StampedTransform {
            stamp_ns,
            parent: parent.into(),
            child: child.into(),
            parent_from_child,
        };
        let exposure = Exposure {
            stamp_ns,
            intrinsics: camera.intrinsics,
            transforms: vec![
                link(&frames.map, &frames.base, map_from_camera),
                link(&frames.base, &camera.frame, Isometry3::identity()),
            ],
            map_from_camera,
            pose_sigma_m: self.description.pose_sigma_m,
            pose_sigma_rad: self.description.pose_sigma_rad,
        };
        Ok(exposure.with(pixels))
    }
}

/// True if the folder is in a published layout and has none of the files of descry's own layouts (settings,
/// camera, poses).
fn is_foreign(path: &Path) -> bool {
    let ours = [SETTINGS_FILE, CAMERA_FILE, "pose.txt"];
    !ours.iter().any(|file| path.join(file).is_file()) && layout_of(path).is_some()
}

/// Description and stations of a body that stands where the frames were taken.
fn known(
    name: &str,
    intrinsics: Intrinsics,
    settings: &Settings,
    frames: Vec<(String, Isometry3<f64>)>,
    coloured: bool,
) -> Known {
    let description = Description {
        name: format!("recording {name}"),
        simulated: false,
        base: Some(Base {
            footprint: Footprint::Disc { radius_m: 0.0 },
            speeds: Speeds {
                linear_m_s: settings.linear_m_s,
                angular_rad_s: settings.angular_deg_s.to_radians(),
            },
        }),
        head: None,
        arm: None,
        camera: Some(Camera {
            frame: "camera".into(),
            intrinsics,
            range_m: (settings.range_m[0], settings.range_m[1]),
            colour: coloured,
            latency_s: 0.0,
        }),
        laser: None,
        senses: Vec::new(),
        frames: Frames::default(),
        up: settings.up.map(|[x, y, z]| Vector3::new(x, y, z).normalize()),
        pose_sigma_m: settings.pose_sigma_m,
        pose_sigma_rad: settings.pose_sigma_deg.to_radians(),
    };
    let hint = |s: &SurfaceSettings| SurfaceHint {
        name: s.name.clone(),
        outline_m: s.outline_m.iter().map(|&[x, y]| Point2::new(x, y)).collect(),
        height_m: s.height_m,
        room: None,
    };
    let station = |(name, map_from_base)| Station { name, map_from_base };
    Known {
        description,
        surfaces: settings.surfaces.iter().map(hint).collect(),
        rooms: Vec::new(),
        doors: Vec::new(),
        stations: Some(frames.into_iter().map(station).collect()),
        map: None,
        now_ns: 0,
    }
}

impl Footage for Recording {
    fn pixels(&self, station: usize) -> Result<Pixels, String> {
        let frame = &self.frames[station];
        let depth_m = self.depth_m(frame).map_err(|e| e.to_string())?;
        let cloud = self.intrinsics.cloud_from_depth(&depth_m);
        let mut cloud = cloud.map_err(|e| format!("{}: {e}", frame.depth.display()))?;
        let image = self.colour(frame).map_err(|e| e.to_string())?;
        let registered = self.settings.registered;
        if let Some(image) = image.as_ref().filter(|i| registered && i.pixels().len() == depth_m.len()) {
            cloud.colours = Some(image.pixels().map(|p| p.0).collect());
        }
        Ok(Pixels { cloud, colour: image.map(|image| Colour { image, registered }) })
    }
}

fn go_on(watch: &Watch<'_>, what: &str) -> Result<(), Failure> {
    if watch.cancel.is_cancelled() {
        return Err(Failure::Cancelled { because: format!("{what} was stopped") });
    }
    Ok(())
}

#[async_trait::async_trait]
impl Robot for RecordedRobot {
    fn description(&self) -> &Description {
        &self.description
    }

    fn begins_again(&self) -> bool {
        true
    }

    fn now_ns(&self) -> Stamp {
        self.lock().now_ns
    }

    fn map(&self) -> Option<&OccupancyGrid> {
        None
    }

    fn surfaces(&self) -> &[SurfaceHint] {
        &self.surfaces
    }

    fn rooms(&self) -> &[Room] {
        &self.rooms
    }

    fn doors(&self) -> &[Door] {
        &self.doors
    }

    fn stations(&self) -> Option<&[Station]> {
        Some(&self.stations)
    }

    fn travel(&self, from: &Place, to: &[Place], _shut: &[String]) -> Vec<Result<Travel, Failure>> {
        let from = self.index(from);
        to.iter()
            .map(|place| {
                let from = from.as_ref().map_err(Clone::clone)?;
                Ok(self.cost(*from, self.index(place)?))
            })
            .collect()
    }

    fn camera_at(&self, place: &Place, _look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        Ok(self.stations[self.index(place)?].map_from_base)
    }

    async fn pose(&self) -> Result<PoseEstimate, Failure> {
        let state = self.lock();
        let station = &self.stations[state.at];
        Ok(PoseEstimate {
            stamp_ns: state.now_ns,
            map_from_base: station.map_from_base,
            sigma_m: self.description.pose_sigma_m,
            sigma_rad: self.description.pose_sigma_rad,
            station: Some(station.name.clone()),
        })
    }

    /// Drives to a station. A cancelled drive returns to its start, since the body cannot stand between
    /// stations.
    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure> {
        go_on(watch, "the drive")?;
        let goal = self.index(to)?;
        let from = self.lock().at;
        let travel = self.cost(from, goal);
        if travel.duration_s > watch.time_limit_s {
            self.pass(watch.time_limit_s);
            let because = format!(
                "the drive takes {:.1} s and the limit is {:.1} s",
                travel.duration_s, watch.time_limit_s
            );
            return Err(Failure::TimedOut { because });
        }
        tokio::task::yield_now().await;
        go_on(watch, "the drive")?;
        self.pass(travel.duration_s);
        self.lock().at = goal;
        (watch.progress)(&Progress {
            elapsed_s: travel.duration_s,
            fraction: 1.0,
            distance_m: travel.distance_m,
        });
        Ok(Driven {
            distance_m: travel.distance_m,
            duration_s: travel.duration_s,
            map_from_base: self.stations[goal].map_from_base,
        })
    }

    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        go_on(watch, "looking")?;
        if !point.iter().all(|x| x.is_finite()) {
            return Err(Failure::Unreachable { because: format!("{point} is no point to look at") });
        }
        let seen = self.stations[self.lock().at].map_from_base.inverse_transform_point(point);
        Ok(Looked { duration_s: 0.0, miss_rad: seen.coords.angle(&Vector3::z()) })
    }

    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        go_on(watch, "taking a frame")?;
        if watch.time_limit_s < FRAME_S {
            let because = format!("a frame takes {FRAME_S} s and the limit is {:.2} s", watch.time_limit_s);
            return Err(Failure::TimedOut { because });
        }
        self.play()
    }

    async fn wait(&self, seconds: f64, watch: &Watch<'_>) -> Result<(), Failure> {
        go_on(watch, "waiting")?;
        self.pass(seconds);
        Ok(())
    }
}
