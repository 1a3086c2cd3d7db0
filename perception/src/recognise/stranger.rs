//! Objects of no known kind.

use super::descry::Family;
use super::ends::Side;
use super::evidence::Measured;
use super::likelihood::{STRANGER, diameter_sigma_m, inside};
use super::model::{ObjectModel, Shape};
use crate::scale::EDGE_M;

/// Log probability that an object of a family, as measured, is of no known kind.
pub(super) fn stranger_log(family: &Family, models: &[ObjectModel], m: &Measured) -> f64 {
    let known = models.iter().map(|model| covers(model, family, m)).fold(0.0, f64::max);
    (1.0 - known).max(STRANGER).ln()
}

/// Probability that an object of a family, as measured, is described by a model: same shape, upper
/// end and handle, and sizes within the model's ranges. A model with single values describes no
/// others.
fn covers(model: &ObjectModel, family: &Family, m: &Measured) -> f64 {
    let same_make =
        family.shape == Some(model.shape) && model.top == family.top && model.handle == family.handle;
    if !same_make || m.top_hidden {
        return 0.0;
    }
    let wide = match (model.shape, &m.sides) {
        (Shape::Round, _) => model
            .diameter_m
            .filter(|_| m.round.is_some())
            .map(|diameter| inside(2.0 * m.evidence.radius_m, diameter_sigma_m(m), diameter)),
        (Shape::Box, Some([a, b])) => model.width_m.zip(model.depth_m).map(|(width, depth)| {
            let both = |one: &Side, other: &Side| {
                inside(one.likeliest_m(), EDGE_M, width) * inside(other.likeliest_m(), EDGE_M, depth)
            };
            both(a, b).max(both(b, a))
        }),
        (Shape::Box, None) => None,
    };
    wide.map_or(0.0, |wide| wide * inside(m.height_m, m.height_sigma_m, model.height_m))
}
