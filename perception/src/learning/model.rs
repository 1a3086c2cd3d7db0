//! Learning of a model: the object's pixels of the first view are propagated over the other views (section V).

use super::error::LearningError;
use super::frame::Frame;
use super::fuse::Measured;
use super::grow::{grown, transferred, without_outliers};
use super::mask::Mask;
use super::planes::{PlaneRules, Removed};
use super::register::Keyframe;
use super::supervoxel::Supervoxels;
use crate::cloud::Cloud;
use crate::neighbours::Neighbours;
use crate::noise::frontal_sigma_m;
use crate::view::View;
use crate::visibility::{DepthMap, Seen};
use crate::voxel;
use nalgebra::{Isometry3, Point3, Translation3};
use serde::{Deserialize, Serialize};

/// Options of learning, with the paper's values where stated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LearnOptions {
    /// Maximum distance of the object's points from the centre of its points in the first view, metres.
    pub reach_m: f64,
    /// Side of a supervoxel, metres (paper: 5 mm).
    pub supervoxel_m: f32,
    /// Minimum share of a supervoxel's pixels in the object for the supervoxel to stay in it (paper: 25 %).
    pub supervoxel_share: f64,
    /// Minimum share of a plane's pixels in the object for the plane to stay part of it (ϑ_obj of Eq. 3).
    pub plane_object_share: f64,
    /// Minimum share of a plane's pixels that were invisible in the first view for the plane to stay part of the object
    /// (ϑ_vis of Eq. 4).
    pub plane_hidden_share: f64,
    /// Radius around the object's points within which neighbouring points are added to it, metres (paper: 1 cm).
    pub radius_m: f32,
    /// Maximum angle between neighbouring normals of one surface, radians (paper: 20 degrees).
    pub angle_rad: f64,
    /// Side of the cubes that hold one model point each, metres (paper: 2 mm).
    pub cube_m: f32,
    /// True if each model point is the mean of the measurements around it, instead of the single best one (beyond the
    /// paper).
    pub smooth: bool,
    /// Maximum share of the known object that a view may see through; views above it are left out.
    pub through_share: f64,
}

impl Default for LearnOptions {
    fn default() -> Self {
        LearnOptions {
            reach_m: 0.45,
            supervoxel_m: 0.005,
            supervoxel_share: 0.25,
            plane_object_share: 0.25,
            plane_hidden_share: 0.25,
            radius_m: 0.01,
            angle_rad: 20_f64.to_radians(),
            cube_m: 0.002,
            smooth: true,
            through_share: 0.3,
        }
    }
}

/// Contribution of one view to a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Used {
    /// Number of object pixels; 0 if the view was left out.
    pub pixels: usize,
    /// Reason why the view was left out; `None` if it was used.
    pub left_out: Option<String>,
}

/// Learned model of a rigid object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearnedModel {
    /// Points relative to the object's centre, metres, with normals, and with colours if the views had them.
    pub cloud: Cloud,
    /// Pose of the model when learned: the object's centre, with the axes of the world.
    pub world_from_model: Isometry3<f64>,
    /// Contribution of each view, in order.
    pub looks: Vec<Used>,
}

/// Learns a model: propagates the object's pixels `mask` from the first view over the others, in order. Views whose
/// keyframe is not used are left out.
///
/// # Errors
/// If there is no view, one is no depth image, the mask has another size, the first view was left out, nothing is left
/// of the object, or an option is not positive.
pub fn learn(
    views: &[View],
    keyframes: &[Keyframe],
    mask: &[bool],
    options: &LearnOptions,
) -> Result<LearnedModel, LearningError> {
    let _span = tracing::debug_span!("learn", views = views.len()).entered();
    let first = views.first().ok_or(LearningError::NoViews)?;
    check(options)?;
    if mask.len() != first.cloud.len() {
        return Err(LearningError::Mask { found: mask.len(), expected: first.cloud.len() });
    }
    if let Some(why) = keyframes.first().filter(|f| !f.used).map(|f| f.why.clone()) {
        return Err(LearningError::FirstLeftOut { why });
    }
    let pose = |k: usize| keyframes.get(k).map_or(views[k].world_from_camera, |f| f.world_from_camera);
    let seen: Vec<u32> = (0..mask.len()).filter(|&i| mask[i]).map(|i| i as u32).collect();
    let seen = first.cloud.select(&seen).finite().transformed(&pose(0));
    let (low, high) = seen.bounds().ok_or(LearningError::NothingLeft { points: 0 })?;
    let centre = nalgebra::center(&low, &high).cast();

    let mut growing = Growing::new(options);
    let mut looks = Vec::new();
    for (k, view) in views.iter().enumerate() {
        if let Some(why) = keyframes.get(k).filter(|f| !f.used).map(|f| f.why.clone()) {
            looks.push(Used { pixels: 0, left_out: Some(why) });
            continue;
        }
        let frame = Frame::new(view, &pose(k), &centre, options.reach_m)
            .ok_or(LearningError::NotOrganised { view: k })?;
        looks.push(growing.look(frame, (k == 0).then_some(mask))?);
    }
    growing.finish(looks)
}

fn check(options: &LearnOptions) -> Result<(), LearningError> {
    for (field, value) in [
        ("reach_m", options.reach_m),
        ("supervoxel_m", f64::from(options.supervoxel_m)),
        ("radius_m", f64::from(options.radius_m)),
        ("angle_rad", options.angle_rad),
        ("cube_m", f64::from(options.cube_m)),
    ] {
        LearningError::positive(field, value)?;
    }
    Ok(())
}

/// Model under construction.
struct Growing<'a> {
    options: &'a LearnOptions,
    rules: PlaneRules,
    removed: Removed,
    first: Option<First>,
    /// Points of the object so far, world frame, thinned.
    object: Cloud,
    measured: Measured,
}

/// First view, in which the object was detected; what surrounds it there is no part of the object, however smoothly it
/// continues the surface.
struct First {
    map: DepthMap,
    /// Pixels of the object, with a margin.
    own: Mask,
}

/// Margin around the detected pixels that may still belong to the object, pixels.
const BESIDE_PX: usize = 8;

impl First {
    /// True if a world point lies on a surface that the first view shows outside the object's pixels.
    fn shows_beside(&self, p: &Point3<f32>) -> bool {
        let q = self.map.camera_from_world * p.cast::<f64>();
        let camera = &self.map.intrinsics;
        let Some(pixel) = camera.project(&q).and_then(|(u, v)| camera.pixel(u, v)) else { return false };
        !self.own.set[pixel] && self.map.look_from(&q, tolerance_m(&q)) == Seen::Surface
    }
}

/// Maximum distance between two views' measurements of one point, metres; `q`: the point in the camera frame.
fn tolerance_m(q: &Point3<f64>) -> f64 {
    0.01_f64.max(3.0 * f64::from(frontal_sigma_m(q.z as f32)))
}

/// Minimum number of object pixels in a view.
const LEAST_PIXELS: usize = 50;
/// Spacing to which the object's points are thinned for propagation to the next view, metres.
const CARRIED_M: f32 = 0.004;

impl<'a> Growing<'a> {
    fn new(options: &'a LearnOptions) -> Growing<'a> {
        Growing {
            options,
            rules: PlaneRules {
                object_share: options.plane_object_share,
                hidden_share: options.plane_hidden_share,
            },
            removed: Removed::default(),
            first: None,
            object: Cloud::default(),
            measured: Measured::default(),
        }
    }

    /// Processes one view: finds the object's pixels (`given` in the first view), filters (section V-A) and grows them
    /// (V-B), and keeps them for fusion (V-C).
    fn look(&mut self, mut frame: Frame, given: Option<&[bool]>) -> Result<Used, LearningError> {
        let options = self.options;
        let pieces = Supervoxels::of(&mut frame, options.supervoxel_m)?;
        let all = Mask::of(frame.grid, frame.near.iter().map(|&i| i as usize));
        let label = match given {
            Some(mask) => Mask { grid: frame.grid, set: mask.to_vec() },
            None => {
                if let Some(why) = self.contradiction(&frame) {
                    return Ok(Used { pixels: 0, left_out: Some(why) });
                }
                transferred(&frame, &all, &Neighbours::new(&self.object.points)?, options.radius_m)
            }
        };
        let mut object = label.closed(2).eroded(1);
        object.set.iter_mut().zip(&all.set).for_each(|(o, near)| *o &= near);
        object = without_outliers(&frame, &object)?;
        pieces.drop_unsupported(&mut object, options.supervoxel_share);
        let first =
            self.first.get_or_insert_with(|| First { map: frame.map.clone(), own: label.dilated(BESIDE_PX) });
        let mut usable = self.removed.filtered(&frame, &object, &first.map, &self.rules);
        let beside: Vec<usize> = usable.pixels().filter(|&i| first.shows_beside(&frame.points[i])).collect();
        beside.into_iter().for_each(|i| usable.set[i] = false);
        object.set.iter_mut().zip(&usable.set).for_each(|(o, usable)| *o &= usable);
        let object = grown(&frame, &usable, object, options.radius_m, options.angle_rad);
        let pixels = object.count();
        if pixels < LEAST_PIXELS {
            return match given {
                Some(_) => Err(LearningError::NothingLeft { points: pixels }),
                None => Ok(Used { pixels: 0, left_out: Some("the object is not in view".to_owned()) }),
            };
        }
        self.measured.add(&frame, &object);
        self.object.append(&Cloud::from_points(frame.cloud(&object).points));
        self.object = voxel::downsample(&self.object, CARRIED_M)?;
        Ok(Used { pixels, left_out: None })
    }

    /// Reason why a view contradicts the object known so far, as it sees through too much of it; `None` if it does not.
    fn contradiction(&self, frame: &Frame) -> Option<String> {
        let (mut through, mut seen) = (0, 0);
        for p in &self.object.points {
            let q = frame.map.camera_from_world * p.cast::<f64>();
            match frame.map.look_from(&q, tolerance_m(&q)) {
                Seen::Free => (through, seen) = (through + 1, seen + 1),
                Seen::Surface => seen += 1,
                Seen::Hidden | Seen::Never => {}
            }
        }
        let share = f64::from(through) / f64::from(seen.max(1));
        (share > self.options.through_share)
            .then(|| format!("it sees through {:.0} % of the object", 100.0 * share))
    }

    fn finish(self, looks: Vec<Used>) -> Result<LearnedModel, LearningError> {
        let cloud = self.measured.fused(self.options.cube_m, self.options.smooth)?;
        let Some((low, high)) = cloud.bounds() else {
            return Err(LearningError::NothingLeft { points: 0 });
        };
        let middle: Point3<f64> = nalgebra::center(&low, &high).cast();
        let world_from_model = Isometry3::from(Translation3::from(middle.coords));
        Ok(LearnedModel { cloud: cloud.transformed(&world_from_model.inverse()), world_from_model, looks })
    }
}
