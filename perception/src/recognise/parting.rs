//! Choice between one body and two for the pixels around a segment.

use super::body::{Body, Cuboid, Frustum, Ray};
use super::evidence::Measured;
use super::rays::{BAD_VIEW, Rays, bounded};
use super::verify::{MERGED, WALL_M, placed};
use crate::pool;

/// A body that a part of a segment may be.
#[derive(Clone, Copy)]
enum Form {
    Round(Frustum),
    Box(Cuboid),
}

impl Body for Form {
    fn depth_m(&self, ray: &Ray) -> f64 {
        match self {
            Form::Round(frustum) => frustum.depth_m(ray),
            Form::Box(cuboid) => cuboid.depth_m(ray),
        }
    }

    fn moved(&self, shift_m: [f64; 2]) -> Form {
        match self {
            Form::Round(frustum) => Form::Round(frustum.moved(shift_m)),
            Form::Box(cuboid) => Form::Box(cuboid.moved(shift_m)),
        }
    }
}

/// Two bodies, of which a ray meets the nearer.
#[derive(Clone, Copy)]
struct Pair(Form, Form);

impl Body for Pair {
    fn depth_m(&self, ray: &Ray) -> f64 {
        self.0.depth_m(ray).min(self.1.depth_m(ray))
    }

    fn moved(&self, shift_m: [f64; 2]) -> Pair {
        Pair(self.0.moved(shift_m), self.1.moved(shift_m))
    }
}

/// The bodies of a thing's own measures, which stands at a height.
fn forms(m: &Measured, base_m: f64) -> Vec<Form> {
    let top_m = base_m + m.height_m;
    let wall_m = (m.upper.open_log > 0.0).then_some(WALL_M);
    let round =
        m.round.map(|round| Form::Round(Frustum { wall_m, ..Frustum::around(&round, base_m, top_m) }));
    let rectangle = m.rectangle.unwrap_or(m.footprint);
    round.into_iter().chain([Form::Box(Cuboid::around(&rectangle, base_m, top_m))]).collect()
}

/// Log likelihoods of the views given the likeliest of some bodies, against no body; that of no body if none is likelier.
fn best<B: Body + Sync>(rays: &Rays, bodies: &[B]) -> Vec<f64> {
    let of = |body: &B| pool::map(&rays.views, 1, |view| placed(view, body, [0.0; 2], MERGED).log);
    let none = vec![0.0; rays.views.len()];
    let total = |logs: &Vec<f64>| logs.iter().sum::<f64>();
    bodies.iter().map(of).chain([none]).max_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or_default()
}

/// Log of how much likelier two parts of a thing, each with the height that it stands at, make the views than the thing in one
/// piece does; no view counts against them for more than it may be a bad one.
pub(super) fn parted_log(rays: &Rays, whole: (&Measured, f64), [one, other]: [(&Measured, f64); 2]) -> f64 {
    let single = best(rays, &forms(whole.0, whole.1));
    let [ones, others] = [one, other].map(|(m, base_m)| forms(m, base_m));
    let pairs = ones.iter().flat_map(|one| others.iter().map(|other| Pair(*one, *other)));
    let parted = best(rays, &pairs.collect::<Vec<_>>());
    let of_view = |(with, without): (&f64, &f64)| match with - without {
        log if log < 0.0 => bounded(log, BAD_VIEW),
        log => log,
    };
    parted.iter().zip(&single).map(of_view).sum()
}
