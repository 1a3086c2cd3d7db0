//! Options of the search for a surface: what is wanted, and where.

use super::level::Surface;
use crate::polygon::{self, convex_hull};
use nalgebra::{Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// Options of the search for the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceOptions {
    /// Up direction in the world, if known; otherwise estimated from the planes, the objects on
    /// them and the cameras' attitude.
    pub up: Option<Unit<Vector3<f64>>>,
    /// Maximum angle between the surface's normal and `up`, radians. From: chosen, 15°.
    pub tilt_rad: f64,
    /// Minimum and maximum height of the surface along `up`, metres, if known.
    pub height_band_m: Option<(f64, f64)>,
    /// Region of the surface as seen from above, if known; surfaces outside are not wanted.
    pub region: Option<Region>,
    /// Minimum area of the surface, square metres. From: chosen.
    pub least_area_m2: f64,
    /// Seed of the sampling. From: mark.
    pub seed: u64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        SurfaceOptions {
            up: None,
            tilt_rad: 0.26,
            height_band_m: None,
            region: None,
            least_area_m2: 0.04,
            seed: 1,
        }
    }
}

impl SurfaceOptions {
    /// True if a surface satisfies the requested height, region and area, whatever its role.
    pub fn wants(&self, surface: &Surface) -> bool {
        let up = self.up.unwrap_or(surface.up);
        // A tilted plane has its height where the surface is, not where the world begins.
        let height_m = up.dot(&surface.middle().coords);
        let height = self.height_band_m.is_none_or(|(low, high)| (low..=high).contains(&height_m));
        height
            && surface.area_m2 >= self.least_area_m2
            && self.region.as_ref().is_none_or(|r| r.holds(surface))
    }

    /// Surface clipped to the region; unchanged if outside.
    pub(super) fn within_region(&self, surface: Surface) -> Surface {
        match &self.region {
            Some(region) if self.wants(&surface) => region.cut(surface),
            _ => surface,
        }
    }

    /// The wanted surface, in words.
    pub(super) fn wanted(&self) -> String {
        let band = self
            .height_band_m
            .map_or(String::new(), |(low, high)| format!(" between {low:.2} and {high:.2} m high"));
        let tilt =
            self.up.map_or(String::new(), |_| format!(" within {:.0}° of level", self.tilt_rad.to_degrees()));
        format!("of {} m² or more{band}{tilt}", self.least_area_m2)
    }
}

/// The region where a surface is expected, seen from above.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Corners of the convex outline in the world, in either direction, metres.
    pub corners: Vec<Point3<f64>>,
    /// Maximum distance of the surface outside the region, metres.
    pub margin_m: f64,
}

impl Region {
    /// True if at least half of the smaller of surface and region lies in the other.
    fn holds(&self, surface: &Surface) -> bool {
        let own_m2 = polygon::area(&convex_hull(surface.flat(&self.corners)));
        let both_m2 = polygon::area(&self.common(surface));
        both_m2 >= 0.5 * surface.area_m2.min(own_m2) && both_m2 > 0.0
    }

    /// The part of the surface's outline in the widened region, in the surface's frame.
    fn common(&self, surface: &Surface) -> Vec<[f64; 2]> {
        polygon::clip(surface.flat(&surface.hull), &convex_hull(surface.flat(&self.corners)), self.margin_m)
    }

    /// Unit vectors across `up` into the region, with the edges' offsets along them, metres; empty
    /// for a region without area.
    pub(crate) fn edges(&self, up: &Vector3<f64>) -> Vec<(Vector3<f64>, f64)> {
        let n = self.corners.len();
        let middle = self.corners.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / n.max(1) as f64;
        let edge = |i: usize| {
            let (a, b) = (&self.corners[i].coords, &self.corners[(i + 1) % n].coords);
            let across = up.cross(&(b - a)).try_normalize(0.0)?;
            let inward = if across.dot(&(middle - a)) < 0.0 { -across } else { across };
            Some((inward, inward.dot(a)))
        };
        if n < 3 { Vec::new() } else { (0..n).filter_map(edge).collect() }
    }

    fn cut(&self, surface: Surface) -> Surface {
        let common = self.common(&surface);
        let world_from_surface = surface.surface_from_world.inverse();
        let hull = common.iter().map(|&[x, y]| world_from_surface * Point3::new(x, y, 0.0)).collect();
        Surface { hull, area_m2: polygon::area(&common), ..surface }
    }
}
