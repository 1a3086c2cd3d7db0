//! Arranged scene, and its solids for ray casting.

use crate::body::Pose2;
use crate::grid::OccupancyGrid;
use crate::sim::composed::Paint;
use crate::sim::light::Light;
use crate::sim::outline::upright;
use crate::sim::scene::{Doorway, ObstacleSpec, RoomSpec, SurfaceKind, SurfaceSpec, TargetSpec};
use crate::sim::shape::{Cuboid, Hit, Primitive, Shape};
use crate::sim::stereo::Stereo;
use crate::sim::walls::Wall;
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Side of a cell of the robot's map, metres.
pub const MAP_RESOLUTION_M: f64 = 0.05;

/// State of an object: on a surface, in the hand, on the floor, taken away.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stand {
    /// On this surface.
    On(String),
    /// Fallen to the floor.
    Floor,
    /// In the hand of the body.
    Hand,
    /// Taken away.
    Away,
}

/// A placed object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Unique in the scene.
    pub name: String,
    /// Kind of the object; several objects may be of one kind.
    pub kind: String,
    /// Shape of the object.
    pub shape: Shape,
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// Place of the object: on a surface, on the floor, in the hand, or taken away.
    pub stands: Stand,
    /// Pose of the object in the map, with the origin at the centre of its base; the last one while it is
    /// held or taken away.
    pub map_from_object: Isometry3<f64>,
    /// Volume of the liquid in it, litres.
    #[serde(default)]
    pub holds_l: f64,
}

impl Object {
    /// True if a point of the map lies over its opening, and not below its rim by more than its own height.
    pub fn has_opening_at(&self, p: &Point3<f64>) -> bool {
        let p = self.map_from_object.inverse_transform_point(p);
        p.xy().coords.norm() < self.shape.opening_m() && p.z > 0.0
    }

    /// Centre of the object's bounding box without a handle, map frame, metres.
    pub fn centre_m(&self) -> Point3<f64> {
        let middle = match &self.shape {
            Shape::Composed(_) | Shape::Household(_) => {
                let (low, high) = self.shape.bounds();
                nalgebra::center(&low, &high)
            }
            _ => Point3::new(0.0, 0.0, 0.5 * self.shape.height_m()),
        };
        self.map_from_object * middle
    }

    /// Name of the surface on which the object stands, if any.
    pub fn surface(&self) -> Option<&str> {
        match &self.stands {
            Stand::On(surface) => Some(surface),
            _ => None,
        }
    }

    /// True if the object stands in the scene, on a surface or on the floor.
    pub fn is_in_place(&self) -> bool {
        matches!(self.stands, Stand::On(_) | Stand::Floor)
    }

    /// True if a height in the map is between base and top of the object, within a margin of `margin_m`.
    pub fn is_at_height(&self, z_m: f64, margin_m: f64) -> bool {
        let above_m = z_m - self.map_from_object.translation.z;
        above_m >= -margin_m && above_m <= self.shape.height_m() + margin_m
    }
}

/// A door in its wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HungDoor {
    /// Opening in the wall.
    pub doorway: Doorway,
    /// True while the panel fills the opening.
    pub shut: bool,
}

/// An arranged scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Title for people.
    pub title: String,
    /// Bounding rectangle of all rooms.
    pub room: RoomSpec,
    /// Rooms that have names.
    pub rooms: Vec<RoomSpec>,
    /// Walls between the rooms.
    pub walls: Vec<Wall>,
    /// Doors in the walls between the rooms.
    pub doors: Vec<HungDoor>,
    /// Support surfaces.
    pub surfaces: Vec<SurfaceSpec>,
    /// Obstacles on the floor.
    pub obstacles: Vec<ObstacleSpec>,
    /// Initial pose of the robot.
    pub start: Pose2,
    /// Objects in the order of the scene file.
    pub objects: Vec<Object>,
    /// Visibility that the scene requires of one object, if any.
    pub target: Option<TargetSpec>,
    /// Share of the target that the camera sees from the start, 0 to 1.
    pub target_visible_from_start: Option<f64>,
    /// False if the body has no map of the scene.
    pub mapped: bool,
    /// Stereo camera, if it replaces the depth camera.
    pub stereo: Option<Stereo>,
    /// Light of the scene, drawn by the seed; without it, surfaces have the stated colours.
    #[serde(default)]
    pub light: Option<Light>,
    /// Number of the current visit, from 1.
    pub visit: usize,
}

/// Label of pixels without a hit.
pub const LABEL_NOTHING: u16 = 0;
/// Label of floor, walls and doors.
pub const LABEL_ROOM: u16 = 1;
/// Label of surfaces and obstacles.
pub const LABEL_FURNITURE: u16 = 2;
/// Label of the first object; object `i` has the label `LABEL_OBJECT + i`.
pub const LABEL_OBJECT: u16 = 3;

/// A rigid object of several surfaces.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Pose of the solid's frame in the map.
    pub map_from_solid: Isometry3<f64>,
    /// Surfaces of the solid, in its own frame.
    pub parts: Vec<Primitive>,
    /// Colours of `parts`, in the same order; if empty, all have `colour`.
    pub paints: Vec<Paint>,
    /// Minimum and maximum corner of the bounding box in the solid's frame, metres.
    pub bounds: (Point3<f64>, Point3<f64>),
    /// Red, green, blue; the colour of parts without paint.
    pub colour: [u8; 3],
    /// Label of the pixels that show the solid.
    pub label: u16,
}

impl Solid {
    /// First hit of the ray o + t·d with t below `before`, in the solid's own frame.
    #[inline]
    pub fn hit(&self, o: &Point3<f64>, d: &Vector3<f64>, before: f64) -> Option<Hit> {
        self.meet(o, d, before).map(|(hit, _)| hit)
    }

    /// First hit of the ray o + t·d with t below `before`, in the solid's own frame, and the index of the
    /// part that is hit.
    #[inline]
    pub fn meet(&self, o: &Point3<f64>, d: &Vector3<f64>, before: f64) -> Option<(Hit, usize)> {
        let mut nearest = None;
        let mut before = before;
        for (n, part) in self.parts.iter().enumerate() {
            if let Some(hit) = part.hit(o, d, before) {
                before = hit.t;
                nearest = Some((hit, n));
            }
        }
        nearest
    }

    /// Colour of a part at a point in the solid's own frame.
    pub fn colour_at(&self, part: usize, p: &Point3<f64>) -> [u8; 3] {
        self.paints.get(part).map_or(self.colour, |paint| paint.at(p))
    }

    fn cuboid(map_from_solid: Isometry3<f64>, low: Point3<f64>, high: Point3<f64>, colour: [u8; 3]) -> Solid {
        Solid {
            map_from_solid,
            parts: vec![Primitive::Cuboid { low, high }],
            paints: Vec::new(),
            bounds: (low, high),
            colour,
            label: LABEL_FURNITURE,
        }
    }

    fn of_room(low: Point3<f64>, high: Point3<f64>, colour: [u8; 3]) -> Solid {
        Solid { label: LABEL_ROOM, ..Solid::cuboid(Isometry3::identity(), low, high, colour) }
    }
}

/// Thickness of a table's legs, metres.
const LEG_M: f64 = 0.05;
/// Thickness of a shelf's side panels, metres. They stand beside the boards and end below the boards' tops,
/// so that the boards end where the map says.
const UPRIGHT_M: f64 = 0.02;
/// Thickness of a door's panel, metres.
const PANEL_M: f64 = 0.04;
/// Margin around the walls in the initial map of a body that has no map of the scene, metres.
const BEYOND_M: f64 = 10.0;
/// Thickness of a seat on legs, metres.
const SEAT_M: f64 = 0.06;
/// Thickness of a chair's back, metres.
const BACK_M: f64 = 0.04;
/// Colour of every wall.
pub const WALL_COLOUR: [u8; 3] = [205, 205, 195];
const PANEL_COLOUR: [u8; 3] = [140, 90, 60];

impl SurfaceSpec {
    fn solids(&self) -> Vec<Solid> {
        let [x, y] = self.size_m.map(|s| 0.5 * s);
        let top = self.map_from_top();
        let board =
            Solid::cuboid(top, Point3::new(-x, -y, -self.thickness_m), Point3::new(x, y, 0.0), self.colour);
        match self.kind {
            SurfaceKind::Table => [vec![board], self.legs()].concat(),
            SurfaceKind::Board if self.uprights => {
                let side = |inner: f64, outer: f64| {
                    let low = Point3::new(inner.min(outer), -y, -self.height_m);
                    Solid::cuboid(top, low, Point3::new(inner.max(outer), y, -self.thickness_m), self.colour)
                };
                vec![board, side(-x, -x - UPRIGHT_M), side(x, x + UPRIGHT_M)]
            }
            SurfaceKind::Board => vec![board],
        }
    }

    fn legs(&self) -> Vec<Solid> {
        let [x, y] = self.size_m.map(|s| 0.5 * s);
        let half = Vector3::new(0.5 * LEG_M, 0.5 * LEG_M, 0.0);
        let leg = |(sx, sy): (f64, f64)| {
            let centre = Point3::new(sx * (x - 0.5 * LEG_M), sy * (y - 0.5 * LEG_M), 0.0);
            Solid::cuboid(
                self.map_from_top(),
                centre - half - Vector3::z() * self.height_m,
                centre + half - Vector3::z() * self.thickness_m,
                self.colour,
            )
        };
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(leg).to_vec()
    }
}

impl HungDoor {
    fn panel(&self) -> Solid {
        let d = &self.doorway;
        let mut half = d.half_m();
        half[1 - d.along] = 0.5 * PANEL_M.min(d.thickness_m);
        let (low, high) = (d.centre_m - half, d.centre_m + half);
        Solid::of_room(Point3::new(low.x, low.y, 0.0), Point3::new(high.x, high.y, d.height_m), PANEL_COLOUR)
    }
}

impl ObstacleSpec {
    /// Creates an obstacle box that the map does not show.
    fn block(name: &str, position_m: [f64; 2], size_m: [f64; 3]) -> ObstacleSpec {
        ObstacleSpec {
            name: name.into(),
            position_m,
            size_m,
            spread_m: None,
            gap_m: 0.0,
            yaw_deg: 0.0,
            corner_m: 0.0,
            legs_m: None,
            back_m: None,
            visits: Vec::new(),
            on_map: false,
            colour: WALL_COLOUR,
        }
    }

    /// Pose of the obstacle in the map; the origin is the centre of its base.
    pub fn map_from_obstacle(&self) -> Isometry3<f64> {
        upright(self.position_m[0], self.position_m[1], 0.0, self.yaw_deg.to_radians())
    }

    fn solid(&self) -> Solid {
        let (low, mut high) = Shape::Box(Cuboid { size_m: self.size_m }).bounds();
        let mut parts = match self.legs_m {
            Some(legs_m) => {
                let thick = Vector3::new(legs_m, legs_m, 0.0);
                let under_m = (high.z - SEAT_M).max(0.5 * high.z);
                let leg = |(sx, sy): (f64, f64)| {
                    let outer = Point3::new(sx * high.x, sy * high.y, 0.0);
                    let inner = outer - Vector3::new(sx, sy, 0.0).component_mul(&thick);
                    Primitive::Cuboid {
                        low: outer.inf(&inner),
                        high: outer.sup(&inner) + Vector3::z() * under_m,
                    }
                };
                let seat = Primitive::Cuboid { low: Point3::new(low.x, low.y, under_m), high };
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                    .map(leg)
                    .into_iter()
                    .chain([seat])
                    .collect()
            }
            None if self.corner_m > 0.0 => vec![Primitive::Rounded { high, corner_m: self.corner_m }],
            None => vec![Primitive::Cuboid { low, high }],
        };
        if let Some(back_m) = self.back_m {
            let seat = high;
            high.z += back_m;
            parts.push(Primitive::Cuboid { low: Point3::new(seat.x - BACK_M, low.y, seat.z), high });
        }
        Solid { parts, ..Solid::cuboid(self.map_from_obstacle(), low, high, self.colour) }
    }

    /// True if a disc on the floor touches the obstacle's box.
    pub fn touches(&self, p: &Point2<f64>, radius_m: f64) -> bool {
        self.distance_m(p) < radius_m
    }

    /// Distance of a floor point from the obstacle's box, metres; 0 inside.
    pub fn distance_m(&self, p: &Point2<f64>) -> f64 {
        let local = self.map_from_obstacle().inverse_transform_point(&Point3::new(p.x, p.y, 0.0));
        let gap = |at: f64, size: f64| (at.abs() - 0.5 * size).max(0.0);
        gap(local.x, self.size_m[0]).hypot(gap(local.y, self.size_m[1]))
    }
}

impl Scene {
    /// The walls between the rooms, and the shut doors.
    fn partitions(&self) -> impl Iterator<Item = Solid> {
        let walls = self.walls.iter().map(|w| Solid::of_room(w.low, w.high, WALL_COLOUR));
        walls.chain(self.doors.iter().filter(|d| d.shut).map(HungDoor::panel))
    }

    /// True if a wall or a shut door stands between two points of the map.
    pub(super) fn is_between(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        self.partitions().any(|solid| {
            let solid_from_map = solid.map_from_solid.inverse();
            solid.hit(&(solid_from_map * from), &(solid_from_map * (to - from)), 1.0).is_some()
        })
    }

    /// All solids for ray casting except the floor and the outer walls; objects carry their labels.
    pub fn solids(&self) -> Vec<Solid> {
        let surfaces = self.surfaces.iter().flat_map(SurfaceSpec::solids);
        let mut solids: Vec<Solid> = self.partitions().chain(surfaces).collect();
        solids.extend(self.obstacles.iter().map(ObstacleSpec::solid));
        for (label, o) in (LABEL_OBJECT..).zip(&self.objects) {
            if o.is_in_place() {
                solids.push(o.solid(label));
            }
        }
        solids
    }

    /// Map as a mapping run would give it: surfaces and mapped obstacles projected to the floor, and walls
    /// with every door open.
    pub fn map(&self) -> OccupancyGrid {
        let mut grid = OccupancyGrid::covering(self.room.low(), self.room.high(), MAP_RESOLUTION_M);
        // A cell is taken if anything reaches into it, so outlines grow by half a cell.
        let grown = 0.5 * MAP_RESOLUTION_M;
        let reach_m = |x_m: f64, y_m: f64| 0.5 * x_m.hypot(y_m) + 2.0 * (grown + UPRIGHT_M);
        for w in &self.walls {
            let size = (w.high - w.low).xy();
            let middle = w.low.xy() + 0.5 * size;
            grid.occupy_near(&middle, reach_m(size.x, size.y), |p| w.blocks(p, grown));
        }
        for s in &self.surfaces {
            let grown = if s.uprights { grown + UPRIGHT_M } else { grown };
            grid.occupy_near(&s.centre_m(), reach_m(s.size_m[0], s.size_m[1]), |p| s.covers(p, grown));
        }
        for o in self.obstacles.iter().filter(|o| o.on_map) {
            let reach_m = reach_m(o.size_m[0], o.size_m[1]);
            grid.occupy_near(&o.position_m.into(), reach_m, |p| o.touches(p, grown));
        }
        grid
    }

    /// Initial map of the body: that of the scene, or for a body without one, a free area far beyond all
    /// walls.
    pub fn known_map(&self) -> OccupancyGrid {
        if self.mapped {
            return self.map();
        }
        let beyond = Vector2::repeat(BEYOND_M);
        OccupancyGrid::covering(self.room.low() - beyond, self.room.high() + beyond, MAP_RESOLUTION_M)
    }

    /// Obstacles that the body's map does not show; for a body without a map, everything it could run into,
    /// as boxes.
    pub fn unknown(&self) -> Vec<ObstacleSpec> {
        if self.mapped {
            return self.obstacles.iter().filter(|o| !o.on_map).cloned().collect();
        }
        let surface = |s: &SurfaceSpec| ObstacleSpec {
            yaw_deg: s.yaw_deg,
            ..ObstacleSpec::block(&s.name, s.position_m, [s.size_m[0], s.size_m[1], s.height_m])
        };
        let wall = |w: &Wall| {
            let (middle, size) = (nalgebra::center(&w.low, &w.high), w.high - w.low);
            ObstacleSpec::block("wall", [middle.x, middle.y], size.into())
        };
        let surfaces = self.surfaces.iter().map(surface);
        let walls = self.walls.iter().filter(|w| w.low.z <= 0.0).map(wall);
        let ([x, y], [length_m, width_m]) = (self.room.position_m, self.room.size_m);
        let thick_m = 2.0 * BEYOND_M;
        let (along, across) = (0.5 * (length_m + thick_m), 0.5 * (width_m + thick_m));
        let around = [
            ([x - along, y], [thick_m, width_m + thick_m]),
            ([x + along, y], [thick_m, width_m + thick_m]),
            ([x, y - across], [length_m, thick_m]),
            ([x, y + across], [length_m, thick_m]),
        ];
        let around =
            around.map(|(at, [a, b])| ObstacleSpec::block("wall", at, [a, b, self.room.wall_height_m]));
        self.obstacles.iter().cloned().chain(surfaces).chain(walls).chain(around).collect()
    }

    /// Name of the room that holds a point of the floor; `None` outside of all named rooms.
    pub fn room_at(&self, p: &Point2<f64>) -> Option<&str> {
        self.rooms.iter().find(|r| r.holds(p, 0.0)).map(|r| r.name.as_str())
    }

    /// Surface of this name, if there is one.
    pub fn surface(&self, name: &str) -> Option<&SurfaceSpec> {
        self.surfaces.iter().find(|s| s.name == name)
    }

    /// Object of this name, if there is one.
    pub fn object(&self, name: &str) -> Option<&Object> {
        self.objects.iter().find(|o| o.name == name)
    }
}

impl Object {
    /// The object as a solid for ray casting.
    pub fn solid(&self, label: u16) -> Solid {
        let (parts, paints) = self.shape.painted(self.colour).into_iter().unzip();
        Solid {
            map_from_solid: self.map_from_object,
            parts,
            paints,
            bounds: self.shape.bounds(),
            colour: self.colour,
            label,
        }
    }
}
