//! Where a seen surface lies on the map: localisation against the outline of a known table.
//!
//! Localisation errs by centimetres and degrees, and so does a merged cloud as a whole. A table whose outline the map
//! knows tells by how much: the edges that were seen are laid on the edges of the outline.

use nalgebra::{Isometry2, Isometry3, Matrix3, Point2, Point3, Translation3, Unit, UnitQuaternion, Vector2, Vector3};

/// Distance between the samples of an edge.
const STEP_M: f64 = 0.01;
/// A seen edge must run within this angle of an edge of the outline: what cuts a view off seldom does.
const PARALLEL_RAD: f64 = 0.17;
/// How far a seen edge may be off, round by round.
const GATES_M: [f64; 5] = [0.20, 0.15, 0.10, 0.06, 0.05];
/// Standard deviation of one sample; neighbours err together, which is why it is no millimetre.
const SAMPLE_SIGMA_M: f64 = 0.05;

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

/// Lays the hull of a seen surface on the outline that the map has of it (both in order around, metres).
///
/// `sigma_m` and `sigma_rad` say how well the cloud's place in the map is known before: where no edge tells otherwise, it
/// stays. Moves along the surface and turns about `up`; heights are left as they are.
pub fn locate(
    hull: &[Point3<f64>],
    up: &Unit<Vector3<f64>>,
    outline: &[Point3<f64>],
    sigma_m: f64,
    sigma_rad: f64,
) -> Located {
    let mut located = Located { map_from_world: Isometry3::identity(), matched: 0, residual_m: 0.0 };
    if hull.len() < 3 || outline.len() < 3 {
        return located;
    }
    let frame = Frame::of(outline, up);
    let [hull, outline] = [hull, outline].map(|points| points.iter().map(|p| frame.flat(p)).collect::<Vec<_>>());
    let samples = samples(&hull);
    let mut moved = Isometry2::identity();
    for gate_m in GATES_M {
        let matches: Vec<Match> = samples.iter().filter_map(|s| partner(s, &moved, &outline, gate_m)).collect();
        located.matched = matches.len();
        let square: f64 = matches.iter().map(|m| m.distance_m.powi(2)).sum();
        located.residual_m = if matches.is_empty() { 0.0 } else { (square / matches.len() as f64).sqrt() };
        moved = step(&matches, &moved, sigma_m.max(1e-6), sigma_rad.max(1e-6));
    }
    located.map_from_world = frame.lift(&moved);
    located
}

/// A point of a seen edge with the edge's direction.
struct Sample {
    at: Point2<f64>,
    along: Vector2<f64>,
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

    /// A motion in the plane as one in space.
    fn lift(&self, moved: &Isometry2<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&self.up, moved.rotation.angle());
        let shift = self.right * moved.translation.x + self.ahead * moved.translation.y;
        let origin = self.origin.coords;
        Isometry3::from_parts(Translation3::from(origin + shift - turn * origin), turn)
    }
}

fn samples(hull: &[Point2<f64>]) -> Vec<Sample> {
    let mut samples = Vec::new();
    for (i, a) in hull.iter().enumerate() {
        let edge = hull[(i + 1) % hull.len()] - a;
        let Some(along) = edge.try_normalize(1e-9) else { continue };
        let steps = (edge.norm() / STEP_M) as usize;
        samples.extend((0..steps).map(|k| Sample { at: a + along * ((k as f64 + 0.5) * STEP_M), along }));
    }
    samples
}

/// The nearest edge of the outline that runs as the sample's edge does.
fn partner(sample: &Sample, moved: &Isometry2<f64>, outline: &[Point2<f64>], gate_m: f64) -> Option<Match> {
    let (at, along) = (moved * sample.at, moved * sample.along);
    let edges = outline.iter().enumerate().filter_map(|(i, a)| {
        let edge = outline[(i + 1) % outline.len()] - a;
        let direction = edge.try_normalize(1e-9)?;
        let (across, ahead) = (direction.perp(&along), direction.dot(&along));
        let reach = direction.dot(&(at - a));
        let normal = Vector2::new(-direction.y, direction.x);
        let distance_m = normal.dot(&(at - a));
        let fits = across.abs().atan2(ahead.abs()) < PARALLEL_RAD
            && (-gate_m..edge.norm() + gate_m).contains(&reach)
            && distance_m.abs() < gate_m;
        fits.then_some(Match { at, normal, distance_m })
    });
    edges.min_by(|a, b| a.distance_m.abs().total_cmp(&b.distance_m.abs()))
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

    /// Moves the seen part of a table away and expects it back within the given distance at its middle.
    fn check(seen: &[[f64; 2]], x_m: f64, y_m: f64, yaw_deg: f64, within_m: f64) {
        let truth = Isometry3::new(Vector3::new(x_m, y_m, 0.0), Vector3::z() * yaw_deg.to_radians());
        let hull: Vec<Point3<f64>> = raised(seen).iter().map(|p| truth.inverse() * p).collect();
        let found = locate(&hull, &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05);
        let middle = Point3::new(0.0, 0.0, 0.72);
        let off_m = (found.map_from_world * (truth.inverse() * middle) - middle).norm();
        assert!(off_m < within_m, "{seen:?} moved by {x_m}, {y_m}, {yaw_deg}: {off_m} m off, {found:?}");
    }

    #[test]
    fn a_table_comes_back_to_its_place() {
        check(&TABLE, 0.0, 0.0, 0.0, 1e-6);
        check(&TABLE, 0.04, -0.03, 2.0, 0.003);
        check(&TABLE, -0.06, 0.05, -4.0, 0.006);
        let cut_corner = [[-0.8, -0.4], [0.8, -0.4], [0.8, 0.1], [0.3, 0.4], [-0.8, 0.4]];
        check(&cut_corner, 0.04, -0.03, 2.0, 0.004);
        let cut_by_the_view = [[-0.8, -0.4], [0.2, -0.4], [0.4, 0.4], [-0.8, 0.4]];
        check(&cut_by_the_view, 0.04, -0.03, 2.0, 0.006);
    }

    #[test]
    fn what_no_edge_tells_stays() {
        let strip = [[-0.3, -0.4], [0.3, -0.4], [0.2, 0.0], [-0.2, 0.0]];
        let found = locate(&raised(&strip), &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05);
        assert!(found.map_from_world.translation.vector.norm() < 1e-3, "{found:?}");
        let none = locate(&[], &Vector3::z_axis(), &raised(&TABLE), 0.05, 0.05);
        assert_eq!((none.map_from_world, none.matched), (Isometry3::identity(), 0));
    }
}
