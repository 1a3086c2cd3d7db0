//! A scene in which everything has its place, and the solids that a ray can meet in it.

use crate::body::Pose2;
use crate::grid::OccupancyGrid;
use crate::sim::scene::{ObstacleSpec, RoomSpec, SurfaceSpec, TargetSpec};
use crate::sim::shape::{Cuboid, Hit, Part, Shape};
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Side of a cell of the robot's map, metres.
pub const MAP_RESOLUTION_M: f64 = 0.05;

/// An object in its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Unique in the scene.
    pub name: String,
    /// What it is.
    pub kind: String,
    /// Its solid.
    pub shape: Shape,
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// Name of the surface that it stands on.
    pub surface: String,
    /// Where its base stands.
    pub map_from_object: Isometry3<f64>,
    /// False once it has been taken away.
    pub present: bool,
}

impl Object {
    /// Middle of the box around it, handle left out, in the map.
    pub fn centre_m(&self) -> Point3<f64> {
        self.map_from_object * Point3::new(0.0, 0.0, 0.5 * self.shape.height_m())
    }
}

/// A scene in which the seed has chosen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// One line for people.
    pub title: String,
    /// The room.
    pub room: RoomSpec,
    /// Tables.
    pub surfaces: Vec<SurfaceSpec>,
    /// Boxes on the floor.
    pub obstacles: Vec<ObstacleSpec>,
    /// Where the robot stands first.
    pub start: Pose2,
    /// Objects in the order of the scene file.
    pub objects: Vec<Object>,
    /// What the arrangement was chosen for.
    pub target: Option<TargetSpec>,
    /// Share of the target that the camera sees from the start.
    pub target_visible_from_start: Option<f64>,
}

/// What a pixel shows.
pub const LABEL_NOTHING: u16 = 0;
/// Floor and walls.
pub const LABEL_ROOM: u16 = 1;
/// Tables and obstacles.
pub const LABEL_FURNITURE: u16 = 2;
/// Object `i` has the label `LABEL_OBJECT + i`.
pub const LABEL_OBJECT: u16 = 3;

/// One rigid thing made of parts.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Where its frame is.
    pub map_from_solid: Isometry3<f64>,
    /// Its surfaces.
    pub parts: Vec<Part>,
    /// The box around it in its own frame.
    pub bounds: (Point3<f64>, Point3<f64>),
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// What its pixels show.
    pub label: u16,
}

impl Solid {
    /// The first hit of a ray in the solid's own frame.
    #[inline]
    pub fn hit(&self, o: &Point3<f64>, d: &Vector3<f64>, before: f64) -> Option<Hit> {
        let mut nearest = None;
        let mut before = before;
        for part in &self.parts {
            if let Some(hit) = part.hit(o, d, before) {
                before = hit.t;
                nearest = Some(hit);
            }
        }
        nearest
    }

    fn cuboid(map_from_solid: Isometry3<f64>, low: Point3<f64>, high: Point3<f64>, colour: [u8; 3]) -> Solid {
        Solid {
            map_from_solid,
            parts: vec![Part::Cuboid { low, high }],
            bounds: (low, high),
            colour,
            label: LABEL_FURNITURE,
        }
    }
}

/// Upright at a place in the map.
pub(crate) fn upright(x_m: f64, y_m: f64, z_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x_m, y_m, z_m),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
    )
}

/// Side of a table's legs, metres.
const LEG_M: f64 = 0.05;

impl SurfaceSpec {
    /// Frame of the top: origin at its centre, z up.
    pub fn map_from_top(&self) -> Isometry3<f64> {
        upright(self.position_m[0], self.position_m[1], self.height_m, self.yaw_deg.to_radians())
    }

    /// Corners of the top in the map, in order.
    pub fn outline_m(&self) -> Vec<Point2<f64>> {
        let [x, y] = self.size_m.map(|s| 0.5 * s);
        let top = self.map_from_top();
        [(-x, -y), (x, -y), (x, y), (-x, y)]
            .iter()
            .map(|&(x, y)| (top * Point3::new(x, y, 0.0)).xy())
            .collect()
    }

    fn solids(&self) -> Vec<Solid> {
        let [x, y] = self.size_m.map(|s| 0.5 * s);
        let top = self.map_from_top();
        let mut solids = vec![Solid::cuboid(
            top,
            Point3::new(-x, -y, -self.thickness_m),
            Point3::new(x, y, 0.0),
            self.colour,
        )];
        for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let centre = Point3::new(sx * (x - 0.5 * LEG_M), sy * (y - 0.5 * LEG_M), 0.0);
            let half = Vector3::new(0.5 * LEG_M, 0.5 * LEG_M, 0.0);
            solids.push(Solid::cuboid(
                top,
                centre - half - Vector3::z() * self.height_m,
                centre + half - Vector3::z() * self.thickness_m,
                self.colour,
            ));
        }
        solids
    }
}

impl ObstacleSpec {
    /// Frame at the centre of its base.
    pub fn map_from_obstacle(&self) -> Isometry3<f64> {
        upright(self.position_m[0], self.position_m[1], 0.0, self.yaw_deg.to_radians())
    }

    /// True if a disc on the floor touches it.
    pub fn touches(&self, p: &Point2<f64>, radius_m: f64) -> bool {
        let local = self.map_from_obstacle().inverse_transform_point(&Point3::new(p.x, p.y, 0.0));
        let gap = |at: f64, size: f64| (at.abs() - 0.5 * size).max(0.0);
        gap(local.x, self.size_m[0]).hypot(gap(local.y, self.size_m[1])) < radius_m
    }
}

impl Scene {
    /// Everything that a ray can meet but floor and walls; objects that are present carry their labels.
    pub fn solids(&self) -> Vec<Solid> {
        let mut solids: Vec<Solid> = self.surfaces.iter().flat_map(SurfaceSpec::solids).collect();
        for o in &self.obstacles {
            let box_ = Shape::Box(Cuboid { size_m: o.size_m });
            let (low, high) = box_.bounds();
            solids.push(Solid::cuboid(o.map_from_obstacle(), low, high, o.colour));
        }
        for (label, o) in (LABEL_OBJECT..).zip(&self.objects) {
            if o.present {
                solids.push(o.solid(label));
            }
        }
        solids
    }

    /// The room as the robot knows it from mapping: tables and known obstacles down to the floor, walls at the edge.
    pub fn map(&self) -> OccupancyGrid {
        let half = Point2::new(0.5 * self.room.size_m[0], 0.5 * self.room.size_m[1]);
        let mut grid = OccupancyGrid::covering(-half, half, MAP_RESOLUTION_M);
        // A cell is taken if anything reaches into it, so outlines grow by half a cell.
        let grown = 0.5 * MAP_RESOLUTION_M;
        for s in &self.surfaces {
            let top = s.map_from_top();
            grid.occupy(|p| {
                let local = top.inverse_transform_point(&Point3::new(p.x, p.y, s.height_m));
                local.x.abs() <= 0.5 * s.size_m[0] + grown && local.y.abs() <= 0.5 * s.size_m[1] + grown
            });
        }
        for o in self.obstacles.iter().filter(|o| o.on_map) {
            grid.occupy(|p| o.touches(p, grown));
        }
        grid
    }

    /// The object of that name.
    pub fn object(&self, name: &str) -> Option<&Object> {
        self.objects.iter().find(|o| o.name == name)
    }
}

impl Object {
    /// The object as something that a ray can meet.
    pub fn solid(&self, label: u16) -> Solid {
        Solid {
            map_from_solid: self.map_from_object,
            parts: self.shape.parts(),
            bounds: self.shape.bounds(),
            colour: self.colour,
            label,
        }
    }
}
