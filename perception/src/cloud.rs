//! Point clouds, the data type shared by all of perception.

use crate::quantile::median;
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Size of an organised cloud (one point per pixel, row by row).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grid {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

/// Upper bound of the range of depth cameras and room scanners, metres. From: chosen.
const FARTHEST_TYPICAL_M: f64 = 100.0;
/// Upper bound of map coordinates, metres. From: derived, the width of the earth.
const FARTHEST_ON_EARTH_M: f64 = 1.3e7;
/// Maximum median distance of points from their median, metres, in a cloud that is in metres though far from the
/// origin. From: chosen.
const WIDEST_PLACE_M: f64 = 20.0;
/// Extent relative to the distance from the origin, below which a cloud counts as far away rather
/// than in other units. From: chosen.
const NARROW: f64 = 0.01;
/// Minimum median distance, in the cloud's unit, of a cloud that may be in millimetres; nearer would be too near for a
/// depth camera. From: chosen.
const LEAST_MILLIMETRES: f64 = 300.0;
/// Maximum median distance, in the cloud's unit, of a cloud that may be in centimetres; farther would be too far for a
/// depth camera. From: chosen.
const MOST_CENTIMETRES: f64 = 800.0;
/// Spacing of single-precision coordinates, metres, above which objects are blurred. From: chosen.
const COARSEST_M: f64 = 1e-4;

/// Points with optional attributes; each attribute that is present has one entry per point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cloud {
    /// Positions, metres; NaN for a missing return (organised clouds only).
    pub points: Vec<Point3<f32>>,
    /// Image size if the points are the pixels of an image, row by row; `None` otherwise.
    pub grid: Option<Grid>,
    /// Red, green and blue.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Unit normals; NaN where undefined.
    pub normals: Option<Vec<Vector3<f32>>>,
    /// Label of each point, with a meaning defined by the maker of the cloud (segment, object, truth).
    pub labels: Option<Vec<u32>>,
}

/// Inconsistency between the parts of a cloud.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CloudError {
    /// An attribute has another length than the points.
    #[error("{attribute} has {found} entries where the cloud has {points} points: give one entry a point")]
    Length {
        /// Name of the attribute.
        attribute: &'static str,
        /// Number of entries of the attribute.
        found: usize,
        /// Number of points in the cloud.
        points: usize,
    },
    /// The size of the grid does not match the number of points.
    #[error("a grid of {width} x {height} does not hold {points} points: drop the grid or mend its size")]
    Grid {
        /// Number of columns.
        width: usize,
        /// Number of rows.
        height: usize,
        /// Number of points in the cloud.
        points: usize,
    },
    /// There are more points than 32-bit indices can name.
    #[error(
        "{points} points are more than indices of 32 bits can name ({}): split the cloud or thin it by voxels",
        u32::MAX
    )]
    TooMany {
        /// Number of points in the cloud.
        points: usize,
    },
}

impl Cloud {
    /// Creates a cloud of bare points without a grid.
    pub fn from_points(points: Vec<Point3<f32>>) -> Self {
        Cloud { points, ..Cloud::default() }
    }

    /// Number of points, including pixels without a return.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if the cloud has no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Checks that attributes and grid match the number of points; clouds from this crate's readers
    /// always pass.
    pub fn check(&self) -> Result<(), CloudError> {
        let points = self.points.len();
        if points > u32::MAX as usize {
            return Err(CloudError::TooMany { points });
        }
        let lengths = [
            ("colours", self.colours.as_ref().map(Vec::len)),
            ("normals", self.normals.as_ref().map(Vec::len)),
            ("labels", self.labels.as_ref().map(Vec::len)),
        ];
        for (attribute, length) in lengths {
            if let Some(found) = length.filter(|&l| l != points) {
                return Err(CloudError::Length { attribute, found, points });
            }
        }
        match self.grid {
            Some(Grid { width, height }) if width.checked_mul(height) != Some(points) => {
                Err(CloudError::Grid { width, height, points })
            }
            _ => Ok(()),
        }
    }

    /// Number of points that are finite in all three coordinates.
    pub fn count_finite(&self) -> usize {
        self.points.iter().filter(|p| is_finite(p)).count()
    }

    /// Points at `indices` in that order, with attributes, without grid; indices out of range are skipped.
    pub fn select(&self, indices: &[u32]) -> Cloud {
        fn pick<T: Copy>(from: &[T], indices: &[u32]) -> Vec<T> {
            indices.iter().filter_map(|&i| from.get(i as usize).copied()).collect()
        }
        Cloud {
            points: pick(&self.points, indices),
            grid: None,
            colours: self.colours.as_deref().map(|c| pick(c, indices)),
            normals: self.normals.as_deref().map(|n| pick(n, indices)),
            labels: self.labels.as_deref().map(|l| pick(l, indices)),
        }
    }

    /// Points accepted by `keep`, in order, with attributes, without grid.
    pub fn filter(&self, keep: impl Fn(&Point3<f32>) -> bool) -> Cloud {
        let kept: Vec<u32> = (0u32..).zip(&self.points).filter(|(_, p)| keep(p)).map(|(i, _)| i).collect();
        self.select(&kept)
    }

    /// Finite points, in order, with attributes, without grid.
    pub fn finite(&self) -> Cloud {
        self.filter(is_finite)
    }

    /// Cloud in another frame, with grid and attributes. Computed in `f64`.
    pub fn transformed(&self, to_from_here: &Isometry3<f64>) -> Cloud {
        let rotation = to_from_here.rotation.to_rotation_matrix();
        let shift = to_from_here.translation.vector;
        let turn = |v: Vector3<f64>| rotation * v;
        Cloud {
            points: self
                .points
                .iter()
                .map(|p| Point3::from((turn(p.coords.cast()) + shift).cast()))
                .collect(),
            grid: self.grid,
            colours: self.colours.clone(),
            normals: self.normals.as_ref().map(|n| n.iter().map(|v| turn(v.cast()).cast()).collect()),
            labels: self.labels.clone(),
        }
    }

    /// Appends the points of `other`, without grid. An attribute of only one of two non-empty
    /// clouds is dropped.
    pub fn append(&mut self, other: &Cloud) {
        fn join<T: Clone>(ours: &mut Option<Vec<T>>, theirs: &Option<Vec<T>>, empty: bool) {
            match (ours.as_mut(), theirs) {
                (Some(a), Some(b)) => a.extend_from_slice(b),
                (None, Some(b)) if empty => *ours = Some(b.clone()),
                _ => *ours = None,
            }
        }
        if other.is_empty() {
            return;
        }
        let empty = self.is_empty();
        join(&mut self.colours, &other.colours, empty);
        join(&mut self.normals, &other.normals, empty);
        join(&mut self.labels, &other.labels, empty);
        self.points.extend_from_slice(&other.points);
        self.grid = None;
    }

    /// Minimum and maximum corner of the bounding box of the finite points, metres; `None` without
    /// finite points.
    pub fn bounds(&self) -> Option<(Point3<f32>, Point3<f32>)> {
        let mut finite = self.points.iter().filter(|p| is_finite(p));
        let first = *finite.next()?;
        Some(finite.fold((first, first), |(low, high), p| (low.inf(p), high.sup(p))))
    }

    /// Warning if most points are farther from the sensor (the origin) than depth cameras and room scanners measure,
    /// with the probable cause. [`Cloud::scaled`] converts other units; map coordinates need an offset subtracted
    /// before the file is written.
    pub fn unit_warning(&self) -> Option<String> {
        if self.is_surely_near() {
            return None;
        }
        let ranges = || self.points.iter().filter(|p| is_finite(p)).map(|p| p.coords.cast::<f64>().norm());
        let (near, all) =
            ranges().fold((0, 0), |(near, all), r| (near + usize::from(r <= FARTHEST_TYPICAL_M), all + 1));
        if near > all / 2 || all == 0 {
            return None;
        }
        let far_m = median(ranges());
        let half = format!("half of the points lie more than {far_m:.0} m from the sensor");
        if far_m > FARTHEST_ON_EARTH_M {
            return Some(
                "half of the points lie farther away than the earth is wide: no unit makes up for that; the coordinates are damaged, \
                 or of another type or order of bytes than the file says"
                    .into(),
            );
        }
        if let Some(within_m) =
            self.within_of_middle_m().filter(|&m| m <= WIDEST_PLACE_M || m < far_m * NARROW)
        {
            return Some(self.far_from_origin(far_m).unwrap_or(format!(
                "{half}, and {within_m:.1} m from their middle: is the sensor at the origin, and are these metres?"
            )));
        }
        Some(match far_m {
            m if m < LEAST_MILLIMETRES => format!("{half}: this looks like centimetres; scale by 0.01"),
            m if m < MOST_CENTIMETRES => {
                format!("{half}: this looks like centimetres or millimetres; scale by 0.01 or 0.001")
            }
            _ => format!("{half}: this looks like millimetres; scale by 0.001"),
        })
    }

    /// True if more than half of the finite points lie within typical range; avoids a square root per point.
    fn is_surely_near(&self) -> bool {
        /// Fraction of the squared range that single precision surely does not round beyond it. From: rounding.
        const SURE: f32 = 0.999;
        let sure_sq = (FARTHEST_TYPICAL_M * FARTHEST_TYPICAL_M) as f32 * SURE;
        let count = |(near, finite): (u32, u32), p: &Point3<f32>| {
            (near + u32::from(p.coords.norm_squared() < sure_sq), finite + u32::from(is_finite(p)))
        };
        self.points.len() <= u32::MAX as usize && {
            let (near, finite) = self.points.iter().fold((0, 0), count);
            near > finite / 2
        }
    }

    /// Median distance of the finite points from their median, metres; `None` without finite
    /// points.
    fn within_of_middle_m(&self) -> Option<f64> {
        let finite = || self.points.iter().filter(|p| is_finite(p)).map(|p| p.cast::<f64>());
        finite().next()?;
        let middle = Point3::from([0, 1, 2].map(|axis| median(finite().map(|p| p[axis]))));
        Some(median(finite().map(|p| (p - middle).norm())))
    }

    /// Note that coordinates are so far from the origin that single precision blurs them; `None` if they are near
    /// enough. `far_m`: typical distance from the origin, metres.
    fn far_from_origin(&self, far_m: f64) -> Option<String> {
        let (low, high) = self.bounds()?;
        let greatest = low.coords.amax().max(high.coords.amax());
        let apart_m = f64::from(greatest.next_up()) - f64::from(greatest);
        (apart_m > COARSEST_M).then(|| {
            format!(
                "coordinates lie {far_m:.0} m from the origin, where single precision tells places {:.1} mm apart: subtract an offset \
                 before writing",
                apart_m * 1e3
            )
        })
    }

    /// Cloud with every coordinate multiplied by `factor` (0.001 converts millimetres to metres).
    pub fn scaled(&self, factor: f32) -> Cloud {
        Cloud { points: self.points.iter().map(|p| p * factor).collect(), ..self.clone() }
    }
}

/// True if all three coordinates are finite.
#[inline]
pub fn is_finite(p: &Point3<f32>) -> bool {
    // What is not finite times nothing is NaN: one comparison in place of three.
    p.x * 0.0 + p.y * 0.0 + p.z * 0.0 == 0.0
}
