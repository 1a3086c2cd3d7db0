//! Shared length scales: accuracy of positions, edges and shapes in merged views.

/// Position accuracy in merged views, metres: closer points count as one place. From: chosen, what is left of poses
/// that err by centimetres; most uses bear half of it and twice as much.
pub(crate) const PLACE_M: f64 = 0.008;
/// Distance from which two positions are distinct, whatever their errors, metres. From: derived,
/// two of them.
pub const APART_M: f64 = 2.0 * PLACE_M;
/// Accuracy of an edge or an end, metres. From: derived, half of a place.
pub const EDGE_M: f64 = 0.5 * PLACE_M;
/// Deviation of real objects from the ideal forms, metres. From: derived, half of an edge.
pub(crate) const SHAPE_M: f64 = 0.5 * EDGE_M;
/// Number of standard deviations beyond which a deviation is more than noise. From: chosen.
pub(crate) const SPREADS: f64 = 3.0;
/// Minimum and maximum distance that a handle reaches from the body, metres. From: chosen.
pub(crate) const HANDLE_M: (f64, f64) = (0.014, 0.06);
/// Maximum width of a handle, metres. From: chosen.
pub(crate) const HANDLE_WIDTH_M: f64 = 0.035;

/// Floor as an integer; [`f64::floor`] is a function call on some processors.
#[inline(always)]
pub(crate) fn floor(value: f64) -> i32 {
    let whole = value as i32;
    whole.saturating_sub(i32::from(value < f64::from(whole)))
}
