//! Checks of outlines from files and programs.

use nalgebra::Point2;

/// Maximum width of a surface, metres; a wider outline is in other units.
pub(crate) const WIDEST_SURFACE_M: f64 = 30.0;
/// Maximum width of a room, metres.
pub(crate) const WIDEST_ROOM_M: f64 = 300.0;
/// Maximum height of a surface above or below the map's origin, metres.
const HIGHEST_M: f64 = 100.0;
/// Minimum area of an outline, square metres: less than the footprint of any object.
const LEAST_AREA_M2: f64 = 1e-4;
/// Maximum number of corners of an outline, since every pair of edges is compared.
const MOST_CORNERS: usize = 1000;

/// Description of a fault, and of the expected form.
pub(crate) type Fault = (String, &'static str);

/// Checks an outline, given by its corners in order, metres.
///
/// # Errors
/// If it is malformed, wider than `widest_m`, without area, or crosses itself.
pub(crate) fn check(corners: &[Point2<f64>], widest_m: f64) -> Result<(), Fault> {
    const CORNERS: &str = "at least three corners, [x, y] in metres";
    if corners.len() < 3 || corners.iter().any(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return Err(("it has no outline".into(), CORNERS));
    }
    if corners.len() > MOST_CORNERS {
        let problem = format!("its outline has {} corners, expected {MOST_CORNERS} at most", corners.len());
        return Err((problem, "leave out corners that change nothing"));
    }
    let (low, high) = corners.iter().fold((corners[0], corners[0]), |(l, h), p| (l.inf(p), h.sup(p)));
    let wide_m = (high - low).max();
    if wide_m > widest_m {
        let problem = format!("its outline is {wide_m} m wide, expected {widest_m} m at most");
        return Err((problem, "write the corners in metres, not in millimetres"));
    }
    if let Some((a, b)) = crossing(corners) {
        let problem = format!("its outline crosses itself: the edges after corner {a} and corner {b}");
        return Err((problem, "write the corners in their order around it"));
    }
    let area_m2 = area(corners);
    if area_m2 < LEAST_AREA_M2 {
        let problem = format!("its outline has an area of {area_m2} m2: the corners lie in one line");
        return Err((problem, CORNERS));
    }
    Ok(())
}

/// Checks the height of a surface, metres.
///
/// # Errors
/// If the height is not finite or implausible.
pub(crate) fn check_height(height_m: f64) -> Result<(), Fault> {
    if height_m.is_finite() && height_m.abs() <= HIGHEST_M {
        return Ok(());
    }
    let problem = format!("found {height_m}, expected a height within {HIGHEST_M} m");
    Err((problem, "metres along the map's z, not millimetres"))
}

fn area(corners: &[Point2<f64>]) -> f64 {
    let from = corners[0];
    let doubled: f64 = corners.windows(2).map(|w| (w[0] - from).perp(&(w[1] - from))).sum();
    doubled.abs() / 2.0
}

/// First two edges that cross, each by the number of its first corner, from 1; `None` if no edges cross.
fn crossing(corners: &[Point2<f64>]) -> Option<(usize, usize)> {
    let n = corners.len();
    let edge = |i: usize| (corners[i], corners[(i + 1) % n]);
    let parted = |(a, b): (Point2<f64>, Point2<f64>), (p, q): (Point2<f64>, Point2<f64>)| {
        (b - a).perp(&(p - a)) * (b - a).perp(&(q - a)) < 0.0
    };
    let pairs = (0..n).flat_map(|i| (i + 2..n).map(move |k| (i, k)));
    let mut crossing = pairs.filter(|&(i, k)| parted(edge(i), edge(k)) && parted(edge(k), edge(i)));
    crossing.next().map(|(i, k)| (i + 1, k + 1))
}
