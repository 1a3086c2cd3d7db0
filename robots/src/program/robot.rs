//! Implementation of the [`Robot`] trait for a program.

use crate::body::{
    Colour, Door, Driven, Hand, Looked, Place, Pose2, PoseEstimate, Progress, Reading, Robot, Room, Scanned,
    Sensed, Stamp, StampedTransform, Station, SurfaceHint, Travel, Watch,
};
use crate::failure::Failure;
use crate::grid::OccupancyGrid;
use crate::parts::{Camera, Description, Laser, Part};
use crate::program::hello::{Hello, PROTOCOL, PixelFormat};
use crate::program::link::{Link, Message};
use crate::program::message::{self, Arguments, amount, answer, transform};
use crate::program::peer::Peer;
use crate::program::places::{self, Places};
use crate::program::process::Process;
use crate::program::socket::Socket;
use crate::program::talk::{Done, Talk};
use crate::recorded::Known;
use crate::request::{Answer, Exposure, Pixels, Request};
use descry_perception::laser::Scan;
use image::RgbImage;
use nalgebra::{Isometry2, Isometry3, Point2, Point3, Vector2};
use std::io::{Read, Write};
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;
use tokio::sync::Mutex;

/// Limits on a program: wall-clock seconds, output, memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Maximum time from the start to the hello (the program's first message), seconds.
    pub hello_s: f64,
    /// Maximum silence during a request, seconds.
    pub silence_s: f64,
    /// Maximum time from a cancellation to the end of the request, seconds.
    pub stop_s: f64,
    /// Maximum wall-clock time by which a request may exceed its own limit on the body's clock, seconds.
    pub overrun_s: f64,
    /// Maximum number of progress messages in one request.
    pub feedback: usize,
    /// Maximum address space of each process of the program, bytes.
    pub memory_bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            hello_s: 120.0,
            silence_s: 20.0,
            stop_s: 5.0,
            overrun_s: 20.0,
            feedback: 100_000,
            memory_bytes: 8 << 30,
        }
    }
}

impl Limits {
    fn hello(&self) -> Duration {
        Duration::try_from_secs_f64(self.hello_s).unwrap_or(Duration::MAX)
    }
}

/// A program as a robot. Dropping it closes the program's input, then kills the program with all its child
/// processes.
pub struct ProgramRobot {
    known: Known,
    places: Places,
    pixels: PixelFormat,
    now_ns: AtomicI64,
    talk: Mutex<Talk>,
}

impl ProgramRobot {
    /// Starts a shell command line as a robot and receives its hello (its first message).
    ///
    /// # Errors
    /// [`Failure::Broken`] if the program does not start, or its hello is missing or invalid.
    pub fn start(command_line: &str, limits: Limits) -> Result<ProgramRobot, Failure> {
        let broken = |because: String| Failure::Broken { because: format!("`{command_line}`: {because}") };
        let (process, stdin, stdout) = Process::start(command_line, limits.memory_bytes).map_err(broken)?;
        Self::greet(Peer::Started(process), stdout, stdin, limits).map_err(broken)
    }

    /// Connects to a running robot at `HOST:PORT` or the path of a Unix socket, and receives its hello.
    /// Dropping the robot closes the connection, which is neither encrypted nor authenticated.
    ///
    /// # Errors
    /// [`Failure::Broken`] if nobody answers there, or the hello is missing or invalid.
    pub fn connect(address: &str, limits: Limits) -> Result<ProgramRobot, Failure> {
        let broken = |because: String| Failure::Broken { because: format!("{address}: {because}") };
        let socket = Socket::connect(address, limits.hello()).map_err(broken)?;
        let (from, to) = socket.ways().map_err(broken)?;
        Self::greet(Peer::Reached(socket), from, to, limits).map_err(broken)
    }

    fn greet(
        mut peer: Peer,
        from: impl Read + Send + 'static,
        to: impl Write + Send + 'static,
        limits: Limits,
    ) -> Result<ProgramRobot, String> {
        let opened = Link::open(from, to, limits.hello())
            .and_then(|(link, first)| Ok((link, read_hello(&first)?.check(&first.bytes)?)));
        let (link, greeting) = opened.map_err(|because| format!("{because}{}", peer.epitaph()))?;
        let Description { camera, laser, .. } = &greeting.known.description;
        let pixels = camera.as_ref().map_or(0, |c| c.intrinsics.width * c.intrinsics.height);
        let readings = laser.as_ref().map_or(0, |laser| laser.readings);
        link.allow_bytes(greeting.pixels.bytes(pixels).max(4 * readings));
        Ok(ProgramRobot {
            places: Places::new(greeting.clearance_m, greeting.base_from_camera),
            pixels: greeting.pixels,
            now_ns: AtomicI64::new(greeting.known.now_ns),
            talk: Mutex::new(Talk::new(link, peer, limits, greeting.known.now_ns)),
            known: greeting.known,
        })
    }

    /// Sends a request, if the body has the required part.
    async fn ask(&self, request: &Request, watch: &Watch<'_>) -> Result<Done, Failure> {
        self.ask_along(request, &[], watch).await
    }

    /// Sends a request, if the body has the required part; `route_m` is the route on the map and is used for
    /// a drive only.
    async fn ask_along(
        &self,
        request: &Request,
        route_m: &[Point2<f64>],
        watch: &Watch<'_>,
    ) -> Result<Done, Failure> {
        request.needs().map_or(Ok(()), |part| self.known.description.need(part))?;
        if watch.cancel.is_cancelled() {
            return Err(Failure::Cancelled { because: format!("{} was not begun", request.name()) });
        }
        let mut talk = self.talk.lock().await;
        let before_ns = talk.now_ns;
        let told = |now_ns: Stamp| self.now_ns.store(now_ns, Ordering::Release);
        let progress = |now_ns: Stamp, fraction: f64, distance_m: f64| {
            told(now_ns);
            let elapsed_s = (now_ns - before_ns) as f64 * 1e-9;
            (watch.progress)(&Progress { elapsed_s, fraction, distance_m });
        };
        let done = talk.ask(request.name(), Arguments::of(request, route_m), watch, &progress).await;
        told(talk.now_ns);
        done
    }

    /// Passes on a valid answer; an invalid one ends the program, and every later request fails.
    async fn hold<T>(&self, checked: Result<T, String>) -> Result<T, Failure> {
        match checked {
            Ok(answer) => Ok(answer),
            Err(because) => Err(self.talk.lock().await.end(because)),
        }
    }

    fn sensed(&self, camera: &Camera, done: Done) -> Result<Sensed, String> {
        let said: message::SensedSaid = answer("sense", done.said)?;
        let earliest_ns = done.before_ns.saturating_sub((camera.latency_s * 1e9) as Stamp);
        let stamp_ns = stamp("a frame", said.stamp_ns, (earliest_ns, done.now_ns)).map_err(|e| {
            format!("{e}; a camera whose driver buffers frames says so with \"latency_s\" in its hello")
        })?;
        let (map_from_base, base_from_camera) =
            (transform(&said.map_from_base)?, transform(&said.base_from_camera)?);
        let d = &self.known.description;
        let exposure = Exposure {
            stamp_ns,
            intrinsics: camera.intrinsics,
            transforms: vec![
                link(stamp_ns, &d.frames.map, &d.frames.base, map_from_base),
                link(stamp_ns, &d.frames.base, &camera.frame, base_from_camera),
            ],
            map_from_camera: map_from_base * base_from_camera,
            pose_sigma_m: d.pose_sigma_m,
            pose_sigma_rad: d.pose_sigma_rad,
        };
        Ok(exposure.with(read_pixels(camera, self.pixels, &done.bytes)?))
    }

    fn scanned(&self, laser: &Laser, done: Done) -> Result<Scanned, String> {
        let said: message::ScannedSaid = answer("scan", done.said)?;
        let stamp_ns = stamp("a sweep", said.stamp_ns, (done.before_ns, done.now_ns))?;
        let map_from_base = transform(&said.map_from_base)?;
        let d = &self.known.description;
        Ok(Scanned {
            stamp_ns,
            scan: Scan {
                angles_rad: (0..laser.readings)
                    .map(|i| laser.first_rad + laser.step_rad * i as f64)
                    .collect(),
                ranges_m: read_ranges(laser, &done.bytes)?,
                map_from_laser: level(&(map_from_base * laser.base_from_laser)),
            },
            transforms: vec![
                link(stamp_ns, &d.frames.map, &d.frames.base, map_from_base),
                link(stamp_ns, &d.frames.base, &laser.frame, laser.base_from_laser),
            ],
            pose_sigma_m: d.pose_sigma_m,
            pose_sigma_rad: d.pose_sigma_rad,
        })
    }
}

/// Time stamp of an answer: the stated one, or else the end of the request. A stated one must lie between the
/// two given times.
fn stamp(what: &str, said_ns: Option<Stamp>, (before_ns, now_ns): (Stamp, Stamp)) -> Result<Stamp, String> {
    let stamp_ns = said_ns.unwrap_or(now_ns);
    match (before_ns..=now_ns).contains(&stamp_ns) {
        true => Ok(stamp_ns),
        false => Err(format!("{what} of {stamp_ns} ns, taken between {before_ns} and {now_ns} ns")),
    }
}

fn link(stamp_ns: Stamp, parent: &str, child: &str, parent_from_child: Isometry3<f64>) -> StampedTransform {
    StampedTransform { stamp_ns, parent: parent.into(), child: child.into(), parent_from_child }
}

/// Projects a pose onto the floor.
fn level(pose: &Isometry3<f64>) -> Isometry2<f64> {
    let Pose2 { x_m, y_m, yaw_rad } = Pose2::from_isometry(pose);
    Isometry2::new(Vector2::new(x_m, y_m), yaw_rad)
}

/// Decodes ranges in metres, each a little-endian `f32`. Ranges beyond the laser's reach become infinite: no
/// return.
fn read_ranges(laser: &Laser, bytes: &[u8]) -> Result<Vec<f64>, String> {
    if bytes.len() != 4 * laser.readings {
        return Err(format!("a sweep of {} bytes, expected {}", bytes.len(), 4 * laser.readings));
    }
    let metres = |b: &[u8]| match f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])) {
        range_m if range_m > laser.reach_m => f64::INFINITY,
        range_m => range_m,
    };
    Ok(bytes.chunks_exact(4).map(metres).collect())
}

fn read_hello(first: &Message) -> Result<Hello, String> {
    #[derive(serde::Deserialize)]
    struct First<T> {
        hello: T,
    }
    #[derive(serde::Deserialize)]
    struct Version {
        protocol: u32,
    }
    let none = |e| format!("its hello is none: {e}");
    // The version first: another one has other fields.
    let First { hello: Version { protocol } } = serde_json::from_str(&first.line).map_err(none)?;
    if protocol != PROTOCOL {
        return Err(format!("it speaks protocol {protocol}, and this is protocol {PROTOCOL}"));
    }
    serde_json::from_str(&first.line).map(|first: First<Hello>| first.hello).map_err(none)
}

fn read_pixels(camera: &Camera, format: PixelFormat, bytes: &[u8]) -> Result<Pixels, String> {
    let Camera { intrinsics, range_m: (near_m, far_m), .. } = *camera;
    let pixels = intrinsics.width * intrinsics.height;
    if bytes.len() != format.bytes(pixels) {
        return Err(format!("a frame of {} bytes, expected {}", bytes.len(), format.bytes(pixels)));
    }
    let (depths, colours) = bytes.split_at(2 * pixels);
    let metres = |steps: &[u8]| {
        let z = f64::from(u16::from_le_bytes([steps[0], steps[1]])) * format.unit_m;
        if z > 0.0 && z >= near_m && z <= far_m { z as f32 } else { f32::NAN }
    };
    let depth_m: Vec<f32> = depths.chunks_exact(2).map(metres).collect();
    let mut cloud = intrinsics.cloud_from_depth(&depth_m).map_err(|e| e.to_string())?;
    let image = format
        .colour
        .then(|| RgbImage::from_raw(intrinsics.width as u32, intrinsics.height as u32, colours.to_vec()))
        .flatten();
    if image.is_some() {
        cloud.colours = Some(colours.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect());
    }
    Ok(Pixels { cloud, colour: image.map(|image| Colour { image, registered: true }) })
}

#[async_trait::async_trait]
impl Robot for ProgramRobot {
    fn description(&self) -> &Description {
        &self.known.description
    }

    fn now_ns(&self) -> Stamp {
        self.now_ns.load(Ordering::Acquire)
    }

    fn map(&self) -> Option<&OccupancyGrid> {
        self.known.map.as_ref()
    }

    fn surfaces(&self) -> &[SurfaceHint] {
        &self.known.surfaces
    }

    fn stations(&self) -> Option<&[Station]> {
        self.known.stations.as_deref()
    }

    fn rooms(&self) -> &[Room] {
        &self.known.rooms
    }

    fn doors(&self) -> &[Door] {
        &self.known.doors
    }

    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>> {
        self.places.travel(&self.known, from, to, shut)
    }

    fn camera_at(&self, place: &Place, look_at: Option<&Point3<f64>>) -> Result<Isometry3<f64>, Failure> {
        self.places.camera_at(&self.known, place, look_at)
    }

    async fn pose(&self) -> Result<PoseEstimate, Failure> {
        let done = self.ask(&Request::Pose, &Watch::default()).await?;
        let d = &self.known.description;
        let read = |done: Done| {
            let said: message::PoseSaid = answer("pose", done.said)?;
            if said.station.is_some() != self.known.stations.is_some() {
                return Err(format!("it stands at the station {:?}", said.station));
            }
            Ok(PoseEstimate {
                stamp_ns: done.now_ns,
                map_from_base: transform(&said.map_from_base)?,
                sigma_m: amount("sigma_m", said.sigma_m.unwrap_or(d.pose_sigma_m))?,
                sigma_rad: amount("sigma_rad", said.sigma_rad.unwrap_or(d.pose_sigma_rad))?,
                station: said.station,
            })
        };
        self.hold(read(done)).await
    }

    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure> {
        places::stand(&self.known, to)?;
        if watch.cancel.is_cancelled() {
            return Err(Failure::Cancelled { because: "the drive was not begun".into() });
        }
        let here = self.pose().await?;
        let route_m = self.places.route(&self.known, &here.map_from_base, to)?;
        let done = self.ask_along(&Request::DriveTo(to.clone()), &route_m, watch).await;
        if let Err(Failure::Blocked { by: Some(door), .. }) = &done
            && self.known.doors.iter().any(|d| &d.name == door)
        {
            self.places.met_door(door, true);
        }
        let done = done?;
        let read = |done: Done| {
            let duration_s = done.duration_s();
            let said: message::DrivenSaid = answer("drive_to", done.said)?;
            Ok(Driven {
                distance_m: amount("distance_m", said.distance_m)?,
                duration_s,
                map_from_base: transform(&said.map_from_base)?,
            })
        };
        self.hold(read(done)).await
    }

    async fn look_at(&self, point: &Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(Failure::Unreachable { because: format!("{point} is no point to look at") });
        }
        self.known.description.need(Part::Camera)?;
        if self.known.description.head.is_none() {
            if watch.cancel.is_cancelled() {
                return Err(Failure::Cancelled { because: "look_at was not begun".into() });
            }
            // Nothing is there to be turned: the program is not asked.
            let here = self.pose().await?.map_from_base;
            return Ok(Looked { duration_s: 0.0, miss_rad: self.places.miss_rad(&here, point) });
        }
        let done = self.ask(&Request::LookAt(*point), watch).await?;
        let duration_s = done.duration_s();
        let said = answer("look_at", done.said).and_then(|said: message::LookedSaid| {
            Ok(Looked { duration_s, miss_rad: amount("miss_rad", said.miss_rad)? })
        });
        self.hold(said).await
    }

    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        let done = self.ask(&Request::Sense, watch).await?;
        let Some(camera) = &self.known.description.camera else { return Err(self.lacks(Part::Camera)) };
        self.hold(self.sensed(camera, done)).await
    }

    async fn scan(&self, watch: &Watch<'_>) -> Result<Scanned, Failure> {
        let done = self.ask(&Request::Scan, watch).await?;
        let Some(laser) = &self.known.description.laser else { return Err(self.lacks(Part::Laser)) };
        self.hold(self.scanned(laser, done)).await
    }

    async fn read(&self, sense: &str, watch: &Watch<'_>) -> Result<Reading, Failure> {
        let body = &self.known.description;
        if !body.senses.iter().any(|s| s.name == sense) {
            return Err(body.lacks_sense(sense));
        }
        let done = self.ask(&Request::Read(sense.into()), watch).await?;
        let (before_ns, now_ns) = (done.before_ns, done.now_ns);
        let read = answer("read", done.said).and_then(|said: message::ReadSaid| {
            let stamp_ns = stamp("a reading", said.stamp_ns, (before_ns, now_ns))?;
            Ok(Reading { stamp_ns, said: said.said })
        });
        self.hold(read).await
    }

    async fn manipulate(&self, request: &Request, watch: &Watch<'_>) -> Result<Answer, Failure> {
        self.can_begin(request)?;
        let done = self.ask(request, watch).await?;
        let duration_s = done.duration_s();
        let answer = self.hold(message::manipulated(request, done.said, duration_s)).await?;
        if let Request::OpenDoor(door) = request {
            self.places.met_door(door, false);
        }
        Ok(answer)
    }

    async fn hand(&self) -> Result<Hand, Failure> {
        let done = self.ask(&Request::Hand, &Watch::default()).await?;
        self.hold(answer("hand", done.said)).await
    }

    /// Reads the clock, which runs by itself, with the next answer of the program.
    async fn wait(&self, _seconds: f64, _watch: &Watch<'_>) -> Result<(), Failure> {
        match self.pose().await {
            Err(broken @ Failure::Broken { .. }) => Err(broken),
            _ => Ok(()),
        }
    }
}

impl ProgramRobot {
    fn lacks(&self, part: Part) -> Failure {
        self.known.description.lacks(part)
    }

    /// Checks that the body has the arm or hand that a request needs, that the target is a point or a known
    /// door, and that a push has a direction and a length.
    fn can_begin(&self, request: &Request) -> Result<(), Failure> {
        let body = &self.known.description;
        request.needs().map_or(Ok(()), |part| body.need(part))?;
        let because = match request {
            Request::OpenDoor(door) if self.known.doors.iter().all(|d| d.name != *door) => {
                format!("{} knows no door \"{door}\"", body.name)
            }
            Request::PushAside(push) if !push.is_definite() => {
                "a push needs a direction and a distance".into()
            }
            _ => match request.target() {
                Some(point) if !point.iter().all(|x| x.is_finite()) => {
                    format!("{point} is no place for a hand")
                }
                _ => return Ok(()),
            },
        };
        Err(Failure::Unreachable { because })
    }
}
