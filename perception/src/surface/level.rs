//! A level surface: its plane, its outline, and its role.

use super::outline::Outline;
use crate::polygon::{self, convex_hull};
use crate::scale::APART_M;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Share of a surface's area, seen from above, beyond which an overlap means that two surfaces are
/// in one place. From: chosen.
const COMMON: f64 = 0.2;
/// Height range of objects above their surface, metres. From: chosen.
pub(super) const THINGS_M: (f64, f64) = (0.025, 0.35);
/// Probability of the up direction from which the direction is practically certain. From: chosen.
pub(super) const SURE: f64 = 0.95;

/// Role of a level surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Supporting surface.
    Support,
    /// Undecided: support or floor.
    Untold,
    /// The floor.
    Floor,
    /// Neither a support nor the floor.
    Other,
}

/// Evidence for the role of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sign {
    /// A surface at this height was requested.
    Asked,
    /// Cameras saw lower points past the edge.
    SeenPast {
        /// Share of the returns below.
        share: f64,
    },
    /// Nothing lies lower, and a support lies above.
    Under {
        /// Height of that surface above this one, metres.
        by_m: f64,
    },
    /// Nothing lies lower, and the surface is larger than tables.
    Wide {
        /// Area in view, square metres.
        area_m2: f64,
    },
    /// The surface is a further part of the floor.
    LevelWithFloor,
    /// The surface is the top of something that stands on another surface.
    OnTop {
        /// Height above that surface, metres.
        by_m: f64,
    },
    /// The surface was seen through another one: a mirror image.
    Mirrored,
    /// The surface is a narrow strip, such as a rail or the top of a wall.
    Narrow {
        /// Width of the strip, metres.
        width_m: f64,
    },
    /// The surface is not level with the surfaces that hold most returns.
    Slanted {
        /// Angle between the normals, radians.
        by_rad: f64,
    },
    /// Nothing lower was seen past the edge.
    NoEdge {
        /// Mean height of the cameras above the surface, metres.
        eye_m: f64,
    },
    /// Nothing lies lower, and the viewpoint is unknown.
    NoCamera,
}

impl fmt::Display for Sign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Sign::Asked => write!(f, "a surface at its height was asked for"),
            Sign::SeenPast { share } => {
                write!(f, "{:.0} % of the returns lie lower, past its edge", 100.0 * share)
            }
            Sign::Under { by_m } => {
                write!(f, "nothing lies lower, and a surface to stand things on {by_m:.2} m higher")
            }
            Sign::Wide { area_m2 } => write!(f, "nothing lies lower in a view of {area_m2:.1} m²"),
            Sign::LevelWithFloor => write!(f, "it is level with the floor"),
            Sign::OnTop { by_m } => write!(f, "it is the top of something {by_m:.2} m high"),
            Sign::Mirrored => write!(f, "it was seen through another surface, as in a mirror"),
            Sign::Narrow { width_m } => write!(f, "it is a strip {width_m:.2} m wide"),
            Sign::Slanted { by_rad } => write!(f, "it leans by {:.0}°", by_rad.to_degrees()),
            Sign::NoEdge { eye_m } => {
                write!(f, "seen from {eye_m:.2} m above it, and nothing lower past its edge")
            }
            Sign::NoCamera => write!(f, "nothing lies lower, and no camera is known that could have seen it"),
        }
    }
}

/// Level plane with its outline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Unit normal in the world: up.
    pub up: Unit<Vector3<f64>>,
    /// Offset of the plane: `up · p` of its points, metres.
    pub offset_m: f64,
    /// Convex outline in the world, anticlockwise seen from above, metres.
    pub hull: Vec<Point3<f64>>,
    /// Area of the outline, square metres.
    pub area_m2: f64,
    /// Number of cloud points on the surface.
    pub points: usize,
    /// Root mean square distance from the plane of all points near it, metres.
    pub residual_m: f64,
    /// Share of the finite points on the surface.
    pub share: f64,
    /// World to the surface's frame: z up with 0 on the surface, origin at the middle of the hull.
    pub surface_from_world: Isometry3<f64>,
    /// Role of the surface.
    pub role: Role,
    /// Evidence for the role.
    pub because: Sign,
    /// Height above the floor, metres, where the floor is in view.
    pub above_floor_m: Option<f64>,
    /// Probability of the up direction that was assumed when the surface was found: one if the
    /// direction was given, or no camera is known.
    #[serde(default = "said")]
    pub up_chance: f64,
    /// Other supports above this surface.
    pub over: Vec<Overhang>,
}

fn said() -> f64 {
    1.0
}

/// Outline and height of a surface above another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overhang {
    /// Height above the other surface, metres.
    pub above_m: f64,
    /// Convex outline in the world, anticlockwise seen from above, metres.
    pub hull: Vec<Point3<f64>>,
}

impl Overhang {
    /// Outline prepared for tests of many points.
    pub(crate) fn outline(&self, up: &Vector3<f64>) -> Outline {
        Outline::of(&self.hull, up)
    }
}

impl Surface {
    /// Reason why the surface may not be a support, in words after its role; `None` if practically
    /// certain.
    pub fn doubt(&self) -> Option<String> {
        let (because, chance) = (&self.because, self.up_chance);
        match self.role {
            Role::Untold => Some(format!("may be the floor: {because}")),
            _ if chance >= SURE => None,
            _ => {
                Some(format!("may be a wall: which way is up is told from what is in view, with {chance:.2}"))
            }
        }
    }

    /// Height of a point of the world above the plane, metres.
    pub fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.up.dot(&p.coords) - self.offset_m
    }

    /// Test for points (height above this surface, position in the world) that belong to a board
    /// above or to its load, and so do not stand on this surface.
    pub(crate) fn overhung(&self) -> impl Fn(f64, &Point3<f64>) -> bool + use<> {
        /// Thickness of a board with the objects that hide its edge, metres. From: chosen.
        const BOARD_M: f64 = 0.05;
        /// Overhang of objects beyond a board's hull, metres. From: chosen.
        const MARGIN_M: f64 = 0.03;
        let boards: Vec<(f64, Outline)> =
            self.over.iter().map(|over| (over.above_m, over.outline(&self.up))).collect();
        move |height_m, p| {
            boards
                .iter()
                .any(|(above_m, outline)| height_m > above_m - BOARD_M && outline.covers(p, MARGIN_M))
        }
    }

    /// Coordinates x and y of points of the world in the surface's frame, metres.
    pub(super) fn flat(&self, places: &[Point3<f64>]) -> Vec<[f64; 2]> {
        places.iter().map(|p| (self.surface_from_world * p).xy().coords.into()).collect()
    }

    /// True if the surface crosses or touches the other's plane where both overlap; two supports
    /// never do.
    pub(super) fn cuts(&self, other: &Surface) -> bool {
        let heights = self.hull.iter().map(|p| other.height_m(p));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let common = || polygon::clip(convex_hull(other.flat(&self.hull)), &other.flat(&other.hull), 0.0);
        low < APART_M && high > -APART_M && polygon::area(&common()) > COMMON * self.area_m2
    }

    /// Surface in another frame.
    pub fn moved(&self, there_from_world: &Isometry3<f64>) -> Surface {
        let up = there_from_world.rotation * self.up;
        let hull: Vec<Point3<f64>> = self.hull.iter().map(|p| there_from_world * p).collect();
        let shift = up.dot(&there_from_world.translation.vector);
        let surface_from_world = self.surface_from_world * there_from_world.inverse();
        let mut over = self.over.clone();
        over.iter_mut().flat_map(|level| &mut level.hull).for_each(|p| *p = there_from_world * *p);
        Surface { up, hull, over, offset_m: self.offset_m + shift, surface_from_world, ..self.clone() }
    }

    /// True if the point lies above or below the outline widened by `margin_m`. For many points see [`Surface::outline`].
    pub fn covers(&self, p: &Point3<f64>, margin_m: f64) -> bool {
        self.outline().covers(p, margin_m)
    }

    /// Outline prepared for tests of many points.
    pub fn outline(&self) -> Outline {
        Outline::of(&self.hull, &self.up)
    }
}
