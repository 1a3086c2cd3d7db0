//! Where a seen surface lies on the map: localisation against the outline of a known table.
//!
//! Localisation errs by centimetres and degrees, and so does a merged cloud as a whole. A table whose outline the map
//! knows tells by how much: the edges that were seen are laid on the edges of the outline.

use nalgebra::{
    Isometry2, Isometry3, Matrix3, Point2, Point3, Translation3, Unit, UnitQuaternion, Vector2, Vector3,
};

/// Length of an edge that gives one sample.
const BIN_M: f64 = 0.02;
/// A sample is where this many points lie farther out: single stray points do not count.
const STRAY: usize = 3;
/// A sample wants this many points within [`DEPTH_M`] behind it.
const FEWEST: usize = 8;
/// Noise throws points beyond an end, and edges lose some: where it is, is counted from the points of a strip so deep behind it
/// against those of the next strip inwards.
const DEPTH_M: f64 = 0.04;
/// Points so far below the surface, close to its end, are of the side of a board: they tell by themselves where it ends.
const BELOW_M: f64 = 0.004;
/// So many bins to either side are counted together.
const POOLED: usize = 2;
/// Shares of the inner strip's points that the outer may hold; otherwise an object stands there, or a shadow cuts in.
const SHARES: std::ops::Range<f64> = 0.5..1.3;
/// A camera must have looked past the places this far beyond a sample. Beside an object pixels are lost, and one place alone
/// would take the border of its shadow for the end of the surface.
const BEYOND_M: [f64; 3] = [0.03, 0.06, 0.09];
/// How far a sample may be off, round by round: what a view cuts off or an object hides lies farther in than the edge.
const GATES_M: [f64; 7] = [0.15, 0.12, 0.08, 0.05, 0.03, 0.02, 0.02];
/// Standard deviation of one sample; neighbours err together, which is why it is no millimetre.
const SAMPLE_SIGMA_M: f64 = 0.03;

/// How a surface was laid on its outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// What takes points of the cloud's frame to the map.
    pub map_from_world: Isometry3<f64>,
    /// Samples of seen edges that found an edge of the outline.
    pub matched: usize,
    /// Root mean square distance of those from the outline afterwards, metres; 0 without any.
    pub residual_m: f64,
}

/// Lays the seen points of a surface on the outline that the map has of it (in order around, metres).
///
/// `sigma_m` and `sigma_rad` say how well the cloud's place in the map is known before: where no edge tells otherwise, it
/// stays. Moves along the surface and turns about `up`; heights are left as they are. The surface ends only where `is_past`
/// says of a place (cloud's frame) just beyond the last points that a camera looked past it: elsewhere only the image ends.
pub fn locate(
    points: &[Point3<f64>],
    up: &Unit<Vector3<f64>>,
    outline: &[Point3<f64>],
    sigma_m: f64,
    sigma_rad: f64,
    is_past: impl Fn(&Point3<f64>) -> bool,
) -> Located {
    let mut located = Located { map_from_world: Isometry3::identity(), matched: 0, residual_m: 0.0 };
    if outline.len() < 3 {
        return located;
    }
    let frame = Frame::of(outline, up);
    let points: Vec<Seen> =
        points.iter().map(|p| Seen { at: frame.flat(p), height_m: frame.height_m(p) }).collect();
    let edges = edges(&outline.iter().map(|p| frame.flat(p)).collect::<Vec<_>>());
    let around: Vec<Vec<Seen>> = edges.iter().map(|edge| around(edge, &points).collect()).collect();
    let mut moved = Isometry2::identity();
    for gate_m in GATES_M {
        let is_end = |m: &Match| {
            let mut beyond = BEYOND_M.iter().map(|b| moved.inverse() * (m.at + m.normal * *b));
            beyond.all(|p| is_past(&(frame.origin + frame.right * p.x + frame.ahead * p.y)))
        };
        let matches: Vec<Match> = edges
            .iter()
            .zip(&around)
            .flat_map(|(edge, near)| samples(edge, near, &moved, gate_m))
            .filter(is_end)
            .collect();
        located.matched = matches.len();
        let square: f64 = matches.iter().map(|m| m.distance_m.powi(2)).sum();
        located.residual_m = if matches.is_empty() { 0.0 } else { (square / matches.len() as f64).sqrt() };
        moved = step(&matches, &moved, sigma_m.max(1e-6), sigma_rad.max(1e-6));
    }
    located.map_from_world = frame.lift(&moved);
    located
}

/// An edge of the outline.
struct Edge {
    from: Point2<f64>,
    along: Vector2<f64>,
    outward: Vector2<f64>,
    length_m: f64,
}

/// A seen point: where it lies in the plane of the outline, and how far above it.
#[derive(Clone, Copy)]
struct Seen {
    at: Point2<f64>,
    height_m: f64,
}

/// A sample with the edge of the outline that it lies on.
struct Match {
    /// The sample where the present estimate has it.
    at: Point2<f64>,
    normal: Vector2<f64>,
    /// Signed, along the normal.
    distance_m: f64,
}

/// The plane of the outline with its middle as origin.
struct Frame {
    origin: Point3<f64>,
    right: Vector3<f64>,
    ahead: Vector3<f64>,
    up: Unit<Vector3<f64>>,
}

impl Frame {
    fn of(outline: &[Point3<f64>], up: &Unit<Vector3<f64>>) -> Frame {
        let sum = outline.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
        let aside = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let right = (aside - up.into_inner() * up.dot(&aside)).normalize();
        Frame { origin: Point3::from(sum / outline.len() as f64), right, ahead: up.cross(&right), up: *up }
    }

    fn flat(&self, p: &Point3<f64>) -> Point2<f64> {
        let d = p - self.origin;
        Point2::new(self.right.dot(&d), self.ahead.dot(&d))
    }

    fn height_m(&self, p: &Point3<f64>) -> f64 {
        self.up.dot(&(p - self.origin))
    }

    /// A motion in the plane as one in space.
    fn lift(&self, moved: &Isometry2<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&self.up, moved.rotation.angle());
        let shift = self.right * moved.translation.x + self.ahead * moved.translation.y;
        let origin = self.origin.coords;
        Isometry3::from_parts(Translation3::from(origin + shift - turn * origin), turn)
    }
}

fn edges(outline: &[Point2<f64>]) -> Vec<Edge> {
    let edge = |i: usize| {
        let from = outline[i];
        let way = outline[(i + 1) % outline.len()] - from;
        let along = way.try_normalize(1e-9)?;
        let across = Vector2::new(along.y, -along.x);
        // The origin is the middle of the outline, inside of every edge.
        let outward = if across.dot(&from.coords) >= 0.0 { across } else { -across };
        Some(Edge { from, along, outward, length_m: way.norm() })
    };
    (0..outline.len()).filter_map(edge).collect()
}

/// Points that can come near an edge while the estimate moves: those that now lie no farther from its line than twice the widest gate.
fn around<'a>(edge: &'a Edge, points: &'a [Seen]) -> impl Iterator<Item = Seen> + 'a {
    let reach_m = 2.0 * (GATES_M[0] + DEPTH_M);
    points.iter().copied().filter(move |p| edge.outward.dot(&(p.at - edge.from)).abs() < reach_m)
}

/// Where the seen surface ends along an edge, a sample every [`BIN_M`].
fn samples(edge: &Edge, points: &[Seen], moved: &Isometry2<f64>, gate_m: f64) -> Vec<Match> {
    let bins = (edge.length_m / BIN_M) as usize;
    let (turn, shift) = (moved.rotation.to_rotation_matrix(), moved.translation.vector - edge.from.coords);
    // How far out the points of each bin lie, and how high.
    let mut near: Vec<Vec<(f64, f64)>> = vec![Vec::new(); bins];
    for p in points {
        let d = turn * p.at.coords + shift;
        let (reach, out) = (edge.along.dot(&d), edge.outward.dot(&d));
        if reach < 0.0 || out >= gate_m || out <= -gate_m - 2.0 * DEPTH_M {
            continue;
        }
        if let Some(bin) = near.get_mut((reach / BIN_M) as usize) {
            bin.push((out, p.height_m));
        }
    }
    let strips: Vec<Option<Strips>> = near.iter_mut().map(|bin| Strips::of(bin)).collect();
    let ends = strips.iter().enumerate().filter_map(|(bin, own)| {
        let own = own.as_ref()?;
        let pooled = strips[bin.saturating_sub(POOLED)..(bin + POOLED + 1).min(bins)].iter().flatten();
        let (outer, inner) = pooled.fold((0, 0), |sum, s| (sum.0 + s.outer, sum.1 + s.inner));
        let share = outer as f64 / inner as f64;
        let counted_m = SHARES.contains(&share).then_some(own.reached_m + (share - 1.0) * DEPTH_M);
        let end = own.side_m.or(counted_m)?;
        let at = edge.from + edge.along * ((bin as f64 + 0.5) * BIN_M) + edge.outward * end;
        (end.abs() < gate_m).then_some(Match { at, normal: edge.outward, distance_m: end })
    });
    ends.collect()
}

/// What is behind the last points of a bin.
struct Strips {
    /// How far out the last points lie but for stray ones.
    reached_m: f64,
    /// Points of the surface in the outer strip and in the inner.
    outer: usize,
    inner: usize,
    /// Where the side of the board is, if it is seen.
    side_m: Option<f64>,
}

impl Strips {
    /// Of the points of a bin, how far out and how high each; none without points enough. Their order is lost.
    fn of(points: &mut [(f64, f64)]) -> Option<Strips> {
        if points.len() <= STRAY {
            return None;
        }
        let reached_m = points.select_nth_unstable_by(STRAY, |a, b| b.0.total_cmp(&a.0)).1.0;
        let strip = |p: &(f64, f64)| ((reached_m - p.0) / DEPTH_M).max(0.0) as usize;
        let behind = points.iter().filter(|p| strip(p) == 0).count();
        let mut inner: Vec<f64> = points.iter().filter(|p| strip(p) == 1).map(|p| p.1).collect();
        if inner.is_empty() || behind < FEWEST {
            return None;
        }
        let height_m = median(&mut inner);
        let is_low = |p: &(f64, f64)| p.1 < height_m - BELOW_M;
        let outer = points.iter().filter(|p| strip(p) == 0 && !is_low(p)).count();
        let is_side = |p: &&(f64, f64)| is_low(p) && p.0 > reached_m - DEPTH_M / 2.0;
        let mut side: Vec<f64> = points.iter().filter(is_side).map(|p| p.0).collect();
        let side_m = (side.len() >= FEWEST).then(|| median(&mut side));
        Some(Strips { reached_m, outer, inner: inner.len(), side_m })
    }
}

/// The upper one of the two in the middle, of at least one value.
fn median(values: &mut [f64]) -> f64 {
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

/// One Gauss-Newton step towards the edges, held by what was known before.
fn step(matches: &[Match], moved: &Isometry2<f64>, sigma_m: f64, sigma_rad: f64) -> Isometry2<f64> {
    let t = moved.translation.vector;
    let prior = Vector3::new(sigma_m.powi(-2), sigma_m.powi(-2), sigma_rad.powi(-2));
    let mut information = Matrix3::from_diagonal(&prior);
    let mut gradient = prior.component_mul(&Vector3::new(t.x, t.y, moved.rotation.angle()));
    for m in matches {
        let row = Vector3::new(m.normal.x, m.normal.y, m.normal.dot(&Vector2::new(-m.at.y, m.at.x)));
        information += row * row.transpose() * SAMPLE_SIGMA_M.powi(-2);
        gradient += row * m.distance_m * SAMPLE_SIGMA_M.powi(-2);
    }
    match information.try_inverse() {
        Some(inverse) => {
            let d = -(inverse * gradient);
            Isometry2::new(Vector2::new(d.x, d.y), d.z) * moved
        }
        None => *moved,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: [[f64; 2]; 4] = [[-0.8, -0.4], [0.8, -0.4], [0.8, 0.4], [-0.8, 0.4]];

    fn raised(points: &[[f64; 2]]) -> Vec<Point3<f64>> {
        points.iter().map(|p| Point3::new(p[0], p[1], 0.72)).collect()
    }

    /// Points of the table every 4 mm, where `seen` says so.
    fn points(seen: impl Fn(f64, f64) -> bool) -> Vec<Point3<f64>> {
        let grid = (-200..=200)
            .flat_map(|i| (-100..=100).map(move |j| [f64::from(i) * 0.004, f64::from(j) * 0.004]));
        raised(&grid.filter(|&[x, y]| seen(x, y)).collect::<Vec<_>>())
    }

    /// Moves the seen part of a table away and expects it back within the given distance at its middle.
    fn check(seen: impl Fn(f64, f64) -> bool, x_m: f64, y_m: f64, yaw_deg: f64, within_m: f64) {
        let truth = Isometry3::new(Vector3::new(x_m, y_m, 0.0), Vector3::z() * yaw_deg.to_radians());
        let seen: Vec<Point3<f64>> = points(seen).iter().map(|p| truth.inverse() * p).collect();
        let found = locate(&seen, &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05, |_| true);
        let middle = Point3::new(0.0, 0.0, 0.72);
        let off_m = (found.map_from_world * (truth.inverse() * middle) - middle).norm();
        assert!(off_m < within_m, "moved by {x_m}, {y_m}, {yaw_deg}: {off_m} m off, {found:?}");
    }

    #[test]
    fn a_table_comes_back_to_its_place() {
        check(|_, _| true, 0.0, 0.0, 0.0, 0.002);
        check(|_, _| true, 0.04, -0.03, 2.0, 0.004);
        check(|_, _| true, -0.06, 0.05, -4.0, 0.006);
        let cut_corner = |x: f64, y: f64| x + y < 0.8;
        check(cut_corner, 0.04, -0.03, 2.0, 0.005);
        let cut_by_the_view = |x: f64, y: f64| x < 0.3 + 0.25 * y;
        check(cut_by_the_view, 0.04, -0.03, 2.0, 0.006);
        let hidden_behind_a_box = |x: f64, y: f64| !(x > -0.3 && x < 0.3 && y > 0.1);
        check(hidden_behind_a_box, -0.03, 0.04, -2.0, 0.005);
    }

    #[test]
    fn where_the_image_ends_the_table_goes_on() {
        let seen = points(|x, _| x > -0.4 && x < 0.72);
        let found = locate(&seen, &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05, |p| p.x < 0.7);
        let off_m = (found.map_from_world * Point3::origin()).coords.norm();
        assert!(off_m < 0.002, "{off_m} m off, {found:?}");
    }

    #[test]
    fn noise_and_the_side_of_the_board_do_not_move_an_end() {
        // Far along the view noise is wide, and the side below the near end is as dense as the surface is thin.
        let noise_m = |i: i32, j: i32| 0.012 * f64::from((i * 7919 + j * 104_729).rem_euclid(17) - 8) / 8.0;
        let mut seen: Vec<Point3<f64>> = (-200..=200)
            .flat_map(|i| (-100..=100).map(move |j| (i, j)))
            .map(|(i, j)| Point3::new(f64::from(i) * 0.004 + noise_m(i, j), f64::from(j) * 0.004, 0.72))
            .collect();
        let side = (-100..=100).flat_map(|j| (1..8).map(move |k| (j, k)));
        seen.extend(side.map(|(j, k)| {
            Point3::new(-0.8 + noise_m(j, k), f64::from(j) * 0.004, 0.72 - 0.0015 * f64::from(k))
        }));
        let seen_at = |left: bool, right: bool| {
            let is_past = |p: &Point3<f64>| if p.x < 0.0 { left } else { right };
            locate(&seen, &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05, is_past).map_from_world
        };
        for (left, right) in [(true, false), (false, true), (true, true)] {
            let off_m = (seen_at(left, right) * Point3::origin()).x.abs();
            assert!(off_m < 0.004, "ends seen: left {left}, right {right}: {off_m} m off");
        }
    }

    #[test]
    fn the_border_of_a_shadow_is_no_end() {
        // A box hides what is left of a slanting line; beside its shadow some pixels are lost.
        let border = |y: f64| -0.74 + 0.1 * y;
        let seen = points(|x, y| x > border(y) && x < 0.3);
        let is_past = |p: &Point3<f64>| p.x > border(p.y) - 0.05 && p.x < 0.25;
        let found = locate(&seen, &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05, is_past);
        let off_m = (found.map_from_world * Point3::origin()).coords.norm();
        assert!(off_m < 0.005, "{off_m} m off, {found:?}");
    }

    #[test]
    fn what_no_edge_tells_stays() {
        let inner = points(|x, y| x.abs() < 0.3 && y.abs() < 0.2);
        let found = locate(&inner, &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05, |_| true);
        assert_eq!((found.map_from_world.translation.vector.norm(), found.matched), (0.0, 0));
        let none = locate(&[], &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05, |_| true);
        assert_eq!((none.map_from_world, none.matched), (Isometry3::identity(), 0));
    }
}
