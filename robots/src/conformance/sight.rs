//! Conformance of bodies with surfaces in their map: the camera must see the surfaces where the map has them.

use super::{Breach, done, ensure};
use crate::body::{Place, Pose2, Robot, Sensed, SurfaceHint, Watch};
use descry_perception::View;
use descry_perception::consistency::{MapSurface, judge};
use nalgebra::{Isometry3, Point2, Point3, Vector2};
use std::f64::consts::TAU;

/// Maximum number of viewpoints for a surface.
const PLACES: usize = 4;
/// Distances of candidate viewpoints from a surface's centre, metres.
const AWAY_M: [f64; 3] = [1.4, 1.7, 2.0];
/// Number of directions of candidate viewpoints.
const DIRECTIONS: usize = 8;
/// Number of steps along an edge of a surface, and from the edge to the surface's centre, between which
/// sample points lie.
const GRID: usize = 12;
/// Depth beyond a point of the surface, metres, from which a view counts as looking past the surface; the
/// uncertainty of the camera pose is added.
const FARTHER_M: f64 = 0.05;
/// Standard deviations of the camera pose that are added to [`FARTHER_M`].
const SIGMAS: f64 = 3.0;
/// Minimum number of sample points at which the views show the surface, or something behind it.
const FEWEST: usize = 20;
/// Minimum share of the sample points counted for [`FEWEST`] at which the views show the surface itself.
const LEAST_SHARE: f64 = 0.5;

const PROMISE: &str = "the camera shows the surfaces of the map where they are";

/// Checks the first surface that the body can look at, from several places and towards its corners: a
/// mirrored, scaled or upside-down image shows the surface elsewhere.
pub(super) async fn check_sight(robot: &dyn Robot) -> Result<(), Breach> {
    if robot.description().camera.is_none() {
        return Ok(());
    }
    for surface in robot.surfaces() {
        let places = places(robot, surface).await?;
        if !places.is_empty() {
            let looks = looks(robot, surface, &places).await?;
            return check_looks(robot, surface, &looks);
        }
    }
    Ok(())
}

/// Places from which the body can look at a surface: the current place without a base, else stations, or
/// poses around the surface; at most [`PLACES`].
async fn places(robot: &dyn Robot, surface: &SurfaceHint) -> Result<Vec<Place>, Breach> {
    let here = done(robot.pose().await, "a body knows where it is")?.place();
    if robot.description().base.is_none() {
        return Ok(vec![here]);
    }
    let spread = |all: Vec<Place>| {
        let step = all.len().div_ceil(PLACES).max(1);
        all.into_iter().step_by(step).collect()
    };
    if let Some(stations) = robot.stations() {
        return Ok(spread(stations.iter().map(|s| Place::Station(s.name.clone())).collect()));
    }
    let middle = middle(surface);
    let around = |n: usize| {
        let angle = TAU * n as f64 / DIRECTIONS as f64;
        AWAY_M.map(|away_m| {
            let at = middle + Vector2::new(angle.cos(), angle.sin()) * away_m;
            Place::Pose(Pose2::facing(at.x, at.y, &middle))
        })
    };
    let reachable = |n: usize| {
        let tries = around(n);
        let at = robot.travel(&here, &tries, &[]).iter().position(Result::is_ok)?;
        tries.get(at).cloned()
    };
    Ok(spread((0..DIRECTIONS).filter_map(reachable).collect()))
}

fn middle(surface: &SurfaceHint) -> Point2<f64> {
    let sum = surface.outline_m.iter().fold(Vector2::zeros(), |sum, p| sum + p.coords);
    Point2::from(sum / surface.outline_m.len().max(1) as f64)
}

/// Takes a frame from each place, with the camera turned to the corners of the surface in turn.
async fn looks(robot: &dyn Robot, surface: &SurfaceHint, places: &[Place]) -> Result<Vec<Sensed>, Breach> {
    let watch = Watch::default();
    let mut looks = Vec::new();
    for (place, corner) in places.iter().zip(surface.outline_m.iter().cycle()) {
        if done(robot.pose().await, "a body knows where it is")?.place() != *place {
            done(robot.drive_to(place, &watch).await, "a body drives where a route leads")?;
        }
        let at = Point3::new(corner.x, corner.y, surface.height_m);
        done(robot.look_at(&at, &watch).await, "a body can be told where to look")?;
        looks.push(done(robot.sense(&watch).await, "a body takes frames")?);
    }
    Ok(looks)
}

fn check_looks(robot: &dyn Robot, surface: &SurfaceHint, looks: &[Sensed]) -> Result<(), Breach> {
    let (there, through) =
        looks.iter().map(|look| shown(surface, look)).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let map: Vec<MapSurface> = robot
        .surfaces()
        .iter()
        .map(|s| MapSurface { outline_m: s.outline_m.clone(), height_m: s.height_m })
        .collect();
    let views: Vec<(View, Isometry3<f64>)> =
        looks.iter().map(|look| (view(look), look.map_from_camera)).collect();
    let stated: Vec<(&View, Isometry3<f64>)> = views.iter().map(|(view, pose)| (view, *pose)).collect();
    let asked = robot.surfaces().iter().position(|s| s.name == surface.name).unwrap_or_default();
    let inconsistency = judge(&stated, &map, asked, &[]).inconsistency;
    ensure(inconsistency.is_none(), PROMISE, || {
        let fault = inconsistency.map(|i| i.fault.to_string()).unwrap_or_default();
        format!("{} looks at the {} say that {fault}", looks.len(), surface.name)
    })?;
    let told = there + through;
    ensure(told >= FEWEST, PROMISE, || {
        format!(
            "{} looks at the {} return next to nothing where the map has it: is the camera covered, or the surface black or of glass?",
            looks.len(),
            surface.name
        )
    })?;
    ensure(there as f64 >= LEAST_SHARE * told as f64, PROMISE, || {
        format!(
            "looks go past the {} at {through} of {told} points where the map has it: is the image upside down, or depth in another unit?",
            surface.name
        )
    })
}

fn view(look: &Sensed) -> View {
    View {
        stamp_ns: look.stamp_ns,
        cloud: look.cloud.clone(),
        intrinsics: Some(look.intrinsics),
        world_from_camera: look.map_from_camera,
        pose_sigma_m: look.pose_sigma_m,
        pose_sigma_rad: look.pose_sigma_rad,
    }
}

/// Numbers of sample points within a surface's outline at which a frame shows the surface, and at which it
/// shows something behind the surface. Points where something in front is seen do not count.
fn shown(surface: &SurfaceHint, look: &Sensed) -> (usize, usize) {
    let middle = middle(surface);
    let (mut there, mut through) = (0, 0);
    let corners = surface.outline_m.iter().zip(surface.outline_m.iter().cycle().skip(1));
    for (a, b) in corners {
        for (along, inwards) in (1..GRID).flat_map(|i| (1..GRID).map(move |j| (i, j))) {
            let [along, inwards] = [along, inwards].map(|share| share as f64 / GRID as f64);
            let edge = a + (b - a) * along;
            let p = edge + (middle - edge) * inwards;
            let seen = look.map_from_camera.inverse_transform_point(&Point3::new(p.x, p.y, surface.height_m));
            let pixel = look.intrinsics.project(&seen).and_then(|(u, v)| look.intrinsics.pixel(u, v));
            let Some(depth_m) = pixel.and_then(|pixel| look.depth_m.get(pixel)).filter(|d| d.is_finite())
            else {
                continue;
            };
            let give_m = FARTHER_M + SIGMAS * (look.pose_sigma_m + look.pose_sigma_rad * seen.z);
            match f64::from(*depth_m) - seen.z {
                off_m if off_m > give_m => through += 1,
                off_m if off_m > -give_m => there += 1,
                _ => {}
            }
        }
    }
    (there, through)
}
