//! Numeric conditions that must hold throughout an interval while numbers change continuously (PDDL
//! 2.1, Fox and Long 2003, section 8.3). Truth at both ends does not imply truth in between.

use super::relation::Relation;

/// Minimum distance of a test point from the ends of the interval (0, 1); closer ones are due to
/// rounding.
const EDGE: f64 = 1e-9;

/// Test points in the open interval (0, 1): a numeric condition holds throughout if it holds at
/// each of these. They are the zeros and turning points of the comparisons, and a point between
/// each two neighbours.
///
/// `differences`: for each comparison, left minus right side at the beginning, in the middle and at
/// the end of the interval; each is taken to be a polynomial of degree at most two.
pub fn telling_parts(differences: impl IntoIterator<Item = [f64; 3]>) -> Vec<f64> {
    let mut turns: Vec<f64> = differences.into_iter().flat_map(turns).collect();
    turns.sort_by(f64::total_cmp);
    turns.dedup();
    let mut parts = Vec::with_capacity(2 * turns.len() + 1);
    let mut before = 0.0;
    for turn in turns {
        parts.extend([(before + turn) / 2.0, turn]);
        before = turn;
    }
    parts.push((before + 1.0) / 2.0);
    parts
}

/// Zeros and the turning point of a difference inside the interval (0, 1).
fn turns([first, middle, last]: [f64; 3]) -> Vec<f64> {
    // The parabola through three points: a·x² + b·x + first.
    let a = 2.0 * (first - 2.0 * middle + last);
    let b = last - first - a;
    let size = first.abs().max(middle.abs()).max(last.abs());
    let found = if a.abs() <= EDGE * size {
        vec![first / (first - last)]
    } else {
        let root = (b * b - 4.0 * a * first).max(0.0).sqrt();
        vec![(-b - root) / (2.0 * a), -b / (2.0 * a), (-b + root) / (2.0 * a)]
    };
    // Where it is nothing at an end, rounding may let it be so shortly before.
    let ends = [(first, b), (last, 2.0 * a + b)].map(|(own, slope)| is_nothing(own).then_some(slope));
    let at_an_end = |part: f64| {
        let near = |slope: Option<f64>, apart: f64| slope.is_some_and(|slope| is_nothing(slope * apart));
        near(ends[0], part) || near(ends[1], 1.0 - part)
    };
    found.into_iter().filter(|&part| part > EDGE && part < 1.0 - EDGE && !at_an_end(part)).collect()
}

fn is_nothing(difference: f64) -> bool {
    Relation::Equal.holds(difference, 0.0)
}
