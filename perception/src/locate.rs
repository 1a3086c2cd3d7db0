//! Localisation of an observed surface on the map: alignment with the outline of a known table.
//!
//! Localisation errs by centimetres and degrees, and so does a merged cloud as a whole. A table whose outline is in the
//! map shows the error: the observed ends of the surface are aligned with the edges of the outline.

#[doc(hidden)]
pub mod endings;

pub use endings::{Ending, endings};

use nalgebra::{
    Isometry2, Isometry3, Matrix2x3, Matrix3, Point2, Point3, SymmetricEigen, Translation3, Unit,
    UnitQuaternion, Vector2, Vector3,
};

/// Length of outline edge that gives one sample, metres.
const BIN_M: f64 = 0.02;
/// Minimum number of endings that give a sample.
const FEWEST: usize = 2;
/// Maximum distance of an ending from its edge in each iteration, metres: where the view cuts the surface off or an
/// object hides its end, endings lie farther inside.
const GATES_M: [f64; 7] = [0.15, 0.12, 0.08, 0.05, 0.03, 0.02, 0.02];
/// Standard deviation of a sample, metres; centimetres, because neighbouring samples share their errors.
const SAMPLE_SIGMA_M: f64 = 0.03;
/// Minimum number of samples on each of two opposite sides; with fewer, the observed extent is used.
const FEW: usize = 5;
/// Standard deviation of centring the observed extent between opposite sides, metres.
const REACH_SIGMA_M: f64 = 0.01;
/// Maximum difference between the observed extent and the distance of opposite sides for it to be centred, metres.
const SHORT_M: f64 = 0.10;

/// Alignment of an observed surface with its outline in the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// Correction from the cloud's frame to the map.
    pub map_from_world: Isometry3<f64>,
    /// Number of samples of observed ends that match an edge of the outline.
    pub matched: usize,
    /// Root mean square distance of the samples from the aligned outline, metres; 0 without
    /// samples.
    pub residual_m: f64,
    /// Certainty of the alignment; `None` without an outline.
    pub certainty: Option<Certainty>,
}

/// Certainty of a surface's position and heading on the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certainty {
    frame: Frame,
    /// Covariance of shift along the frame's two axes (square metres) and rotation about its origin
    /// (square radians).
    covariance: Matrix3<f64>,
}

impl Certainty {
    /// Least certain direction in which a point may be shifted along the surface (unit vector), and the standard
    /// deviation of that shift, metres.
    pub fn worst(&self, at: &Point3<f64>) -> (Unit<Vector3<f64>>, f64) {
        let p = self.frame.flat(at);
        let moved = Matrix2x3::new(1.0, 0.0, -p.y, 0.0, 1.0, p.x);
        let of_place = SymmetricEigen::new(moved * self.covariance * moved.transpose());
        let n = of_place.eigenvalues.imax();
        let (way, variance) = (of_place.eigenvectors.column(n), of_place.eigenvalues[n]);
        let way = self.frame.right * way[0] + self.frame.ahead * way[1];
        (Unit::new_normalize(way), variance.max(0.0).sqrt())
    }
}

/// Aligns the observed ends of a surface with its outline in the map (corners in order, metres). Between opposite sides
/// without observed ends, the extent of `hull` is centred if it is hardly shorter: a board between uprights shows no
/// ends.
///
/// `sigma_m`, `sigma_rad`: prior standard deviations of the cloud's position and heading in the map; the prior holds
/// where no end says otherwise. The correction shifts along the surface and rotates about `up`; heights do not change.
pub fn locate(
    endings: &[Ending],
    hull: &[Point3<f64>],
    up: &Unit<Vector3<f64>>,
    outline: &[Point3<f64>],
    sigma_m: f64,
    sigma_rad: f64,
) -> Located {
    let mut located =
        Located { map_from_world: Isometry3::identity(), matched: 0, residual_m: 0.0, certainty: None };
    if outline.len() < 3 {
        return located;
    }
    let frame = Frame::of(outline, up);
    let ends: Vec<End> = endings.iter().map(|ending| End::of(ending, &frame)).collect();
    let edges = edges(&outline.iter().map(|p| frame.flat(p)).collect::<Vec<_>>());
    let hull: Vec<Point2<f64>> = hull.iter().map(|p| frame.flat(p)).collect();
    let mut moved = Isometry2::identity();
    for gate_m in GATES_M {
        let mut matches = samples(&edges, &ends, &moved, gate_m);
        located.matched = matches.len();
        let square: f64 = matches.iter().map(|m| m.distance_m.powi(2)).sum();
        located.residual_m = if matches.is_empty() { 0.0 } else { (square / matches.len() as f64).sqrt() };
        matches.extend(spans(&edges, &hull, &matches, &moved));
        let (stepped, covariance) = step(&matches, &moved, sigma_m.max(1e-6), sigma_rad.max(1e-6));
        moved = stepped;
        located.certainty = Some(Certainty { frame, covariance });
    }
    located.map_from_world = frame.lift(&moved);
    located
}

/// Edge of the outline.
struct Edge {
    from: Point2<f64>,
    along: Vector2<f64>,
    outward: Vector2<f64>,
    length_m: f64,
}

/// [`Ending`] projected onto the plane of the outline.
struct End {
    on: Point2<f64>,
    past: Point2<f64>,
    side: Option<Point2<f64>>,
    eye: Point2<f64>,
}

impl End {
    fn of(ending: &Ending, frame: &Frame) -> End {
        let side = ending.side.map(|side| frame.flat(&side));
        End { on: frame.flat(&ending.on), past: frame.flat(&ending.past), side, eye: frame.flat(&ending.eye) }
    }

    /// Distance of an ending beyond an edge (outward positive), and half its uncertainty, metres; `None` if the ending
    /// belongs to another side.
    fn beyond(&self, edge: &Edge, moved: &Isometry2<f64>) -> Option<(f64, f64)> {
        let out = |p: &Point2<f64>| edge.outward.dot(&(moved * p - edge.from));
        let (on, past) = (out(&self.on), out(&self.past));
        match self.side.as_ref().filter(|_| out(&self.eye) > on) {
            // A board shows its side to whoever stands before it.
            Some(side) => Some((out(side), 0.0)),
            None => (past > on).then_some(((on + past) / 2.0, (past - on) / 2.0)),
        }
    }
}

/// Sample matched with an edge of the outline.
pub struct Match {
    /// Position of the sample at the current correction.
    at: Point2<f64>,
    normal: Vector2<f64>,
    /// Signed distance of the sample from the edge along the normal, metres.
    distance_m: f64,
    variance_m2: f64,
}

/// Plane of the outline, with the outline's centre as origin.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// Motion in space that corresponds to a motion in the plane.
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

/// Samples of the surface's ends, at most one per [`BIN_M`] along each edge: the mean of the endings that belong to
/// this piece of the edge.
fn samples(edges: &[Edge], ends: &[End], moved: &Isometry2<f64>, gate_m: f64) -> Vec<Match> {
    let mut bins: Vec<Vec<Bin>> =
        edges.iter().map(|edge| vec![Bin::default(); (edge.length_m / BIN_M) as usize]).collect();
    for end in ends {
        let along = |edge: &Edge| edge.along.dot(&(moved * end.on - edge.from));
        let near = edges.iter().zip(&mut bins).filter_map(|(edge, bins)| {
            let (out_m, half_m) = end.beyond(edge, moved).filter(|(out_m, _)| out_m.abs() < gate_m)?;
            let reach_m = along(edge);
            let bin = if reach_m < 0.0 { None } else { bins.get_mut((reach_m / BIN_M) as usize) };
            bin.map(|bin| (bin, out_m, half_m))
        });
        if let Some((bin, out_m, half_m)) = near.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) {
            bin.count += 1;
            bin.out_m += out_m;
            bin.half_m += half_m;
        }
    }
    let each = edges.iter().zip(&bins).flat_map(|(edge, bins)| {
        let full = bins.iter().enumerate().filter(|(_, bin)| bin.count >= FEWEST);
        full.map(move |(n, bin)| bin.sample(edge, (n as f64 + 0.5) * BIN_M))
    });
    each.collect()
}

/// Matches between opposite sides of the outline without observed ends: an extent that nearly equals their distance is
/// centred.
fn spans(edges: &[Edge], hull: &[Point2<f64>], ends: &[Match], moved: &Isometry2<f64>) -> Vec<Match> {
    let is_open = |edge: &&Edge| ends.iter().filter(|m| m.normal == edge.outward).count() < FEW;
    let open: Vec<&Edge> = edges.iter().filter(is_open).collect();
    let reach =
        |edge: &Edge| hull.iter().map(|p| edge.outward.dot(&(moved * p - edge.from))).reduce(f64::max);
    let between = |a: &Edge, b: &Edge| {
        let (beyond_a, beyond_b) = (reach(a)?, reach(b)?);
        let short_m = -(beyond_a + beyond_b);
        (short_m.abs() < SHORT_M).then(|| Match {
            at: Point2::origin(),
            normal: a.outward,
            distance_m: (beyond_a - beyond_b) / 2.0,
            variance_m2: REACH_SIGMA_M.powi(2) + short_m.powi(2) / 12.0,
        })
    };
    let pairs = open.iter().enumerate().flat_map(|(n, a)| open[n + 1..].iter().map(move |b| (*a, *b)));
    let opposite = pairs.filter(|(a, b)| a.outward.dot(&b.outward) < OPPOSITE);
    opposite.filter_map(|(a, b)| between(a, b)).collect()
}

/// Maximum cosine between the normals of opposite sides.
const OPPOSITE: f64 = -0.98;

/// Endings along a piece of an edge: number, sum of outward distances, and sum of half uncertainties, metres.
#[derive(Clone, Default)]
struct Bin {
    count: usize,
    out_m: f64,
    half_m: f64,
}

impl Bin {
    fn sample(&self, edge: &Edge, reach_m: f64) -> Match {
        let (distance_m, half_m) = (self.out_m / self.count as f64, self.half_m / self.count as f64);
        let at = edge.from + edge.along * reach_m + edge.outward * distance_m;
        let variance_m2 = SAMPLE_SIGMA_M.powi(2) + half_m.powi(2) / 3.0;
        Match { at, normal: edge.outward, distance_m, variance_m2 }
    }
}

/// Pose after a Gauss-Newton step towards the edges and the prior, and its covariance.
pub fn step(
    matches: &[Match],
    moved: &Isometry2<f64>,
    sigma_m: f64,
    sigma_rad: f64,
) -> (Isometry2<f64>, Matrix3<f64>) {
    let t = moved.translation.vector;
    let prior = Vector3::new(sigma_m.powi(-2), sigma_m.powi(-2), sigma_rad.powi(-2));
    let mut information = Matrix3::from_diagonal(&prior);
    let mut gradient = prior.component_mul(&Vector3::new(t.x, t.y, moved.rotation.angle()));
    for m in matches {
        let row = Vector3::new(m.normal.x, m.normal.y, m.normal.dot(&Vector2::new(-m.at.y, m.at.x)));
        information += row * row.transpose() / m.variance_m2;
        gradient += row * m.distance_m / m.variance_m2;
    }
    match information.try_inverse() {
        Some(inverse) => {
            let d = -(inverse * gradient);
            (Isometry2::new(Vector2::new(d.x, d.y), d.z) * moved, inverse)
        }
        None => (*moved, Matrix3::from_diagonal(&prior.map(f64::recip))),
    }
}
