//! The views of one arrangement: a body drives around the surface and looks.

use std::collections::BTreeMap;
use std::sync::Arc;

use descry_agent::body::Body;
use descry_domains::looking::perceive;
use descry_perception::View;
use descry_perception::merge::MergeOptions;
use descry_perception::nalgebra::{Isometry3, Point3};
use descry_perception::segment::SceneOptions;
use descry_robots::sim::world::LABEL_OBJECT;
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::truth::Truth;
use descry_robots::{Place, Pose2, Robot, SurfaceHint, Watch};

use crate::kinds::kind::runtime;

/// Radial offsets tried in turn where the footprint does not fit, metres.
const OUTWARDS_M: [f64; 6] = [0.0, 0.1, 0.2, -0.1, 0.3, 0.4];
/// Distance beyond the wall of a vessel from which a point belongs to the handle, metres.
const BEYOND_WALL_M: f64 = 0.003;

/// Views of one arrangement, with the true scene.
pub(super) struct Taken {
    /// Views, in the order in which they were taken.
    pub views: Vec<View>,
    /// True pose of the camera in the map frame, for each view.
    pub map_from_camera: Vec<Isometry3<f64>>,
    /// Pixels of the handle of each object in each view of an ideal camera; no entry for objects without a
    /// handle, nor for bodies other than the simulator.
    pub handles: BTreeMap<String, Vec<usize>>,
    /// True scene.
    pub truth: Truth,
    /// Options of merging and of segmentation, as in the agent.
    pub options: (MergeOptions, SceneOptions),
}

/// Body in an arranged scene, ready to take the views.
pub(super) struct Staged {
    body: Body,
    ideal: Option<Ideal>,
}

/// The simulator as an ideal camera, and the objects with a handle: number and name.
type Ideal = (Arc<SimRobot>, Vec<(usize, String)>);

impl Staged {
    /// Body of any kind that reports the ground truth, without an ideal camera.
    pub fn of(body: Body) -> Self {
        Self { body, ideal: None }
    }

    fn truth(&self) -> Result<Truth, String> {
        self.body.truth()?.ok_or_else(|| "the body does not say how everything really stands".into())
    }
}

/// Simulated body in the arrangement of a scene that a seed draws.
pub(super) fn simulated(spec: &SceneSpec, seed: u64) -> Result<Staged, String> {
    let scene = arrange(spec, seed).map_err(|e| e.to_string())?;
    let handled = (0..).zip(&scene.objects).filter(|(_, o)| has_handle(&o.shape));
    let handled = handled.map(|(i, o)| (i, o.name.clone())).collect();
    let robot = Arc::new(SimRobot::new(scene, SimOptions { seed, ..SimOptions::default() }));
    Ok(Staged { body: Body::simulated(Arc::clone(&robot)), ideal: Some((robot, handled)) })
}

/// Drives around the body's first surface and looks at its centre from every pose.
pub(super) fn take(staged: &Staged, poses: usize, distance_m: f64) -> Result<Taken, String> {
    let robot = &*staged.body.robot;
    let surface = robot.surfaces().first().cloned().ok_or("the scene has no surface to look at")?;
    let mut taken = Taken {
        views: Vec::new(),
        map_from_camera: Vec::new(),
        handles: BTreeMap::new(),
        truth: staged.truth()?,
        options: perceive::options(robot, None),
    };
    runtime()?.block_on(async {
        let watch = Watch::default();
        let middle = middle(&surface);
        for k in 0..poses {
            let place = place(robot, &middle, k, poses, distance_m).await?;
            robot.drive_to(&place, &watch).await.map_err(|e| e.to_string())?;
            robot.look_at(&middle, &watch).await.map_err(|e| e.to_string())?;
            let sensed = robot.sense(&watch).await.map_err(|e| e.to_string())?;
            let believed = robot.pose().await.map_err(|e| e.to_string())?.map_from_base;
            let truth = staged.truth()?;
            let map_from_camera = truth.base.isometry() * believed.inverse() * sensed.map_from_camera;
            for (simulator, (index, name)) in
                staged.ideal.iter().flat_map(|(s, of)| of.iter().map(move |h| (s, h)))
            {
                let pixels = handle_pixels(simulator, &truth, *index, &map_from_camera);
                taken.handles.entry(name.clone()).or_default().push(pixels);
            }
            taken.map_from_camera.push(map_from_camera);
            taken.views.push(sensed.view());
        }
        taken.truth = staged.truth()?;
        Ok(taken)
    })
}

fn has_handle(shape: &descry_robots::sim::shape::Shape) -> bool {
    matches!(shape, descry_robots::sim::shape::Shape::Mug(_))
}

fn middle(surface: &SurfaceHint) -> Point3<f64> {
    let n = surface.outline_m.len().max(1) as f64;
    let sum = surface.outline_m.iter().fold([0.0; 2], |[x, y], p| [x + p.x, y + p.y]);
    Point3::new(sum[0] / n, sum[1] / n, surface.height_m)
}

/// The k-th pose around the centre; the first is on the side of the start.
async fn place(
    robot: &dyn Robot,
    middle: &Point3<f64>,
    k: usize,
    poses: usize,
    distance_m: f64,
) -> Result<Place, String> {
    let here = robot.pose().await.map_err(|e| e.to_string())?.place();
    let angle = std::f64::consts::PI + std::f64::consts::TAU * k as f64 / poses as f64;
    let tries: Vec<Place> = OUTWARDS_M
        .iter()
        .map(|outwards_m| {
            let d = distance_m + outwards_m;
            Place::Pose(Pose2::facing(middle.x + d * angle.cos(), middle.y + d * angle.sin(), &middle.xy()))
        })
        .collect();
    let fits = robot.travel(&here, &tries, &[]).iter().position(Result::is_ok);
    fits.map(|n| tries[n].clone()).ok_or_else(|| format!("pose {} of {poses} cannot be reached", k + 1))
}

/// Pixels of an object's handle in the current frame of an ideal camera.
fn handle_pixels(robot: &SimRobot, truth: &Truth, index: usize, map_from_camera: &Isometry3<f64>) -> usize {
    let frame = robot.true_frame();
    let object = &truth.objects[index];
    let object_from_camera = object.map_from_object.inverse() * map_from_camera;
    let (c, radius_m) = (frame.intrinsics, object.size_m[1] / 2.0);
    let beyond = |(at, _): &(usize, &u16)| {
        let (u, v, z) = ((at % c.width) as f64, (at / c.width) as f64, f64::from(frame.depth_m[*at]));
        let p = object_from_camera * Point3::new((u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z);
        p.x > 0.0 && p.x.hypot(p.y) > radius_m + BEYOND_WALL_M
    };
    let label = LABEL_OBJECT + index as u16;
    frame.label.iter().enumerate().filter(|(_, l)| **l == label).filter(beyond).count()
}
