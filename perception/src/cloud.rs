//! Point clouds: what every step of perception takes and gives.

use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Rows and columns of an organised cloud (one point a pixel, row by row).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grid {
    /// Columns (pixels a row).
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Points with what is known of each. All attributes that are present have one entry a point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cloud {
    /// Positions in metres. NaN is "no return" and stands in organised clouds only.
    pub points: Vec<Point3<f32>>,
    /// Present if the points are the pixels of an image, row by row.
    pub grid: Option<Grid>,
    /// Red, green, blue.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Unit normals; NaN where none could be estimated.
    pub normals: Option<Vec<Vector3<f32>>>,
    /// A number a point whose meaning the maker of the cloud states (segment, object, truth).
    pub labels: Option<Vec<u32>>,
}

/// A cloud whose parts do not fit together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CloudError {
    /// An attribute has another length than the points.
    #[error("{attribute} has {found} entries where the cloud has {points} points: give one entry a point")]
    Length {
        /// Which attribute.
        attribute: &'static str,
        /// Its entries.
        found: usize,
        /// Points in the cloud.
        points: usize,
    },
    /// The grid does not hold the points.
    #[error("a grid of {width} x {height} does not hold {points} points: drop the grid or mend its size")]
    Grid {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Points in the cloud.
        points: usize,
    },
    /// More points than 32-bit indices can name.
    #[error(
        "{points} points are more than indices of 32 bits can name ({}): split the cloud or thin it by voxels",
        u32::MAX
    )]
    TooMany {
        /// Points in the cloud.
        points: usize,
    },
}

impl Cloud {
    /// A cloud of bare points without a grid.
    pub fn from_points(points: Vec<Point3<f32>>) -> Self {
        Cloud { points, ..Cloud::default() }
    }

    /// Number of points, pixels without a return included.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if there is no point at all.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Checks that attributes and grid fit the points. Readers of this crate give only clouds that pass.
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

    /// How many points are finite in all three coordinates.
    pub fn count_finite(&self) -> usize {
        self.points.iter().filter(|p| is_finite(p)).count()
    }

    /// The points at `indices`, in that order, with their attributes; the grid is given up. Indices beyond the end are left out.
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

    /// The points for which `keep` holds, in their order, with their attributes; the grid is given up.
    pub fn filter(&self, keep: impl Fn(&Point3<f32>) -> bool) -> Cloud {
        let kept: Vec<u32> = (0u32..).zip(&self.points).filter(|(_, p)| keep(p)).map(|(i, _)| i).collect();
        self.select(&kept)
    }

    /// The finite points, in their order, with their attributes; the grid is given up.
    pub fn finite(&self) -> Cloud {
        self.filter(is_finite)
    }

    /// The cloud in another frame: points moved, normals turned, grid and the rest kept. Computed in `f64`.
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

    /// Adds the points of `other` behind ours; the grid is given up. An attribute that only one of two non-empty clouds has is dropped.
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

    /// Least and greatest corner of the box around the finite points, metres; `None` if there is none.
    pub fn bounds(&self) -> Option<(Point3<f32>, Point3<f32>)> {
        let mut finite = self.points.iter().filter(|p| is_finite(p));
        let first = *finite.next()?;
        Some(finite.fold((first, first), |(low, high), p| (low.inf(p), high.sup(p))))
    }

    /// A warning if the cloud is likely not in metres: a typical return lies farther away than any depth camera or room scanner sees.
    ///
    /// Judged by the median distance of the finite points from the sensor (the origin): beyond 100 it is taken for millimetres.
    /// Mend with [`Cloud::scaled`]`(0.001)`.
    pub fn unit_warning(&self) -> Option<String> {
        const FARTHEST_TYPICAL_M: f32 = 100.0;
        let ranges = || self.points.iter().filter(|p| is_finite(p)).map(|p| p.coords.norm());
        let (near, all) =
            ranges().fold((0, 0), |(near, all), r| (near + usize::from(r <= FARTHEST_TYPICAL_M), all + 1));
        if near > all / 2 || all == 0 {
            return None;
        }
        let mut ranges: Vec<f32> = ranges().collect();
        let (_, median, _) = ranges.select_nth_unstable_by(all / 2, f32::total_cmp);
        Some(format!(
            "half of the points lie more than {median:.0} m from the sensor: this looks like millimetres; scale by 0.001"
        ))
    }

    /// The cloud with every coordinate multiplied by `factor` (0.001 takes millimetres to metres).
    pub fn scaled(&self, factor: f32) -> Cloud {
        Cloud { points: self.points.iter().map(|p| p * factor).collect(), ..self.clone() }
    }
}

/// True if all three coordinates are finite.
pub fn is_finite(p: &Point3<f32>) -> bool {
    // What is not finite times nothing is NaN: one comparison in place of three.
    p.x * 0.0 + p.y * 0.0 + p.z * 0.0 == 0.0
}
