//! Alternative to a pillar: a post with four sides.

use super::{Column, mean_m2};
use nalgebra::{Point2, Rotation2, Vector2};
use std::f64::consts::FRAC_PI_2;

/// Number of rotations tried within a quarter turn.
const TURNS: usize = 22;
/// Number of iterations that fit the four sides.
const ROUNDS: usize = 5;
/// Maximum distance from a side at which a column still attracts the side, in tolerances.
const PULLS: f64 = 1.5;

/// A column in the frame of the post.
struct Local<'a> {
    of: &'a Column,
    at: Point2<f64>,
    towards: Vector2<f64>,
}

/// Mean squared distance of columns from the best-fitting post, square metres; each distance is limited to the
/// tolerance.
pub(super) fn misses_m2(columns: &[Column], tolerance_m: f64) -> f64 {
    let turned = |k: usize| {
        let turn = Rotation2::new(-FRAC_PI_2 * k as f64 / TURNS as f64);
        let local = |of| Local { of, at: turn * of.at, towards: turn * of.towards };
        upright_m2(&columns.iter().map(local).collect::<Vec<_>>(), tolerance_m)
    };
    (0..TURNS).map(turned).fold(f64::INFINITY, f64::min)
}

/// Mean squared distance of columns from the best axis-parallel post, square metres.
fn upright_m2(columns: &[Local], tolerance_m: f64) -> f64 {
    let end = |axis: usize, share: f64| {
        let mut values: Vec<f64> = columns.iter().map(|c| c.at[axis]).collect();
        values.sort_by(f64::total_cmp);
        values.get((share * (values.len() as f64 - 1.0)).round() as usize).copied().unwrap_or(0.0)
    };
    // Left, right, lower, upper.
    let mut sides = [end(0, 0.05), end(0, 0.95), end(1, 0.05), end(1, 0.95)];
    for _ in 0..ROUNDS {
        let mut sums = [(0.0, 0.0); 4];
        for column in columns {
            let (side, miss_m) = nearest(column, &sides);
            if miss_m < PULLS * tolerance_m {
                let weight = f64::from(column.of.levels);
                sums[side] = (sums[side].0 + weight * column.at[side / 2], sums[side].1 + weight);
            }
        }
        for (side, (sum, weight)) in sides.iter_mut().zip(sums).filter(|(_, (_, weight))| *weight > 0.0) {
            *side = sum / weight;
        }
    }
    mean_m2(columns.iter().map(|c| (c.of, from_post_m(c, &sides))), tolerance_m)
}

/// Index of the nearest side of the post that faces the camera (0 left, 1 right, 2 lower, 3 upper), and the column's
/// distance to that side, metres; infinite if no side faces the camera.
fn nearest(column: &Local, sides: &[f64; 4]) -> (usize, f64) {
    let away_m = |side: usize| {
        let outward =
            if side.is_multiple_of(2) { -column.towards[side / 2] } else { column.towards[side / 2] };
        if outward > 0.0 { (column.at[side / 2] - sides[side]).abs() } else { f64::INFINITY }
    };
    (0..4).map(|side| (side, away_m(side))).fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a })
}

/// Distance of a column from a post, metres; measured from the corner if the column lies beyond one.
fn from_post_m(column: &Local, sides: &[f64; 4]) -> f64 {
    let [left, right, low, high] = *sides;
    let beyond = |c: f64, from: f64, to: f64| (from - c).max(c - to).max(0.0);
    let (dx, dy) = (beyond(column.at.x, left, right), beyond(column.at.y, low, high));
    if dx > 0.0 && dy > 0.0 { dx.hypot(dy) } else { nearest(column, sides).1 }
}
