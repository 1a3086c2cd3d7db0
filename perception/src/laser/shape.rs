//! Shape model: constraints on an object's outline from one scan or many.

use super::features::HullFeatures;
use super::scan::is_pose;
use crate::hull::{Hull, convex};
use crate::plane::Plane;
use nalgebra::{Isometry2, Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// One scan's readings of an object with their bounding angles (section III of the paper). Angles are anticlockwise
/// from the laser's x axis, radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectScan {
    /// End points of the object's readings, laser frame, metres.
    pub points: Vec<Point2<f64>>,
    /// RightBound: nearest angle to the right of the object at which the laser looked past it.
    pub right_bound_rad: f64,
    /// RightObject: rightmost angle at which the scan hit the object.
    pub right_object_rad: f64,
    /// LeftObject: leftmost angle at which the scan hit the object.
    pub left_object_rad: f64,
    /// LeftBound: nearest angle to the left of the object at which the laser looked past it.
    pub left_bound_rad: f64,
}

/// Scan of an object, with its pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PosedScan {
    /// Readings of the object, with their bounding angles.
    pub scan: ObjectScan,
    /// Pose of the laser, metres: in the map before scans are aligned, in the model's own frame after.
    pub model_from_laser: Isometry2<f64>,
}

/// Scans of one object with poses in one frame: `M = {(S, p_S)}`. Deserialised only if every scan
/// is valid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written")]
pub struct ShapeModel {
    scans: Vec<PosedScan>,
}

/// Serialised form of [`ShapeModel`], not yet validated.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    scans: Vec<PosedScan>,
}

impl TryFrom<Written> for ShapeModel {
    type Error = ShapeError;

    fn try_from(written: Written) -> Result<ShapeModel, ShapeError> {
        ShapeModel::new(written.scans)
    }
}

/// Reason why scans form no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// The list of scans is empty.
    #[error("a shape model of no scans: give at least one scan in which the thing is bounded on both sides")]
    NoScans,
    /// A scan has no points, or one that is not finite.
    #[error(
        "scan {index} has no point, or one that is not finite: give the places where readings met the thing"
    )]
    Points {
        /// Index of the scan.
        index: usize,
    },
    /// The angles of a scan are not in order, or span half a turn or more.
    #[error(
        "the angles of scan {index} are {angles_rad:?} rad: expected right bound < right object <= left object < left bound, over less than half a turn"
    )]
    Angles {
        /// Index of the scan.
        index: usize,
        /// The angles, from right to left, radians.
        angles_rad: [f64; 4],
    },
    /// The pose of a scan is not finite, or its rotation is invalid.
    #[error("the pose of scan {index} is not finite, or its rotation is no unit complex number")]
    Pose {
        /// Index of the scan.
        index: usize,
    },
}

impl ShapeModel {
    /// Creates a model from scans at their poses.
    ///
    /// # Errors
    /// If there is no scan, or one is invalid.
    pub fn new(scans: Vec<PosedScan>) -> Result<ShapeModel, ShapeError> {
        if scans.is_empty() {
            return Err(ShapeError::NoScans);
        }
        for (index, posed) in scans.iter().enumerate() {
            posed.scan.check(index)?;
            if !is_pose(&posed.model_from_laser) {
                return Err(ShapeError::Pose { index });
            }
        }
        Ok(ShapeModel { scans })
    }

    /// Scans of the model, with their poses.
    pub fn scans(&self) -> &[PosedScan] {
        &self.scans
    }

    /// End points of all scans' readings of the object, model frame, metres.
    pub fn points(&self) -> impl Iterator<Item = Point2<f64>> {
        self.scans.iter().flat_map(|s| s.scan.points.iter().map(|p| s.model_from_laser * p))
    }

    /// Convex hull of all the object's readings, in the plane z = 0 of the model frame.
    pub fn hull(&self) -> Hull {
        hull_of(self.points())
    }

    /// Area, perimeter and centre of the hull.
    pub fn features(&self) -> HullFeatures {
        let hull = self.hull();
        HullFeatures { area_m2: hull.area_m2(), perimeter_m: hull.perimeter_m(), centre: hull.centre() }
    }

    /// Model moved by a transformation of its frame: `t(N, p)` of Eq. 4.
    pub fn moved(&self, by: &Isometry2<f64>) -> ShapeModel {
        let moved =
            |s: &PosedScan| PosedScan { scan: s.scan.clone(), model_from_laser: by * s.model_from_laser };
        ShapeModel { scans: self.scans.iter().map(moved).collect() }
    }

    /// Model with the scans of both, in this model's frame.
    pub fn joined(&self, other: &ShapeModel, self_from_other: &Isometry2<f64>) -> ShapeModel {
        let scans = [self.scans.clone(), other.moved(self_from_other).scans].concat();
        ShapeModel { scans }
    }
}

impl ObjectScan {
    fn check(&self, index: usize) -> Result<(), ShapeError> {
        let finite = |p: &Point2<f64>| p.x.is_finite() && p.y.is_finite();
        if self.points.is_empty() || !self.points.iter().all(finite) {
            return Err(ShapeError::Points { index });
        }
        let angles_rad =
            [self.right_bound_rad, self.right_object_rad, self.left_object_rad, self.left_bound_rad];
        let [right_bound, right, left, left_bound] = angles_rad;
        let ordered = right_bound < right && right <= left && left < left_bound;
        if !(ordered && left_bound - right_bound < std::f64::consts::PI) {
            return Err(ShapeError::Angles { index, angles_rad });
        }
        Ok(())
    }
}

/// Convex hull of points in the plane z = 0.
pub(super) fn hull_of(points: impl Iterator<Item = Point2<f64>>) -> Hull {
    Hull {
        plane: Plane { normal: Vector3::z(), offset_m: 0.0 },
        origin: Point3::origin(),
        u: Vector3::x(),
        v: Vector3::y(),
        corners: convex(points.collect()),
    }
}
