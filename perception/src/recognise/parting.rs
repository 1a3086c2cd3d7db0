//! Comparison of one body with two as explanations of the pixels around a segment.

use super::body::{Body, Cuboid, Frustum, Ray};
use super::evidence::Measured;
use super::rays::{BAD_VIEW, Rays, bounded};
use super::verify::{MERGED, WALL_M, placed};
use crate::pool;

/// Form of a part of a segment.
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

/// Two bodies; a ray hits the nearer.
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

/// Measures of an upright object, with the heights of its foot and its upper end, metres.
#[derive(Clone, Copy)]
pub(super) struct Standing<'a> {
    pub measured: &'a Measured,
    pub base_m: f64,
    pub top_m: f64,
}

impl<'a> Standing<'a> {
    /// Object of the measured height whose foot is at `base_m`.
    pub fn at(measured: &'a Measured, base_m: f64) -> Standing<'a> {
        Standing { measured, base_m, top_m: base_m + measured.height_m }
    }

    /// Round body from the measures, open with walls of `wall_m` or closed; `None` if no circle
    /// fits.
    fn round(&self, wall_m: Option<f64>) -> Option<Form> {
        let round = self.measured.round?;
        Some(Form::Round(Frustum { wall_m, ..Frustum::around(&round, self.base_m, self.top_m) }))
    }

    /// Box from the measures.
    fn cuboid(&self) -> Form {
        let rectangle = self.measured.rectangle.unwrap_or(self.measured.footprint);
        Form::Box(Cuboid::around(&rectangle, self.base_m, self.top_m))
    }

    /// Candidate forms: round body if a circle fits, and box.
    fn forms(&self) -> Vec<Form> {
        let wall_m = (self.measured.upper.open_log > 0.0).then_some(WALL_M);
        self.round(wall_m).into_iter().chain([self.cuboid()]).collect()
    }
}

/// Two objects: a body that stands on or in a holder.
#[derive(Clone, Copy)]
pub(super) struct Held<'a> {
    pub body: Standing<'a>,
    pub holder: Standing<'a>,
    /// True if the body stands on the bottom of an open holder; otherwise the holder ends at the
    /// body's foot.
    pub is_within: bool,
}

impl Held<'_> {
    /// Log likelihood of each view given the likeliest pair of body and holder.
    fn logs(&self, rays: &Rays) -> Vec<f64> {
        let holders: Vec<Form> = if self.is_within {
            self.holder.round(Some(WALL_M)).into_iter().collect()
        } else {
            let bearing = Standing { top_m: self.body.base_m, ..self.holder };
            bearing.round(None).into_iter().chain([bearing.cuboid()]).collect()
        };
        let bodies = self.body.forms();
        let pairs = bodies.iter().flat_map(|body| holders.iter().map(|holder| Pair(*body, *holder)));
        best(rays, &pairs.collect::<Vec<_>>())
    }
}

/// Log likelihood of each view given the likeliest of `bodies`, against no body; zeros if no body
/// is likelier than none.
fn best<B: Body + Sync>(rays: &Rays, bodies: &[B]) -> Vec<f64> {
    let of = |body: &B| pool::map(&rays.views, 1, |view| placed(view, body, [0.0; 2], MERGED).log);
    let none = vec![0.0; rays.views.len()];
    let total = |logs: &Vec<f64>| logs.iter().sum::<f64>();
    bodies.iter().map(of).chain([none]).max_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or_default()
}

/// Log likelihood ratio of explanation `with` against `without`, summed over the views; a view's
/// evidence against `with` is bounded.
fn likelier_log(with: &[f64], without: &[f64]) -> f64 {
    let of_view = |(with, without): (&f64, &f64)| match with - without {
        log if log < 0.0 => bounded(log, BAD_VIEW),
        log => log,
    };
    with.iter().zip(without).map(of_view).sum()
}

/// Log likelihood ratio of two objects, body and holder, against one whole object.
pub(super) fn parted_log(rays: &Rays, whole: Standing, held: Held) -> f64 {
    likelier_log(&held.logs(rays), &best(rays, &whole.forms()))
}

/// Log likelihood ratio of a body inside its holder against the body on top of it.
pub(super) fn within_log(rays: &Rays, within: Held, on: Held) -> f64 {
    likelier_log(&within.logs(rays), &on.logs(rays))
}
