//! Resolution of the units and conventions of a recording.
//!
//! A *reading* is one choice of units and conventions. Under the right one, what a view shows lies where a
//! neighbouring view measures it. Under a wrong one (inverse poses, axes of another library, millimetres
//! taken for metres) most of it does not. The score of a reading is the share of points that neighbouring
//! views confirm.

use crate::recorded::picture::RawDepth;
use crate::recorded::settings::CameraSettings;
use descry_perception::Intrinsics;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};
use std::fmt;

/// Tolerance on the depth of a point in another view, as a share of the depth: noise and slanted surfaces. From: chosen.
const TOLERANCE: f64 = 0.02;
/// Minimum share of points confirmed by neighbouring views for a correct reading, since objects move, and
/// depth is noisy at edges. From: chosen.
const LEAST_AGREEMENT: f64 = 0.6;
/// Difference of two scores below which they count as equal. From: chosen.
pub(crate) const MARGIN: f64 = 0.1;
/// Minimum share of the sampled points that the other view must confirm or contradict for a score above zero.
/// From: chosen.
const LEAST_OVERLAP: f64 = 0.05;
/// Share of points at the same pixel and depth in two views, from which the camera has not moved enough to
/// tell readings apart. From: chosen.
const STILL: f64 = 0.85;
/// Typical depths of cameras in rooms, metres. From: chosen.
const PLAUSIBLE_M: [f64; 2] = [0.15, 15.0];
/// Number of points of each view that are compared with the other view of a pair. From: chosen.
const POINTS: usize = 400;
/// Units of a depth image in a metre: millimetres, TUM's, Replica's, a quarter of a millimetre, metres, centimetres, inches.
const DEPTH_SCALES: [f64; 7] = [1000.0, 5000.0, 6553.5, 4000.0, 1.0, 100.0, 1.0 / 0.0254];
/// Candidate units of a position, metres: metre, millimetre, centimetre, inch.
const POSE_UNITS_M: [f64; 4] = [1.0, 0.001, 0.01, 0.0254];

/// Direction of the poses of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Poses {
    /// Pose of the camera in the world.
    WorldFromCamera,
    /// Inverse pose, world to camera, often called extrinsics.
    CameraFromWorld,
}

/// Axes of the camera frame to which the poses refer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// x right, y down, z forward.
    Optical,
    /// x right, y up, z backward.
    OpenGl,
    /// x forward, y left, z up.
    Body,
}

impl Poses {
    /// Both directions.
    pub const ALL: [Poses; 2] = [Poses::WorldFromCamera, Poses::CameraFromWorld];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Poses::WorldFromCamera => "world-from-camera",
            Poses::CameraFromWorld => "camera-from-world",
        }
    }
}

impl Axes {
    /// All conventions.
    pub const ALL: [Axes; 3] = [Axes::Optical, Axes::OpenGl, Axes::Body];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Axes::Optical => "optical",
            Axes::OpenGl => "opengl",
            Axes::Body => "body",
        }
    }

    /// Rotation from the optical frame into the camera frame with these axes.
    fn rotation_from_optical(self) -> UnitQuaternion<f64> {
        let rows = match self {
            Axes::Optical => return UnitQuaternion::identity(),
            Axes::OpenGl => Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0),
            Axes::Body => Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        };
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
    }
}

/// A choice of the units and conventions of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conventions {
    /// Direction of the poses.
    pub poses: Poses,
    /// Axes of the camera frame.
    pub axes: Axes,
    /// Unit of the positions, metres.
    pub pose_unit_m: f64,
    /// Units of a depth image in a metre.
    pub depth_scale: f64,
}

impl Conventions {
    /// Conventions of poses world-from-camera, with optical axes and in metres, and of `depth_scale` units of
    /// depth in a metre.
    pub fn usual(depth_scale: f64) -> Conventions {
        Conventions { poses: Poses::WorldFromCamera, axes: Axes::Optical, pose_unit_m: 1.0, depth_scale }
    }

    /// Converts a stated pose to the pose of the optical frame in the world, metres.
    pub fn world_from_camera(&self, stated: &Isometry3<f64>) -> Isometry3<f64> {
        let translation = Translation3::from(stated.translation.vector * self.pose_unit_m);
        let in_metres = Isometry3::from_parts(translation, stated.rotation);
        let world_from_axes = match self.poses {
            Poses::WorldFromCamera => in_metres,
            Poses::CameraFromWorld => in_metres.inverse(),
        };
        world_from_axes * self.axes.rotation_from_optical()
    }

    /// Number of units and conventions in which two readings differ.
    fn differs(&self, other: &Conventions) -> usize {
        [
            self.poses != other.poses,
            self.axes != other.axes,
            self.pose_unit_m != other.pose_unit_m,
            self.depth_scale != other.depth_scale,
        ]
        .into_iter()
        .filter(|d| *d)
        .count()
    }
}

impl fmt::Display for Conventions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (poses, axes) = (self.poses.name(), self.axes.name());
        write!(
            f,
            "--poses {poses} --axes {axes} --pose-unit {} --depth-scale {}",
            self.pose_unit_m,
            rounded(self.depth_scale)
        )
    }
}

fn rounded(scale: f64) -> f64 {
    (scale * 1e4).round() / 1e4
}

/// Units and conventions that the user gives; `None` for those to be resolved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Given {
    /// Direction of the poses.
    pub poses: Option<Poses>,
    /// Axes of the camera frame.
    pub axes: Option<Axes>,
    /// Unit of the positions, metres.
    pub pose_unit_m: Option<f64>,
    /// Units of a depth image in a metre.
    pub depth_scale: Option<f64>,
}

impl Given {
    fn is_complete(&self) -> bool {
        self.poses.is_some()
            && self.axes.is_some()
            && self.pose_unit_m.is_some()
            && self.depth_scale.is_some()
    }

    fn applied(&self, stated: &Conventions) -> Conventions {
        Conventions {
            poses: self.poses.unwrap_or(stated.poses),
            axes: self.axes.unwrap_or(stated.axes),
            pose_unit_m: self.pose_unit_m.unwrap_or(stated.pose_unit_m),
            depth_scale: self.depth_scale.unwrap_or(stated.depth_scale),
        }
    }
}

/// A depth view as stored in the recording.
#[derive(Clone, Debug)]
pub struct StatedView {
    /// Pose in the units and convention of the files.
    pub pose: Isometry3<f64>,
    /// Depth camera.
    pub camera: CameraSettings,
    /// Depth image, in the units of the files.
    pub depth: RawDepth,
}

impl StatedView {
    fn intrinsics(&self) -> Intrinsics {
        self.camera.with_size((self.depth.width, self.depth.height))
    }

    /// Column, row and stored depth of some pixels, spread over the image.
    fn sampled(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let (pixels, width) = (self.depth.units.len(), self.depth.width.max(1));
        // A step that shares no factor with usual widths meets all columns.
        let step = (pixels / POINTS).max(1) | 1;
        let at = move |i: usize| ((i % width) as f64, (i / width) as f64, f64::from(self.depth.units[i]));
        (0..pixels).step_by(step).map(at).filter(|(_, _, d)| d.is_finite() && *d > 0.0)
    }

    /// Minimum and maximum stored depth in the 3x3 pixels around a pixel; `None` without a return.
    fn around(&self, pixel: usize) -> Option<(f64, f64)> {
        let (width, height) = (self.depth.width, self.depth.height);
        let (column, row) = (pixel % width, pixel / width);
        let mut range: Option<(f64, f64)> = None;
        for row in row.saturating_sub(1)..(row + 2).min(height) {
            for column in column.saturating_sub(1)..(column + 2).min(width) {
                let depth = f64::from(self.depth.units[row * width + column]);
                if depth.is_finite() {
                    let (low, high) = range.unwrap_or((depth, depth));
                    range = Some((low.min(depth), high.max(depth)));
                }
            }
        }
        range
    }
}

/// Counts of the points of views that were compared under one reading: sampled, confirmed and contradicted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tally {
    sampled: usize,
    agree: usize,
    /// Number of points that lie in front of what the other view measures.
    contradicted: usize,
}

impl Tally {
    /// Share of the confirmed points among the confirmed and contradicted ones; 0 if these are too few.
    fn share(&self) -> f64 {
        let comparable = (self.agree + self.contradicted) as f64;
        if comparable < 1.0 || comparable < LEAST_OVERLAP * self.sampled as f64 {
            return 0.0;
        }
        self.agree as f64 / comparable
    }

    /// Compares the points of one view with the depth image of another; points behind the measured surface
    /// may be occluded and are not counted.
    fn compare(&mut self, from: &StatedView, to: &StatedView, to_from_from: &Isometry3<f64>, scale: f64) {
        let (camera, other) = (from.intrinsics(), to.intrinsics());
        for (column, row, depth) in from.sampled() {
            self.sampled += 1;
            let point: Point3<f64> = to_from_from * camera.unproject(column, row, depth / scale);
            let pixel = other.project(&point).and_then(|(u, v)| other.pixel(u, v));
            let Some((near, far)) = pixel.and_then(|pixel| to.around(pixel)) else { continue };
            let (near, far, tolerance) = (near / scale, far / scale, TOLERANCE * point.z);
            if point.z < near - tolerance {
                self.contradicted += 1;
            } else if point.z <= far + tolerance {
                self.agree += 1;
            }
        }
    }
}

/// Two views that show much of the same from different places.
#[derive(Clone, Debug)]
pub struct Pair(pub StatedView, pub StatedView);

impl Pair {
    /// True if the camera moved enough to tell readings apart: most pixels of one view differ from those of
    /// the other.
    pub fn tells(&self) -> bool {
        let mut tally = Tally::default();
        tally.compare(&self.0, &self.1, &Isometry3::identity(), 1.0);
        tally.compare(&self.1, &self.0, &Isometry3::identity(), 1.0);
        tally.share() < STILL
    }
}

/// Score of a reading: share of the comparable points that the other view of their pair confirms.
pub(crate) fn agreement(reading: &Conventions, pairs: &[Pair]) -> f64 {
    let mut tally = Tally::default();
    for Pair(a, b) in pairs {
        let (world_from_a, world_from_b) =
            (reading.world_from_camera(&a.pose), reading.world_from_camera(&b.pose));
        let b_from_a = world_from_b.inverse() * world_from_a;
        tally.compare(a, b, &b_from_a, reading.depth_scale);
        tally.compare(b, a, &b_from_a.inverse(), reading.depth_scale);
    }
    tally.share()
}

/// Median stored depth over all pairs, in the units of the files; `None` without a return.
fn typical(pairs: &[Pair]) -> Option<f64> {
    let views = pairs.iter().flat_map(|Pair(a, b)| [a, b]);
    let mut depths: Vec<f64> = views.flat_map(StatedView::sampled).map(|(_, _, depth)| depth).collect();
    depths.sort_unstable_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied()
}

/// All readings that agree with what the user gives, ordered by the number of differences from `stated`,
/// which is first.
fn candidates(stated: &Conventions, given: &Given) -> Vec<Conventions> {
    fn one_or<T: Copy>(given: Option<T>, all: &[T]) -> Vec<T> {
        given.map_or(all.to_vec(), |g| vec![g])
    }
    let mut scales = one_or(given.depth_scale, &DEPTH_SCALES);
    let mut units_m = one_or(given.pose_unit_m, &POSE_UNITS_M);
    if !scales.contains(&stated.depth_scale) {
        scales.push(stated.depth_scale);
    }
    if !units_m.contains(&stated.pose_unit_m) {
        units_m.push(stated.pose_unit_m);
    }
    let mut all = vec![*stated];
    for poses in one_or(given.poses, &Poses::ALL) {
        for axes in one_or(given.axes, &Axes::ALL) {
            for &pose_unit_m in &units_m {
                for &depth_scale in &scales {
                    all.push(Conventions { poses, axes, pose_unit_m, depth_scale });
                }
            }
        }
    }
    all.sort_by_key(|reading| reading.differs(stated));
    all.dedup();
    all
}

/// Chooses the reading under which the views agree, `stated` if that is among the best; also returns a note
/// for people with the reason.
///
/// # Errors
/// The open question, and the options that answer it: several readings fit alike, or none does.
pub fn settle(
    stated: &Conventions,
    given: &Given,
    pairs: &[Pair],
) -> Result<(Conventions, String), (String, String)> {
    let stated = given.applied(stated);
    if pairs.is_empty() {
        let note = "no two views show the same from different places, so units and poses could not be checked: they are read as \
                    the layout defines them";
        return Ok((stated, note.into()));
    }
    let typical = typical(pairs).unwrap_or(f64::NAN);
    let plausible = |r: &Conventions| (PLAUSIBLE_M[0]..=PLAUSIBLE_M[1]).contains(&(typical / r.depth_scale));
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let scored: Vec<(Conventions, f64)> = candidates(&stated, given)
        .into_iter()
        .filter(|r| *r == stated || plausible(r))
        .map(|r| (r, agreement(&r, pairs)))
        .collect();
    let as_stated = scored[0].1;
    let best = scored.iter().filter(|(r, _)| plausible(r)).map(|(_, s)| *s).fold(0.0, f64::max);
    if given.is_complete() {
        let note = format!(
            "read as you say: {} of what one view shows lies where the next measures it",
            percent(as_stated)
        );
        return Ok((stated, note));
    }
    let depth = format!("(the typical depth would be {:.3} m)", typical / stated.depth_scale);
    if best < LEAST_AGREEMENT {
        let problem = format!(
            "the views do not agree however units and poses are read: {} of what one view shows lies where the next measures it \
             as the layout defines them {depth}, {} at best",
            percent(as_stated),
            percent(best)
        );
        let mend = "are these the poses and the camera of these frames? Else say how they are meant: --depth-scale, --pose-unit, --poses, --axes, --camera";
        return Err((problem, mend.into()));
    }
    if plausible(&stated) && as_stated >= best - MARGIN {
        let note = format!(
            "the views agree: {} of what one view shows lies where the next measures it",
            percent(as_stated)
        );
        return Ok((stated, note));
    }
    let near: Vec<&(Conventions, f64)> =
        scored.iter().filter(|(r, s)| plausible(r) && *s >= best - MARGIN).collect();
    let fewest = near.iter().map(|(r, _)| r.differs(&stated)).min().unwrap_or(0);
    let fitting: Vec<&(Conventions, f64)> =
        near.into_iter().filter(|(r, _)| r.differs(&stated) == fewest).collect();
    if let [(reading, share)] = fitting[..] {
        let note = format!(
            "read with {reading}: so {} of what one view shows lies where the next measures it, and {} as the layout defines it {depth}",
            percent(*share),
            percent(as_stated)
        );
        return Ok((*reading, note));
    }
    let listed: Vec<String> =
        fitting.iter().map(|(r, s)| format!("\n  {r}   ({} agree)", percent(*s))).collect();
    let problem = format!(
        "units or poses are not as the layout defines them ({} of what one view shows agrees with the next), and several other readings fit alike:{}",
        percent(as_stated),
        listed.concat()
    );
    Err((problem, "\n  say which is meant with these options of `descry import`".into()))
}
