//! Scenes as people write them: a room, surfaces, obstacles, a start and objects, in TOML.
//!
//! ```toml
//! title = "Cup A behind a box"
//!
//! [room]                            # walls around it, its centre is the map's origin
//! size_m = [6.0, 5.0]
//!
//! [[surface]]                       # `position_m` is the centre, in the map
//! name = "table"
//! size_m = [1.6, 0.8]
//! height_m = 0.72
//!
//! [[surface]]
//! name = "upper board"
//! kind = "board"                    # without legs; several above each other are a shelf
//! uprights = true                   # with sides down to the floor
//! position_m = [2.0, 2.35]
//! size_m = [0.9, 0.3]
//! height_m = 1.15
//!
//! [[obstacle]]                      # boxes on the floor; with `on_map = false` missing in the robot's map
//! name = "cupboard"
//! position_m = [2.6, -1.5]
//! size_m = [0.5, 1.0, 1.8]
//!
//! [[obstacle]]
//! name = "garbage can"
//! on_map = false
//! position_m = [0.5, 0.0]
//! spread_m = [4.0, 3.0]             # somewhere in this rectangle around its position, turned by the seed
//! gap_m = 1.5                       # from all obstacles above it
//! size_m = [0.32, 0.32, 0.6]
//! corner_m = 0.12                   # radius of its upright edges; `legs_m = 0.03` makes a seat on four legs, `back_m = 0.4` with it a chair
//!
//! [start]
//! position_m = [-2.2, 0.0]
//! yaw_deg = 0.0
//!
//! [[object]]                        # `position_m` (from the centre of the surface) fixes it; else the seed does
//! name = "cup A"                    # unique; `kind` is what it is, the name if left out
//! shape.cup = { diameter_m = 0.070, height_m = 0.104 }
//! colour = [40, 140, 60]
//!
//! [[object]]
//! name = "box"
//! on = ["table", "upper board"]     # the surface, or several of which the seed chooses; the first of the scene if left out
//! weights = [3.0, 1.0]              # weight of each surface; equal if left out
//! apart_from = "cup A"              # on another surface than this earlier object
//! shape.box = { size_m = [0.25, 0.12, 0.28] }
//! area_m = [0.8, 0.5]               # arranged within this rectangle around the centre of the surface
//! scale = [0.9, 1.1]                # scaled by a factor that the seed draws
//!
//! [target]                          # only arrangements are taken where this holds
//! object = "cup A"
//! visible_from_start = [0.0, 0.0]   # minimum and maximum share of the object that is visible from the start
//! visible_from_some = 0.6           # minimum share that is visible from some pose around the surface
//! ```
//!
//! With `mapped = false` at the beginning, the body has no map of the scene and knows only its own pose in it.
//! A stereo camera may replace the depth camera:
//!
//! ```toml
//! [stereo]
//! baseline_m = 0.1
//! disparity_sigma_px = 0.3          # depth is off by z²·0.3/(f·0.1)
//! textured = 0.5                    # share of floor and walls on which anything can be matched
//! ```
//!
//! Light that differs from seed to seed is given by ranges:
//!
//! ```toml
//! [light]
//! gain = [0.5, 1.3]                 # brightness
//! cast = 0.15                       # spread of the gains of red and of blue
//! gloss = 0.8                       # white in highlights
//! noise = 4.0                       # of 255, each channel of each pixel
//! ```
//!
//! One scene describes several visits, between which objects come, go and move; `visit = 2` at the beginning
//! selects the second:
//!
//! ```toml
//! visits = 3                        # at the beginning
//!
//! [[object]]
//! name = "kettle"
//! shape.household = "kettle"        # composed of several solids, painted; or shape.composed = { parts = [...] }
//! visits = [2, 3]                   # visits in which it is present; all if left out
//! moves = [3]                       # visits in which it stands elsewhere than in the one before
//! ```
//!
//! A flat has several rooms. The space between them is wall, as high as the highest room; doors are openings
//! in it:
//!
//! ```toml
//! [[room]]
//! name = "kitchen"
//! position_m = [-2.0, 0.0]          # centre, in the map
//! size_m = [3.9, 4.0]               # inside
//!
//! [[room]]
//! name = "hall"
//! position_m = [1.0, 0.0]           # the wall between the two is 0.05 m thick; rooms that touch have none
//! size_m = [2.0, 4.0]
//!
//! [[door]]
//! name = "kitchen door"
//! position_m = [-0.025, 0.5]        # middle of the opening, within the wall
//! width_m = 0.9
//! shut_chance = 0.3                 # or state = "open" or "shut"
//! ```

mod check;
mod door;
mod object;
mod one_or_many;
mod room;
mod surface;

pub use door::{DoorSpec, DoorState, Doorway};
pub use object::{ObjectSpec, TargetSpec};
pub use room::RoomSpec;
pub(crate) use surface::headroom_m;
pub use surface::{ObstacleSpec, SurfaceKind, SurfaceSpec};

use crate::input::{self, InputError, Objection, Step};
use crate::sim::faults::{Fault, FaultPlan};
use crate::sim::light::Light;
use crate::sim::stereo::Stereo;
use check::{finite, object, positive};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Content of a scene file: fixed values, and ranges from which a seed draws.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Title for people.
    #[serde(default)]
    pub title: String,
    /// Rooms: a single one, or several with walls between them.
    #[serde(default = "room::one_room", rename = "room", with = "one_or_many")]
    pub rooms: Vec<RoomSpec>,
    /// Doors in the walls between rooms.
    #[serde(default, rename = "door", skip_serializing_if = "Vec::is_empty")]
    pub doors: Vec<DoorSpec>,
    /// Support surfaces.
    #[serde(default, rename = "surface")]
    pub surfaces: Vec<SurfaceSpec>,
    /// Obstacles on the floor.
    #[serde(default, rename = "obstacle")]
    pub obstacles: Vec<ObstacleSpec>,
    /// Initial pose of the robot.
    pub start: StartSpec,
    /// Objects on surfaces.
    #[serde(default, rename = "object")]
    pub objects: Vec<ObjectSpec>,
    /// Minimum gap between objects on a surface, metres.
    #[serde(default = "default_gap_m")]
    pub gap_m: f64,
    /// Required visibility of one object.
    #[serde(default)]
    pub target: Option<TargetSpec>,
    /// False if the body has no map of the scene.
    #[serde(default = "default_true")]
    pub mapped: bool,
    /// Stereo camera in place of the depth camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stereo: Option<Stereo>,
    /// Light that the seed draws; without it, colours are as stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Light>,
    /// Number of visits, between which objects appear, disappear and move.
    #[serde(default = "default_one")]
    pub visits: usize,
    /// Number of the current visit, from 1.
    #[serde(default = "default_one")]
    pub visit: usize,
    /// Injected faults.
    #[serde(default, rename = "fault", skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

fn default_one() -> usize {
    1
}

fn default_true() -> bool {
    true
}

/// Initial pose of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartSpec {
    /// Position in the map frame, metres.
    pub position_m: [f64; 2],
    /// Heading, counter-clockwise from the map's x, degrees.
    #[serde(default)]
    pub yaw_deg: f64,
}

fn default_gap_m() -> f64 {
    0.02
}
fn default_grey() -> [u8; 3] {
    [150, 150, 150]
}

impl FaultPlan {
    /// Joins the faults of a scene with these faults, the scene's first.
    pub fn after(self, scene: &SceneSpec) -> FaultPlan {
        FaultPlan { faults: scene.faults.iter().cloned().chain(self.faults).collect() }
    }
}

impl SceneSpec {
    /// Parses a scene; `file` is the name of the file in messages.
    ///
    /// # Errors
    /// The first error, with its place in the text and a fix.
    pub fn parse(file: &str, text: &str) -> Result<SceneSpec, InputError> {
        let spec: SceneSpec = input::parse_toml(file, text)?;
        match spec.check() {
            Ok(()) => Ok(spec),
            Err(objection) => Err(input::draw(file, text, objection)),
        }
    }

    /// Copies the scene without an object (or all objects of a kind), for questions about absent things; a
    /// `[target]` about it is removed as well.
    pub fn without(&self, name_or_kind: &str) -> SceneSpec {
        let mut spec = self.clone();
        spec.objects.retain(|o| o.name != name_or_kind && o.kind.as_deref() != Some(name_or_kind));
        let known: Vec<String> = spec.objects.iter().map(|o| o.name.clone()).collect();
        for o in &mut spec.objects {
            o.apart_from = o.apart_from.take().filter(|other| known.contains(other));
        }
        spec.target = spec.target.filter(|t| spec.objects.iter().any(|o| o.name == t.object));
        spec
    }

    /// Checks what the format cannot express: positive sizes, unique and known names, everything within the
    /// room.
    ///
    /// # Errors
    /// The first objection, with its path in the document.
    pub fn check(&self) -> Result<(), Objection> {
        self.check_rooms()?;
        FaultPlan { faults: self.faults.clone() }.check()?;
        for (i, door) in self.doors.iter().enumerate() {
            self.check_door(i, door)?;
        }
        finite(&[self.gap_m], &[Step::Key("gap_m")])?;
        self.check_start()?;
        for (i, s) in self.surfaces.iter().enumerate() {
            self.check_surface(i, s)?;
        }
        for (i, o) in self.obstacles.iter().enumerate() {
            self.check_obstacle(i, o)?;
        }
        for (i, o) in self.objects.iter().enumerate() {
            self.check_object(i, o)?;
        }
        self.check_stereo()?;
        self.check_light()?;
        self.check_visits()?;
        self.check_target()
    }

    /// True if something that is present in these visits (empty: all) is present in `visit`.
    pub(crate) fn is_there(&self, visits: &[usize], visit: usize) -> bool {
        visits.is_empty() || visits.contains(&visit)
    }

    fn check_visits(&self) -> Result<(), Objection> {
        let known = 1..=self.visits;
        let within = |path: &[Step], visits: &[usize]| match visits.iter().find(|v| !known.contains(v)) {
            Some(visit) => Err(object(
                path,
                format!("there is no visit {visit}"),
                format!("1 to {}, or another `visits` of the scene", self.visits),
            )),
            None => Ok(()),
        };
        within(&[Step::Key("visit")], &[self.visit])?;
        for (i, o) in self.obstacles.iter().enumerate() {
            within(&[Step::Key("obstacle"), Step::Index(i), Step::Key("visits")], &o.visits)?;
        }
        for (i, o) in self.objects.iter().enumerate() {
            let at = |key| [Step::Key("object"), Step::Index(i), Step::Key(key)];
            within(&at("visits"), &o.visits)?;
            within(&at("moves"), &o.moves)?;
            if self.visits > 1 && o.apart_from.is_some() {
                let mend = "name its surface with `on`";
                return Err(object(
                    &at("apart_from"),
                    "what moves between visits is not kept apart".into(),
                    mend.into(),
                ));
            }
        }
        match &self.target {
            Some(_) if self.visits > 1 => Err(object(
                &[Step::Key("target")],
                "a scene of several visits is not arranged around one object".into(),
                "leave [target] out".into(),
            )),
            _ => Ok(()),
        }
    }

    fn check_light(&self) -> Result<(), Objection> {
        let Some(light) = &self.light else { return Ok(()) };
        let at = |key| [Step::Key("light"), Step::Key(key)];
        positive(&[light.gain.0, light.gain.1], &at("gain"))?;
        if light.gain.1 < light.gain.0 {
            let problem = format!("found [{}, {}]", light.gain.0, light.gain.1);
            return Err(object(&at("gain"), problem, "write [least, greatest]".into()));
        }
        let rest = [("cast", light.cast, 1.0), ("gloss", light.gloss, 1.0), ("noise", light.noise, 255.0)];
        match rest.into_iter().find(|(_, value, most)| !(0.0..=*most).contains(value)) {
            Some((key, value, most)) => {
                Err(object(&at(key), format!("found {value}"), format!("a number from 0 to {most}")))
            }
            None => Ok(()),
        }
    }

    fn check_stereo(&self) -> Result<(), Objection> {
        let Some(stereo) = &self.stereo else { return Ok(()) };
        let at = |key| [Step::Key("stereo"), Step::Key(key)];
        positive(&[stereo.baseline_m], &at("baseline_m"))?;
        finite(&[stereo.disparity_sigma_px], &at("disparity_sigma_px"))?;
        if !(0.0..=1.0).contains(&stereo.textured) {
            let problem = format!("found {}, expected a share", stereo.textured);
            return Err(object(&at("textured"), problem, "0 to 1".into()));
        }
        positive(&[stereo.range_m.0, stereo.range_m.1 - stereo.range_m.0], &at("range_m"))
    }

    fn check_start(&self) -> Result<(), Objection> {
        let at = [Step::Key("start"), Step::Key("position_m")];
        finite(&self.start.position_m, &at)?;
        finite(&[self.start.yaw_deg], &[Step::Key("start"), Step::Key("yaw_deg")])?;
        if self.rooms.iter().any(|r| r.holds(&Point2::from(self.start.position_m), 0.0)) {
            return Ok(());
        }
        let outer = RoomSpec::around(&self.rooms);
        let (low, high) = (outer.low(), outer.high());
        Err(object(
            &at,
            "the start lies outside the room".into(),
            format!("x between {} and {}, y between {} and {}", low.x, high.x, low.y, high.y),
        ))
    }
}
