//! The rectangle that best explains the outline of an object seen from above.

use crate::segment::quantile;
use nalgebra::Point3;

/// An upright box in the surface's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rectangle {
    /// Middle, metres.
    pub x: f64,
    /// Middle, metres.
    pub y: f64,
    /// Longer and shorter side, metres.
    pub sides_m: [f64; 2],
    /// Root mean square distance of the side points from the nearest edge, metres.
    pub residual_m: f64,
}

/// Orientations tried over a quarter turn.
const TURNS: usize = 30;

/// Fits a rectangle to points by turning it: the extents bound nearly all points, the residual tells how well they keep to its edges.
pub(crate) fn fit(points: &[Point3<f64>]) -> Option<Rectangle> {
    if points.len() < 8 {
        return None;
    }
    let stride = (points.len() / 600).max(1);
    let used: Vec<[f64; 2]> = points.iter().step_by(stride).map(|p| [p.x, p.y]).collect();
    (0..TURNS)
        .map(|i| turned(&used, std::f64::consts::FRAC_PI_2 * i as f64 / TURNS as f64))
        .min_by(|a, b| a.residual_m.total_cmp(&b.residual_m))
}

fn turned(points: &[[f64; 2]], angle_rad: f64) -> Rectangle {
    let (sin, cos) = angle_rad.sin_cos();
    let mut us: Vec<f64> = points.iter().map(|p| cos * p[0] + sin * p[1]).collect();
    let mut vs: Vec<f64> = points.iter().map(|p| -sin * p[0] + cos * p[1]).collect();
    let pairs: Vec<(f64, f64)> = us.iter().copied().zip(vs.iter().copied()).collect();
    let ends = |values: &mut Vec<f64>| (quantile(values, 0.02), quantile(values, 0.98));
    let ((u0, u1), (v0, v1)) = (ends(&mut us), ends(&mut vs));
    let squares: f64 = pairs
        .iter()
        .map(|&(u, v)| {
            let edge = (u - u0).abs().min((u - u1).abs()).min((v - v0).abs()).min((v - v1).abs());
            edge * edge
        })
        .sum();
    let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
    let (a, b) = (u1 - u0, v1 - v0);
    Rectangle {
        x: cos * u - sin * v,
        y: sin * u + cos * v,
        sides_m: [a.max(b), a.min(b)],
        residual_m: (squares / pairs.len() as f64).sqrt(),
    }
}

/// Sides of the rectangle of least area around nearly all points (longer, shorter), and its middle.
pub(crate) fn bounding(points: &[Point3<f64>]) -> Option<([f64; 2], [f64; 2])> {
    if points.is_empty() {
        return None;
    }
    let stride = (points.len() / 600).max(1);
    let used: Vec<[f64; 2]> = points.iter().step_by(stride).map(|p| [p.x, p.y]).collect();
    let least = (0..TURNS)
        .map(|i| turned(&used, std::f64::consts::FRAC_PI_2 * i as f64 / TURNS as f64))
        .min_by(|a, b| (a.sides_m[0] * a.sides_m[1]).total_cmp(&(b.sides_m[0] * b.sides_m[1])))?;
    Some((least.sides_m, [least.x, least.y]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sides_of_a_box_are_a_rectangle() {
        let edge = |i: i32| f64::from(i) / 100.0;
        let turn = |x: f64, y: f64| Point3::new(0.8 * x - 0.6 * y + 1.0, 0.6 * x + 0.8 * y, 0.05);
        let points: Vec<_> =
            (0..100).flat_map(|i| [turn(0.12 * edge(i), 0.0), turn(0.0, 0.07 * edge(i))]).collect();
        let found = fit(&points);
        let close = found.is_some_and(|r| {
            (r.sides_m[0] - 0.12).abs() < 0.008 && (r.sides_m[1] - 0.07).abs() < 0.008 && r.residual_m < 0.003
        });
        assert!(close, "{found:?}");
    }
}
