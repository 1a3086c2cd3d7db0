//! Scenes as people write them: a room, surfaces, obstacles, a start and objects, in TOML.
//!
//! ```toml
//! title = "Cup A behind a box"
//!
//! [room]                            # walls around it, its centre is the map's origin
//! size_m = [6.0, 5.0]
//!
//! [[surface]]                       # tables; `position_m` is the centre, in the map
//! name = "table"
//! size_m = [1.6, 0.8]
//! height_m = 0.72
//!
//! [[obstacle]]                      # boxes on the floor; `on_map = false`: nobody told the robot
//! name = "cupboard"
//! position_m = [2.6, -1.5]
//! size_m = [0.5, 1.0, 1.8]
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
//! shape.box = { size_m = [0.25, 0.12, 0.28] }
//! area_m = [0.8, 0.5]               # arranged within this rectangle around the centre of the surface
//! scale = [0.9, 1.1]                # made larger or smaller by the seed
//!
//! [target]                          # only arrangements are taken where this holds
//! object = "cup A"
//! visible_from_start = [0.0, 0.0]   # least and greatest share of it that the camera sees from the start
//! visible_from_some = 0.6           # and what some pose around the surface sees at least
//! ```

use crate::input::{self, InputError, Objection, Step};
use crate::sim::shape::{Cuboid, Shape};
use serde::{Deserialize, Serialize};

/// A scene as written: what is fixed and what a seed may choose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// One line for people.
    #[serde(default)]
    pub title: String,
    /// The room.
    #[serde(default)]
    pub room: RoomSpec,
    /// Surfaces; things stand on them.
    #[serde(default, rename = "surface")]
    pub surfaces: Vec<SurfaceSpec>,
    /// Things on the floor.
    #[serde(default, rename = "obstacle")]
    pub obstacles: Vec<ObstacleSpec>,
    /// Where the robot stands first.
    pub start: StartSpec,
    /// Things on surfaces.
    #[serde(default, rename = "object")]
    pub objects: Vec<ObjectSpec>,
    /// Least gap between things on a surface, metres.
    #[serde(default = "default_gap_m")]
    pub gap_m: f64,
    /// What the arrangement must show and hide.
    #[serde(default)]
    pub target: Option<TargetSpec>,
}

/// The room: a rectangle of floor around the map's origin, with walls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomSpec {
    /// Inside, along x and y.
    pub size_m: [f64; 2],
    /// Of the walls.
    #[serde(default = "default_wall_height_m")]
    pub wall_height_m: f64,
}

impl Default for RoomSpec {
    fn default() -> Self {
        RoomSpec { size_m: [6.0, 5.0], wall_height_m: default_wall_height_m() }
    }
}

/// A table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSpec {
    /// Unique among the surfaces.
    pub name: String,
    /// Centre, in the map.
    #[serde(default)]
    pub position_m: [f64; 2],
    /// Counter-clockwise.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Along its own x and y.
    pub size_m: [f64; 2],
    /// Of the top above the floor.
    pub height_m: f64,
    /// Of the top.
    #[serde(default = "default_thickness_m")]
    pub thickness_m: f64,
    /// Red, green, blue.
    #[serde(default = "default_wood")]
    pub colour: [u8; 3],
}

/// A box on the floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSpec {
    /// For messages.
    pub name: String,
    /// Centre, in the map.
    pub position_m: [f64; 2],
    /// Counter-clockwise.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Along its own x and y, and its height.
    pub size_m: [f64; 3],
    /// True if the robot's map shows it.
    #[serde(default = "default_true")]
    pub on_map: bool,
    /// Red, green, blue.
    #[serde(default = "default_grey")]
    pub colour: [u8; 3],
}

/// Where the robot stands first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartSpec {
    /// In the map.
    pub position_m: [f64; 2],
    /// Counter-clockwise from the map's x.
    #[serde(default)]
    pub yaw_deg: f64,
}

/// A thing on a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSpec {
    /// Unique in the scene.
    pub name: String,
    /// What it is; the name if left out.
    #[serde(default)]
    pub kind: Option<String>,
    /// Its solid.
    pub shape: Shape,
    /// The surface it stands on; the first if left out.
    #[serde(default)]
    pub on: Option<String>,
    /// Fixes it: from the centre of the surface, along its axes.
    #[serde(default)]
    pub position_m: Option<[f64; 2]>,
    /// Fixes its turn on the surface.
    #[serde(default)]
    pub yaw_deg: Option<f64>,
    /// Arranged within this rectangle, along the surface's axes; all of the surface if left out.
    #[serde(default)]
    pub area_m: Option<[f64; 2]>,
    /// Centre of that rectangle, from the centre of the surface.
    #[serde(default)]
    pub area_centre_m: [f64; 2],
    /// Least and greatest factor on its size, chosen by the seed.
    #[serde(default)]
    pub scale: Option<[f64; 2]>,
    /// Red, green, blue.
    #[serde(default = "default_grey")]
    pub colour: [u8; 3],
}

/// What an arrangement must show and hide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetSpec {
    /// Name of the object.
    pub object: String,
    /// Least and greatest share of it that is not occluded from the start, when the camera looks there. 0 to 0 hides it.
    #[serde(default = "default_any_share")]
    pub visible_from_start: [f64; 2],
    /// Some pose around its surface must see at least this share of it; 0 asks for nothing.
    #[serde(default = "default_some_share")]
    pub visible_from_some: f64,
}

/// A room's map is held in cells of a few centimetres: this is millions of them.
const LARGEST_ROOM_M: f64 = 100.0;

fn default_gap_m() -> f64 {
    0.02
}
fn default_wall_height_m() -> f64 {
    2.5
}
fn default_thickness_m() -> f64 {
    0.03
}
fn default_true() -> bool {
    true
}
fn default_wood() -> [u8; 3] {
    [170, 130, 90]
}
fn default_grey() -> [u8; 3] {
    [150, 150, 150]
}
fn default_any_share() -> [f64; 2] {
    [0.0, 1.0]
}
fn default_some_share() -> f64 {
    0.6
}

impl SceneSpec {
    /// Reads a scene. `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake, with its place in the text and how to mend it.
    pub fn parse(file: &str, text: &str) -> Result<SceneSpec, InputError> {
        let spec: SceneSpec = input::parse_toml(file, text)?;
        match spec.check() {
            Ok(()) => Ok(spec),
            Err(objection) => Err(input::draw(file, text, objection)),
        }
    }

    /// The scene without an object (or all objects of that kind): for questions about what is not there. Its `[target]` goes with it.
    pub fn without(&self, name_or_kind: &str) -> SceneSpec {
        let mut spec = self.clone();
        spec.objects.retain(|o| o.name != name_or_kind && o.kind.as_deref() != Some(name_or_kind));
        spec.target = spec.target.filter(|t| spec.objects.iter().any(|o| o.name == t.object));
        spec
    }

    /// Checks what the format cannot: sizes above zero, names unique and known, things within the room.
    ///
    /// # Errors
    /// The first objection, with its path in the document.
    pub fn check(&self) -> Result<(), Objection> {
        positive(&self.room.size_m, &[Step::Key("room"), Step::Key("size_m")])?;
        positive(&[self.room.wall_height_m], &[Step::Key("room"), Step::Key("wall_height_m")])?;
        if let Some(side) = self.room.size_m.iter().find(|s| **s > LARGEST_ROOM_M) {
            return Err(object(
                &[Step::Key("room"), Step::Key("size_m")],
                format!("a room of {side} m is larger than this simulator maps"),
                format!("at most {LARGEST_ROOM_M} m a side"),
            ));
        }
        finite(&[self.gap_m], &[Step::Key("gap_m")])?;
        self.check_start()?;
        for (i, s) in self.surfaces.iter().enumerate() {
            self.check_surface(i, s)?;
        }
        for (i, o) in self.obstacles.iter().enumerate() {
            let at = |key| [Step::Key("obstacle"), Step::Index(i), Step::Key(key)];
            positive(&o.size_m, &at("size_m"))?;
            finite(&[o.position_m[0], o.position_m[1], o.yaw_deg], &at("position_m"))?;
        }
        for (i, o) in self.objects.iter().enumerate() {
            self.check_object(i, o)?;
        }
        self.check_target()
    }

    fn check_start(&self) -> Result<(), Objection> {
        let at = [Step::Key("start"), Step::Key("position_m")];
        finite(&self.start.position_m, &at)?;
        finite(&[self.start.yaw_deg], &[Step::Key("start"), Step::Key("yaw_deg")])?;
        let inside = (0..2).all(|k| self.start.position_m[k].abs() < 0.5 * self.room.size_m[k]);
        if !inside {
            let [x, y] = self.room.size_m.map(|s| 0.5 * s);
            return Err(object(
                &at,
                "the start lies outside the room".into(),
                format!("x between -{x} and {x}, y between -{y} and {y}"),
            ));
        }
        Ok(())
    }

    fn check_surface(&self, i: usize, s: &SurfaceSpec) -> Result<(), Objection> {
        let at = |key| [Step::Key("surface"), Step::Index(i), Step::Key(key)];
        positive(&s.size_m, &at("size_m"))?;
        positive(&[s.height_m], &at("height_m"))?;
        positive(&[s.thickness_m], &at("thickness_m"))?;
        finite(&s.position_m, &at("position_m"))?;
        finite(&[s.yaw_deg], &at("yaw_deg"))?;
        if s.thickness_m >= s.height_m {
            return Err(object(
                &at("thickness_m"),
                format!("the top is {} m thick and {} m high", s.thickness_m, s.height_m),
                "make the top thinner than it is high".into(),
            ));
        }
        if self.surfaces[..i].iter().any(|o| o.name == s.name) {
            return Err(object(
                &at("name"),
                format!("a second surface is called \"{}\"", s.name),
                "give each its own name".into(),
            ));
        }
        Ok(())
    }

    fn check_object(&self, i: usize, o: &ObjectSpec) -> Result<(), Objection> {
        let at = |key| vec![Step::Key("object"), Step::Index(i), Step::Key(key)];
        if self.objects[..i].iter().any(|other| other.name == o.name) {
            return Err(object(
                &at("name"),
                format!("a second object is called \"{}\"", o.name),
                "give each its own name; `kind` may be the same".into(),
            ));
        }
        check_shape(&o.shape, &at("shape"))?;
        let Some(surface) = self.surface_of(o) else {
            let known: Vec<&str> = self.surfaces.iter().map(|s| s.name.as_str()).collect();
            let (problem, mend) = match &o.on {
                Some(on) => (
                    format!("there is no surface \"{on}\""),
                    format!(
                        "one of: {}",
                        if known.is_empty() { "none yet".into() } else { known.join(", ") }
                    ),
                ),
                None => ("the scene has no surface to stand on".into(), "add a [[surface]]".into()),
            };
            return Err(object(&at("on"), problem, mend));
        };
        if let Some(area) = o.area_m {
            positive(&area, &at("area_m"))?;
        }
        finite(&o.area_centre_m, &at("area_centre_m"))?;
        if let Some([low, high]) = o.scale {
            positive(&[low, high], &at("scale"))?;
            if low > high {
                return Err(object(
                    &at("scale"),
                    format!("the least factor {low} is above the greatest {high}"),
                    format!("[{high}, {low}]"),
                ));
            }
            check_shape(&o.shape.scaled(low), &at("scale"))?;
        }
        if let Some(position) = o.position_m {
            finite(&position, &at("position_m"))?;
            if (0..2).any(|k| position[k].abs() > 0.5 * surface.size_m[k]) {
                return Err(object(
                    &at("position_m"),
                    format!("\"{}\" stands beside \"{}\"", o.name, surface.name),
                    "positions are from the centre of the surface, along its axes".into(),
                ));
            }
        }
        finite(&[o.yaw_deg.unwrap_or(0.0)], &at("yaw_deg"))
    }

    fn check_target(&self) -> Result<(), Objection> {
        let Some(target) = &self.target else { return Ok(()) };
        let at = |key| [Step::Key("target"), Step::Key(key)];
        if !self.objects.iter().any(|o| o.name == target.object) {
            let names: Vec<&str> = self.objects.iter().map(|o| o.name.as_str()).collect();
            return Err(object(
                &at("object"),
                format!("there is no object \"{}\"", target.object),
                format!("one of: {}", names.join(", ")),
            ));
        }
        let [low, high] = target.visible_from_start;
        if !(0.0 <= low && low <= high && high <= 1.0) {
            return Err(object(
                &at("visible_from_start"),
                format!("[{low}, {high}] is no range of shares"),
                "least and greatest share, between 0 and 1".into(),
            ));
        }
        if !(0.0..=1.0).contains(&target.visible_from_some) {
            return Err(object(
                &at("visible_from_some"),
                format!("{} is no share", target.visible_from_some),
                "a number between 0 and 1".into(),
            ));
        }
        Ok(())
    }

    /// The surface that an object stands on.
    pub(crate) fn surface_of(&self, o: &ObjectSpec) -> Option<&SurfaceSpec> {
        match &o.on {
            Some(name) => self.surfaces.iter().find(|s| &s.name == name),
            None => self.surfaces.first(),
        }
    }
}

fn object(path: &[Step], problem: String, mend: String) -> Objection {
    Objection { path: path.to_vec(), problem, mend }
}

fn positive(values: &[f64], path: &[Step]) -> Result<(), Objection> {
    match values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
        Some(v) => Err(object(
            path,
            format!("found {v}, expected a length above zero"),
            "metres, such as 0.1".into(),
        )),
        None => Ok(()),
    }
}

fn finite(values: &[f64], path: &[Step]) -> Result<(), Objection> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(object(path, format!("found {v}, expected a number"), "a finite number".into())),
        None => Ok(()),
    }
}

fn check_shape(shape: &Shape, path: &[Step]) -> Result<(), Objection> {
    let within = |kind, key| [path, &[Step::Key(kind), Step::Key(key)]].concat();
    let check_wall = |kind, rim_m: f64, base_m: Option<f64>, height_m: f64, wall_m: f64| {
        positive(&[rim_m], &within(kind, "diameter_m"))?;
        positive(&[base_m.unwrap_or(rim_m)], &within(kind, "base_diameter_m"))?;
        positive(&[height_m], &within(kind, "height_m"))?;
        positive(&[wall_m], &within(kind, "wall_m"))?;
        let room_m = (0.5 * rim_m.min(base_m.unwrap_or(rim_m))).min(height_m);
        if 2.0 * wall_m > room_m {
            return Err(object(
                &within(kind, "wall_m"),
                format!("a wall of {wall_m} m leaves no inside"),
                format!("at most {:.4}", 0.5 * room_m),
            ));
        }
        Ok(())
    };
    match shape {
        Shape::Cup(c) => check_wall("cup", c.diameter_m, c.base_diameter_m, c.height_m, c.wall_m),
        Shape::Mug(m) => {
            check_wall("mug", m.diameter_m, m.base_diameter_m, m.height_m, m.wall_m)?;
            positive(&[m.handle_thickness_m], &within("mug", "handle_thickness_m"))?;
            if !(m.handle_m > m.handle_thickness_m && 2.0 * m.handle_m <= m.height_m) {
                return Err(object(
                    &within("mug", "handle_m"),
                    format!("a handle that stands out {} m does not fit this mug", m.handle_m),
                    format!(
                        "more than its thickness {} and at most half the height {}",
                        m.handle_thickness_m,
                        0.5 * m.height_m
                    ),
                ));
            }
            Ok(())
        }
        Shape::Cylinder(c) => {
            positive(&[c.diameter_m], &within("cylinder", "diameter_m"))?;
            positive(&[c.top_diameter_m.unwrap_or(c.diameter_m)], &within("cylinder", "top_diameter_m"))?;
            positive(&[c.height_m], &within("cylinder", "height_m"))
        }
        Shape::Canister(c) => {
            positive(&[c.diameter_m], &within("canister", "diameter_m"))?;
            positive(&[c.lid_diameter_m], &within("canister", "lid_diameter_m"))?;
            positive(&[c.lid_height_m], &within("canister", "lid_height_m"))?;
            positive(&[c.height_m - c.lid_height_m], &within("canister", "height_m"))
        }
        Shape::Box(Cuboid { size_m }) => positive(size_m, &within("box", "size_m")),
    }
}
