//! Shapes of objects, and their surfaces for ray casting. The frame of a shape has its origin at the centre
//! of the base, z up.

mod part;

use crate::sim::composed::{self, Composed, Paint};
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

pub use crate::sim::outline::Outline;
pub use part::{Hit, Primitive};

/// Shape of an object. Lengths in metres, outer sizes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// Cup: open at the top, hollow, without a handle.
    Cup(Cup),
    /// Mug: a cup with a handle towards its x axis.
    Mug(Mug),
    /// Closed cylinder; may taper.
    Cylinder(Cylinder),
    /// A cylinder with a lid.
    Canister(Canister),
    /// An axis-aligned box.
    Box(Cuboid),
    /// An axis-aligned ellipsoid.
    Ball(Ball),
    /// A vertical rod with rounded ends.
    Rod(Rod),
    /// A vertical half ring towards its x axis: a handle.
    Bow(Bow),
    /// Several solids as one rigid object.
    Composed(Composed),
    /// A composed household object, by name: kettle, teddy, ….
    Household(String),
}

/// An open, hollow, possibly tapered cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cup {
    /// Diameter at the rim, metres.
    pub diameter_m: f64,
    /// Diameter at the base, metres; as at the rim if left out.
    pub base_diameter_m: Option<f64>,
    /// Height from base to rim, metres.
    pub height_m: f64,
    /// Thickness of wall and base, metres.
    #[serde(default = "default_wall_m")]
    pub wall_m: f64,
}

/// A cup with a handle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mug {
    /// Diameter at the rim, metres.
    pub diameter_m: f64,
    /// Diameter at the base, metres; as at the rim if left out.
    pub base_diameter_m: Option<f64>,
    /// Height from base to rim, metres.
    pub height_m: f64,
    /// Thickness of wall and base, metres.
    #[serde(default = "default_wall_m")]
    pub wall_m: f64,
    /// Reach of the handle from the wall: outer radius of the half ring, metres.
    #[serde(default = "default_handle_m")]
    pub handle_m: f64,
    /// Thickness of the handle, metres.
    #[serde(default = "default_handle_thickness_m")]
    pub handle_thickness_m: f64,
}

/// A closed, possibly tapered cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Diameter at the base, metres.
    pub diameter_m: f64,
    /// Diameter at the top, metres; as at the base if left out.
    pub top_diameter_m: Option<f64>,
    /// Height from base to top, metres.
    pub height_m: f64,
}

/// A closed cylinder with a lid of another diameter on top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Canister {
    /// Diameter of the body, metres.
    pub diameter_m: f64,
    /// Height from base to the top of the lid, metres.
    pub height_m: f64,
    /// Diameter of the lid, metres.
    pub lid_diameter_m: f64,
    /// Height of the lid, metres.
    pub lid_height_m: f64,
}

/// A box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cuboid {
    /// Size along x, y and z, metres.
    pub size_m: [f64; 3],
}

/// An ellipsoid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Diameters along x, y and z, metres.
    pub size_m: [f64; 3],
}

/// A rod with rounded ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rod {
    /// Length from end to end, metres.
    pub length_m: f64,
    /// Diameter, metres.
    pub diameter_m: f64,
}

/// Half a ring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bow {
    /// Outer diameter of the ring, which is the height, metres.
    pub height_m: f64,
    /// Thickness of the bent rod, metres.
    pub thickness_m: f64,
}

fn default_wall_m() -> f64 {
    0.003
}
fn default_handle_m() -> f64 {
    0.032
}
fn default_handle_thickness_m() -> f64 {
    0.01
}

impl Shape {
    /// Height of the shape above its base, metres.
    pub fn height_m(&self) -> f64 {
        match self {
            Shape::Cup(Cup { height_m, .. })
            | Shape::Mug(Mug { height_m, .. })
            | Shape::Cylinder(Cylinder { height_m, .. })
            | Shape::Canister(Canister { height_m, .. }) => *height_m,
            Shape::Box(Cuboid { size_m }) | Shape::Ball(Ball { size_m }) => size_m[2],
            Shape::Rod(Rod { length_m, .. }) => *length_m,
            Shape::Bow(Bow { height_m, .. }) => *height_m,
            Shape::Composed(_) | Shape::Household(_) => self.bounds().1.z,
        }
    }

    /// Composed object behind the shape, if it is one.
    fn composed(&self) -> Option<&Composed> {
        match self {
            Shape::Composed(composed) => Some(composed),
            Shape::Household(name) => composed::named(name),
            _ => None,
        }
    }

    /// Minimum and maximum corner of the bounding box in the shape's frame, metres.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        if let Some(composed) = self.composed() {
            return composed.bounds();
        }
        let (half_x, half_y, high_x) = match self {
            Shape::Mug(m) => {
                let r = 0.5 * m.diameter_m.max(m.base_diameter_m.unwrap_or(0.0));
                (r, r, handle_centre_m(m) + m.handle_m)
            }
            Shape::Box(Cuboid { size_m }) | Shape::Ball(Ball { size_m }) => {
                (0.5 * size_m[0], 0.5 * size_m[1], 0.5 * size_m[0])
            }
            Shape::Bow(b) => (0.0, 0.5 * b.thickness_m, 0.5 * b.height_m),
            _ => {
                let r = self.round_radius_m();
                (r, r, r)
            }
        };
        (Point3::new(-half_x, -half_y, 0.0), Point3::new(high_x.max(half_x), half_y, self.height_m()))
    }

    /// Outline of the shape seen from above, over all heights.
    pub fn outline(&self) -> Outline {
        match self {
            Shape::Box(Cuboid { size_m }) => {
                Outline::Rectangle { half_m: [0.5 * size_m[0], 0.5 * size_m[1]] }
            }
            Shape::Mug(m) => Outline::Disc { radius_m: handle_centre_m(m) + m.handle_m },
            _ => Outline::Disc { radius_m: self.round_radius_m() },
        }
    }

    /// Opening of a hand that the shape's body requires, without a handle, metres.
    pub fn width_m(&self) -> f64 {
        match self {
            Shape::Ball(_) | Shape::Bow(_) | Shape::Composed(_) | Shape::Household(_) => {
                let (low, high) = self.bounds();
                (high - low).xy().min()
            }
            Shape::Box(Cuboid { size_m }) => size_m[0].min(size_m[1]),
            _ => 2.0 * self.round_radius_m(),
        }
    }

    /// Copies the shape, scaled by a factor.
    pub fn scaled(&self, factor: f64) -> Shape {
        let mut shape = self.clone();
        match &mut shape {
            Shape::Cup(c) => {
                c.diameter_m *= factor;
                c.base_diameter_m = c.base_diameter_m.map(|d| d * factor);
                c.height_m *= factor;
            }
            Shape::Mug(m) => {
                m.diameter_m *= factor;
                m.base_diameter_m = m.base_diameter_m.map(|d| d * factor);
                m.height_m *= factor;
                m.handle_m *= factor;
            }
            Shape::Cylinder(c) => {
                c.diameter_m *= factor;
                c.top_diameter_m = c.top_diameter_m.map(|d| d * factor);
                c.height_m *= factor;
            }
            Shape::Canister(c) => {
                c.diameter_m *= factor;
                c.height_m *= factor;
                c.lid_diameter_m *= factor;
                c.lid_height_m *= factor;
            }
            Shape::Box(Cuboid { size_m }) | Shape::Ball(Ball { size_m }) => {
                size_m.iter_mut().for_each(|s| *s *= factor);
            }
            Shape::Rod(r) => {
                r.length_m *= factor;
                r.diameter_m *= factor;
            }
            Shape::Bow(b) => {
                b.height_m *= factor;
                b.thickness_m *= factor;
            }
            Shape::Composed(_) | Shape::Household(_) => {
                shape = Shape::Composed(self.composed().map(|c| c.scaled(factor)).unwrap_or_default());
            }
        }
        shape
    }

    /// Inside of an open vessel; `None` for what is closed or composed.
    fn inside(&self) -> Option<Inside> {
        match self {
            Shape::Cup(c) => Some(Inside::of(c.diameter_m, c.base_diameter_m, c.height_m, c.wall_m)),
            Shape::Mug(m) => Some(Inside::of(m.diameter_m, m.base_diameter_m, m.height_m, m.wall_m)),
            _ => None,
        }
    }

    /// Radius of its opening, metres; 0 if it has none.
    pub fn opening_m(&self) -> f64 {
        self.inside().map_or(0.0, |inside| inside.rim_m)
    }

    /// Volume that it can hold, litres.
    pub fn capacity_l(&self) -> f64 {
        let volume = |Inside { bottom_m: a, rim_m: b, depth_m }| {
            1e3 * std::f64::consts::FRAC_PI_3 * depth_m * (a * a + a * b + b * b)
        };
        self.inside().map_or(0.0, volume)
    }

    fn round_radius_m(&self) -> f64 {
        let diameter = match self {
            Shape::Cup(c) => c.diameter_m.max(c.base_diameter_m.unwrap_or(0.0)),
            Shape::Mug(m) => m.diameter_m.max(m.base_diameter_m.unwrap_or(0.0)),
            Shape::Cylinder(c) => c.diameter_m.max(c.top_diameter_m.unwrap_or(0.0)),
            Shape::Canister(c) => c.diameter_m.max(c.lid_diameter_m),
            Shape::Box(Cuboid { size_m }) => size_m[0].hypot(size_m[1]),
            Shape::Ball(Ball { size_m }) => size_m[0].max(size_m[1]),
            Shape::Rod(r) => r.diameter_m,
            Shape::Bow(b) => b.height_m,
            Shape::Composed(_) | Shape::Household(_) => 2.0 * self.composed().map_or(0.0, Composed::radius_m),
        };
        0.5 * diameter
    }

    /// Surfaces for ray casting, with their colours; `colour` is for surfaces without one.
    pub fn painted(&self, colour: [u8; 3]) -> Vec<(Primitive, Paint)> {
        match self.composed() {
            Some(composed) => composed.painted(colour),
            None => self.parts().into_iter().map(|part| (part, Paint { colour, pattern: None })).collect(),
        }
    }

    /// Surfaces for ray casting.
    pub fn parts(&self) -> Vec<Primitive> {
        match self {
            Shape::Composed(_) | Shape::Household(_) => {
                self.painted([0; 3]).into_iter().map(|(part, _)| part).collect()
            }
            Shape::Ball(Ball { size_m }) => vec![Primitive::ball(&(0.5 * Vector3::from(*size_m)), 0.0)],
            Shape::Rod(r) => {
                let radius = 0.5 * r.diameter_m;
                let end = Vector3::repeat(radius);
                vec![
                    Primitive::frustum(radius, radius, radius, r.length_m - radius),
                    Primitive::ball(&end, 0.0),
                    Primitive::ball(&end, r.length_m - r.diameter_m),
                ]
            }
            Shape::Bow(b) => vec![Primitive::Handle {
                centre: Point3::new(0.0, 0.0, 0.5 * b.height_m),
                major_m: 0.5 * (b.height_m - b.thickness_m),
                minor_m: 0.5 * b.thickness_m,
            }],
            Shape::Cup(c) => shell(c.diameter_m, c.base_diameter_m, c.height_m, c.wall_m),
            Shape::Mug(m) => {
                let mut parts = shell(m.diameter_m, m.base_diameter_m, m.height_m, m.wall_m);
                let minor_m = 0.5 * m.handle_thickness_m;
                parts.push(Primitive::Handle {
                    centre: Point3::new(handle_centre_m(m), 0.0, 0.5 * m.height_m),
                    major_m: m.handle_m - minor_m,
                    minor_m,
                });
                parts
            }
            Shape::Cylinder(c) => {
                let (base, top) = (0.5 * c.diameter_m, 0.5 * c.top_diameter_m.unwrap_or(c.diameter_m));
                vec![
                    Primitive::frustum(base, top, 0.0, c.height_m),
                    Primitive::Disc { z_m: c.height_m, inner_m: 0.0, outer_m: top },
                    Primitive::Disc { z_m: 0.0, inner_m: 0.0, outer_m: base },
                ]
            }
            Shape::Canister(c) => {
                let (body, lid) = (0.5 * c.diameter_m, 0.5 * c.lid_diameter_m);
                let seam = c.height_m - c.lid_height_m;
                vec![
                    Primitive::frustum(body, body, 0.0, seam),
                    Primitive::Disc { z_m: seam, inner_m: 0.0, outer_m: body.max(lid) },
                    Primitive::frustum(lid, lid, seam, c.height_m),
                    Primitive::Disc { z_m: c.height_m, inner_m: 0.0, outer_m: lid },
                    Primitive::Disc { z_m: 0.0, inner_m: 0.0, outer_m: body },
                ]
            }
            Shape::Box(Cuboid { size_m: [x, y, z] }) => vec![Primitive::Cuboid {
                low: Point3::new(-0.5 * x, -0.5 * y, 0.0),
                high: Point3::new(0.5 * x, 0.5 * y, *z),
            }],
        }
    }
}

/// Distance of the centre of the handle's ring from the mug's axis, metres: on the wall at half height.
fn handle_centre_m(m: &Mug) -> f64 {
    0.25 * (m.diameter_m + m.base_diameter_m.unwrap_or(m.diameter_m))
}

/// Hollow space of an open vessel, a frustum: radius at the bottom and at the rim, and depth, metres.
struct Inside {
    bottom_m: f64,
    rim_m: f64,
    depth_m: f64,
}

impl Inside {
    fn of(diameter_m: f64, base_diameter_m: Option<f64>, height_m: f64, wall_m: f64) -> Self {
        let (rim, base) = (0.5 * diameter_m, 0.5 * base_diameter_m.unwrap_or(diameter_m));
        let slope = (rim - base) / height_m;
        Self { bottom_m: base + slope * wall_m - wall_m, rim_m: rim - wall_m, depth_m: height_m - wall_m }
    }
}

fn shell(diameter_m: f64, base_diameter_m: Option<f64>, height_m: f64, wall_m: f64) -> Vec<Primitive> {
    let (rim, base) = (0.5 * diameter_m, 0.5 * base_diameter_m.unwrap_or(diameter_m));
    let inside = Inside::of(diameter_m, base_diameter_m, height_m, wall_m);
    vec![
        Primitive::frustum(base, rim, 0.0, height_m),
        Primitive::frustum(inside.bottom_m, inside.rim_m, wall_m, height_m),
        Primitive::Disc { z_m: height_m, inner_m: inside.rim_m, outer_m: rim },
        Primitive::Disc { z_m: wall_m, inner_m: 0.0, outer_m: inside.bottom_m },
        Primitive::Disc { z_m: 0.0, inner_m: 0.0, outer_m: base },
    ]
}
