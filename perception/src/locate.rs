//! Where a seen surface lies on the map: localisation against the outline of a known table.
//!
//! Localisation errs by centimetres and degrees, and so does a merged cloud as a whole. A table whose outline the map
//! knows tells by how much: the ends that were seen are laid on the edges of the outline.

mod endings;

pub use endings::{Ending, endings};

use nalgebra::{
    Isometry2, Isometry3, Matrix2x3, Matrix3, Point2, Point3, SymmetricEigen, Translation3, Unit,
    UnitQuaternion, Vector2, Vector3,
};

/// Length of an edge that gives one sample.
const BIN_M: f64 = 0.02;
/// A sample wants this many endings.
const FEWEST: usize = 2;
/// How far a sample may be off, round by round: what a view cuts off or an object hides lies farther in than the edge.
const GATES_M: [f64; 7] = [0.15, 0.12, 0.08, 0.05, 0.03, 0.02, 0.02];
/// Standard deviation of one sample; neighbours err together, which is why it is no millimetre.
const SAMPLE_SIGMA_M: f64 = 0.03;
/// Where fewer samples than this tell where it ends on either side, a surface is laid by how far it was seen to reach.
const FEW: usize = 5;
/// Standard deviation of how far it was seen to reach, where that is from side to side, and most that it may fall short of it, metres.
const REACH_SIGMA_M: f64 = 0.01;
const SHORT_M: f64 = 0.10;

/// How a surface was laid on its outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// What takes points of the cloud's frame to the map.
    pub map_from_world: Isometry3<f64>,
    /// Samples of seen edges that found an edge of the outline.
    pub matched: usize,
    /// Root mean square distance of those from the outline afterwards, metres; 0 without any.
    pub residual_m: f64,
    /// How well that is known; none without an outline.
    pub certainty: Option<Certainty>,
}

/// How well it is known where a surface lies on the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certainty {
    frame: Frame,
    /// Of a shift along the two axes of the frame, square metres, and of a turn about its origin, square radians.
    covariance: Matrix3<f64>,
}

impl Certainty {
    /// The direction along the surface in which the place of a point is known worst, and its standard deviation that way, metres.
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

/// Lays the endings of a surface that were seen on the outline that the map has of it (in order around, metres), and between two sides
/// of which none was seen, what was seen of the surface, its `hull`, if that is hardly shorter: a board between uprights ends nowhere.
///
/// `sigma_m` and `sigma_rad` say how well the place in the map of what was seen is known before: where no ending tells otherwise,
/// it stays. Moves along the surface and turns about `up`; heights are left as they are.
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

/// An edge of the outline.
struct Edge {
    from: Point2<f64>,
    along: Vector2<f64>,
    outward: Vector2<f64>,
    length_m: f64,
}

/// An [`Ending`] in the plane of the outline.
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

    /// How far out it is from an edge, and half of how far it may be off, metres; none where it is no end on that edge's side.
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

/// A sample with the edge of the outline that it lies on.
struct Match {
    /// The sample where the present estimate has it.
    at: Point2<f64>,
    normal: Vector2<f64>,
    /// Signed, along the normal.
    distance_m: f64,
    variance_m2: f64,
}

/// The plane of the outline with its middle as origin.
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

/// Where the surface ends along the edges, a sample every [`BIN_M`]: the mean of the endings there that lie nearest to that edge.
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

/// What lies between two opposite sides of the outline of which none shows where it ends, and reaches nearly from one to the other: in the middle.
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

/// The cosine between the normals of two sides that lie opposite.
const OPPOSITE: f64 = -0.98;

/// Endings on a piece of an edge: how many, the sums of how far out they are and of half their widths.
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

/// One Gauss-Newton step towards the edges, held by what was known before, and the covariance of what it leads to.
fn step(
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;
    use crate::merge::{MergeOptions, merge};
    use crate::surface::{Region, SurfaceOptions, find_surface};
    use crate::view::View;

    const CAMERA: Intrinsics =
        Intrinsics { width: 320, height: 240, fx: 262.0, fy: 262.0, cx: 159.5, cy: 119.5 };
    /// A box: its low and its high corner.
    type Block = [[f64; 3]; 2];
    const BOARD: Block = [[-0.8, -0.4, 0.695], [0.8, 0.4, 0.72]];
    const FLOOR: Block = [[-9.0, -9.0, -0.1], [9.0, 9.0, 0.0]];

    /// What the camera makes worse.
    #[derive(Clone, Copy, Default)]
    struct Faults {
        /// Farthest that a depth is off, as a share of its square.
        noise: f64,
        /// Pixels lost to either side of a jump in depth, and to the right of one that falls away.
        lost: usize,
        shadow: usize,
    }

    fn outline() -> Vec<Point3<f64>> {
        let [low, high] = BOARD;
        let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
        corners.iter().map(|c| Point3::new(c[0], c[1], high[2])).collect()
    }

    /// How far along a ray the first of some blocks is; infinite without one.
    fn hit(blocks: &[Block], eye: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
        let each = blocks.iter().map(|[low, high]| {
            let (mut near, mut far) = (0.0_f64, f64::INFINITY);
            for i in 0..3 {
                let (a, b) = ((low[i] - eye[i]) / ray[i], (high[i] - eye[i]) / ray[i]);
                (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
            }
            if near <= far { near } else { f64::INFINITY }
        });
        each.fold(f64::INFINITY, f64::min)
    }

    /// What a camera sees that looks from one place at another.
    fn view(blocks: &[Block], eye: [f64; 3], at: [f64; 3], faults: Faults) -> View {
        let (eye, at) = (Point3::from(eye), Point3::from(at));
        let forward = (at - eye).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
        let turn = UnitQuaternion::from_matrix(&axes);
        let world_from_camera = Isometry3::from_parts(Translation3::from(eye.coords), turn);
        let (width, count) = (CAMERA.width, CAMERA.width * CAMERA.height);
        let ray = |pixel: usize| {
            turn * CAMERA.unproject((pixel % width) as f64, (pixel / width) as f64, 1.0).coords
        };
        let exact: Vec<f64> = (0..count).map(|pixel| hit(blocks, &eye, &ray(pixel))).collect();
        let noise = |pixel: usize| (pixel * 7919 % 8191) as f64 / 4095.0 - 1.0;
        let depths: Vec<f32> = (0..count)
            .map(|pixel| {
                let z = exact[pixel];
                let far =
                    |steps: isize, step: usize| exact.get(pixel.wrapping_add_signed(steps * step as isize));
                let jumps = |steps: isize, step: usize| far(steps, step).is_some_and(|f| (f - z).abs() > 0.1);
                let n = faults.lost as isize;
                let is_lost = (-n..=n).any(|k| jumps(k, 1) || jumps(k, width));
                let in_shadow = (1..=faults.shadow as isize).any(|k| far(-k, 1).is_some_and(|f| f + 0.1 < z));
                let noisy = z + faults.noise * z * z * noise(pixel);
                if is_lost && pixel % 2 == 0 || in_shadow { f32::NAN } else { noisy as f32 }
            })
            .collect();
        View {
            stamp_ns: 0,
            cloud: CAMERA.cloud_from_depth(&depths).unwrap_or_default(),
            intrinsics: Some(CAMERA),
            world_from_camera,
            pose_sigma_m: 0.03,
            pose_sigma_rad: 0.03,
        }
    }

    /// Lays a view of some blocks whose place is told wrongly on the board, and gives how far off its middle then is, metres.
    fn laid(view: &View, told_from_true: &Isometry3<f64>) -> (Vector3<f64>, Located) {
        let told = View { world_from_camera: told_from_true * view.world_from_camera, ..view.clone() };
        let up = Some(Vector3::z_axis());
        let found = merge(&[told], &MergeOptions { up, ..MergeOptions::default() }).unwrap();
        let region = Some(Region { corners: outline(), margin_m: 0.25 });
        let options =
            SurfaceOptions { up, region, height_band_m: Some((0.6, 0.8)), ..SurfaceOptions::default() };
        let surface = find_surface(&found.cloud, &found.visibility, &options).unwrap();
        let located =
            locate(&endings(&found.visibility, &surface), &surface.hull, &surface.up, &outline(), 0.05, 0.05);
        let middle = Point3::new(0.0, 0.0, BOARD[1][2]);
        (located.map_from_world * (told_from_true * middle) - middle, located)
    }

    /// Looks at the board with what else is there, its place told wrongly by so much, and expects it back within the given distance.
    fn check(others: &[Block], eye: [f64; 3], faults: Faults, within_m: f64) {
        let blocks = [others, &[BOARD, FLOOR]].concat();
        for (x_m, y_m, yaw_deg) in [(0.0, 0.0, 0.0), (0.04, -0.03, 2.0), (-0.06, 0.05, -4.0)] {
            let told = Isometry3::new(Vector3::new(x_m, y_m, 0.0), Vector3::z() * f64::to_radians(yaw_deg));
            let (off, located) = laid(&view(&blocks, eye, [0.0, 0.0, 0.72], faults), &told);
            let case = format!("from {eye:?}, told {x_m}, {y_m}, {yaw_deg}");
            assert!(off.xy().norm() < within_m, "{case}: {off:?} off, {located:?}");
        }
    }

    const BEFORE: [f64; 3] = [0.2, -1.6, 1.5];
    const BESIDE: [f64; 3] = [1.9, 0.5, 1.4];

    #[test]
    fn a_table_comes_back_to_its_place() {
        check(&[], BEFORE, Faults::default(), 0.006);
        check(&[], BESIDE, Faults::default(), 0.006);
        let on_a_corner = [[0.5, 0.1, 0.72], [0.9, 0.5, 1.0]];
        check(&[on_a_corner], BEFORE, Faults::default(), 0.006);
        let in_front = [[-0.3, -0.39, 0.72], [0.2, -0.2, 0.95]];
        check(&[in_front], BEFORE, Faults::default(), 0.006);
    }

    #[test]
    fn noise_and_what_an_edge_loses_do_not_move_an_end() {
        let faults = Faults { noise: 0.006, lost: 1, shadow: 0 };
        check(&[], BEFORE, faults, 0.006);
        check(&[], BESIDE, faults, 0.006);
        check(&[], BEFORE, Faults { shadow: 20, ..faults }, 0.01);
        check(&[], BESIDE, Faults { shadow: 20, ..faults }, 0.01);
    }

    #[test]
    fn the_border_of_a_shadow_is_no_end() {
        let hides_the_left_end = [[-0.78, -0.38, 0.72], [-0.5, -0.1, 1.2]];
        check(&[hides_the_left_end], [0.9, -1.2, 1.3], Faults { lost: 1, ..Faults::default() }, 0.006);
    }

    #[test]
    fn where_something_upright_stands_against_it_the_surface_does_not_end() {
        // Against the right end, and farther than the board is deep.
        let cupboard = [[0.8, -0.6, 0.0], [1.2, 0.6, 1.1]];
        check(&[cupboard], [-0.9, -1.4, 1.5], Faults { noise: 0.003, lost: 1, shadow: 0 }, 0.006);
    }

    #[test]
    fn a_board_between_uprights_lies_between_them() {
        let uprights = [[[-0.83, -0.4, 0.0], [-0.8, 0.4, 1.6]], [[0.8, -0.4, 0.0], [0.83, 0.4, 1.6]]];
        check(&uprights, [0.1, -1.6, 1.3], Faults { noise: 0.003, lost: 1, shadow: 0 }, 0.012);
        let box_at_an_end = [[-0.79, -0.39, 0.72], [-0.74, 0.39, 0.9]];
        let others = [uprights[0], uprights[1], box_at_an_end];
        check(&others, [0.1, -1.6, 1.3], Faults { noise: 0.003, lost: 1, shadow: 0 }, 0.04);
    }

    #[test]
    fn how_well_it_lies_is_known() {
        let along_m = |others: &[Block], eye, at| {
            let blocks = [others, &[BOARD, FLOOR]].concat();
            let (_, located) = laid(&view(&blocks, eye, at, Faults::default()), &Isometry3::identity());
            let (way, sigma_m) = located.certainty.unwrap().worst(&Point3::new(0.3, 0.0, 0.72));
            (way.x.abs(), sigma_m)
        };
        let (_, whole_m) = along_m(&[], BEFORE, [0.0, 0.0, 0.72]);
        assert!(whole_m < 0.01, "{whole_m}");
        // Of the right half no end is seen, and the left end is out of the picture.
        let cupboard = [[0.8, -0.6, 0.0], [1.2, 0.6, 1.1]];
        let (way, half_m) = along_m(&[cupboard], [0.4, -1.2, 1.2], [0.5, 0.0, 0.72]);
        assert!(way > 0.99 && (0.04..0.051).contains(&half_m), "{way} {half_m}");
    }

    #[test]
    fn what_no_end_tells_stays() {
        let near = view(&[BOARD, FLOOR], [0.0, -0.1, 1.3], [0.0, 0.0, 0.72], Faults::default());
        let (off, located) = laid(&near, &Isometry3::translation(0.03, 0.02, 0.0));
        let stays = (off - Vector3::new(0.03, 0.02, 0.0)).norm() < 1e-9;
        assert!(stays && located.matched == 0, "{off:?}, {located:?}");
        let none = locate(&[], &[], &Vector3::z_axis(), &outline(), 0.05, 0.05);
        assert_eq!((none.map_from_world, none.matched), (Isometry3::identity(), 0));
    }
}
