//! Rectangle that best explains the outline of an object seen from above.

use nalgebra::Point3;

/// Rectangle in the horizontal plane of the surface's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// x of the centre, metres.
    pub x: f64,
    /// y of the centre, metres.
    pub y: f64,
    /// Longer and shorter side, metres.
    pub sides_m: [f64; 2],
    /// Sine and cosine of the rectangle's rotation.
    pub turn: (f64, f64),
    /// Sides along the rotated x axis and the rotated y axis, metres.
    pub along_m: [f64; 2],
    /// Root mean square distance of the points from the nearest edge, metres.
    pub residual_m: f64,
}

impl Rectangle {
    /// Empty rectangle, for no points. From: mark.
    pub const NONE: Rectangle =
        Rectangle { x: 0.0, y: 0.0, sides_m: [0.0; 2], turn: (0.0, 1.0), along_m: [0.0; 2], residual_m: 0.0 };
}

/// Number of orientations over a quarter turn.
const TURNS: usize = 30;
/// Stride of the coarse search over the orientations.
const APART: usize = 3;
/// Maximum number of points used for the fit.
const MOST: usize = 800;
/// Maximum number of points used for the coarse search.
const SCOUTS: usize = 300;
/// Number of points processed together.
const BLOCK: usize = 16;

/// Fits a rectangle to points by rotation: its sides bound nearly all points, then each edge moves to the mean of the
/// points nearest to it. `None` for fewer than eight points.
pub fn fit(points: &[Point3<f64>]) -> Option<Rectangle> {
    if points.len() < 8 {
        return None;
    }
    let squares = |turner: &mut Turner, turn, bound| {
        let turned = turner.turned(turn);
        turner.squares_within(&turned, bound)
    };
    let mut turner = Turner::of(points, MOST);
    let (_, turn) = best_turn(&mut Turner::of(points, SCOUTS), &mut turner, squares)?;
    let turned = turner.turned(turn);
    let turned = turner.settled(turned);
    let squares = turner.squares_within(&turned, f64::INFINITY)?;
    Some(turned.rectangle(turner.origin, (squares / turner.len as f64).sqrt()))
}

/// True if a rectangle whose sides bound nearly all points has at most the given residual, metres; its edges are not
/// moved as in [`fit`].
pub(crate) fn fits(points: &[Point3<f64>], residual_m: f64) -> bool {
    if points.len() < 8 {
        return false;
    }
    let bound_of = |turner: &Turner| residual_m * residual_m * turner.len as f64;
    let squares = |turner: &mut Turner, turn, best| {
        // What fits is good enough.
        if best <= bound_of(turner) {
            return None;
        }
        let turned = turner.turned(turn);
        turner.squares_within(&turned, best)
    };
    let mut turner = Turner::of(points, MOST);
    let best = best_turn(&mut Turner::of(points, SCOUTS), &mut turner, squares);
    best.is_some_and(|(squares, _)| squares <= bound_of(&turner))
}

/// Bounding rectangle of least area around nearly all points, with residual 0; `None` without points.
pub(crate) fn bounding(points: &[Point3<f64>]) -> Option<Rectangle> {
    if points.is_empty() {
        return None;
    }
    let area = |turner: &mut Turner, turn, _| {
        let [a, b] = turner.turned(turn).along_m();
        Some(a * b)
    };
    let mut turner = Turner::of(points, MOST);
    let (_, turn) = best_turn(&mut Turner::of(points, SCOUTS), &mut turner, area)?;
    Some(turner.turned(turn).rectangle(turner.origin, 0.0))
}

/// Rotation of least cost, with the cost first: the best of a coarse search on the points of `scouts`, or a rotation
/// beside it. `cost` gets the least cost so far and may return `None` above it.
fn best_turn(
    scouts: &mut Turner,
    all: &mut Turner,
    cost: impl Fn(&mut Turner, usize, f64) -> Option<f64>,
) -> Option<(f64, usize)> {
    let best_of = |turner: &mut Turner, turns: &mut dyn Iterator<Item = usize>| {
        let mut best: Option<(f64, usize)> = None;
        for turn in turns {
            let least = best.map_or(f64::INFINITY, |(least, _)| least);
            if let Some(cost) = cost(turner, turn, least).filter(|cost| *cost < least) {
                best = Some((cost, turn));
            }
        }
        best
    };
    let (_, among) = best_of(scouts, &mut (0..TURNS).step_by(APART))?;
    let aside = (1..=APART / 2).flat_map(|aside| [aside, TURNS - aside]);
    best_of(all, &mut std::iter::once(0).chain(aside).map(|aside| (among + aside) % TURNS))
}

/// Points seen from above, and their coordinates along the sides at the last rotation.
struct Turner {
    /// Number of points.
    len: usize,
    /// x and y of the first point, metres; the coordinates are relative to it, so that single precision suffices.
    origin: [f64; 2],
    /// x of each point, padded with NaN to whole blocks.
    xs: Vec<f32>,
    /// y of each point, padded likewise.
    ys: Vec<f32>,
    /// Coordinates along the rotated x axis at the last rotation, padded likewise.
    us: Vec<f32>,
    /// Coordinates along the rotated y axis at the last rotation, padded likewise.
    vs: Vec<f32>,
    /// For each block and side, the outermost coordinate of the block's points across the side, as a number that is
    /// less the farther out it lies.
    reaches: Vec<[f32; 4]>,
    /// Sides across the lower and upper end of `us`, then of `vs`.
    sides: [Side; 4],
}

impl Turner {
    /// Prepares at most `most` of the points, evenly chosen.
    fn of(points: &[Point3<f64>], most: usize) -> Turner {
        let stride = points.len().div_ceil(most).max(1);
        let origin = points.first().map_or([0.0; 2], |p| [p.x, p.y]);
        let from_there = |p: &Point3<f64>| ((p.x - origin[0]) as f32, (p.y - origin[1]) as f32);
        let (mut xs, mut ys): (Vec<f32>, Vec<f32>) = points.iter().step_by(stride).map(from_there).unzip();
        let len = xs.len();
        for column in [&mut xs, &mut ys] {
            column.resize(len.next_multiple_of(BLOCK), f32::NAN);
        }
        let coordinates = vec![f32::NAN; xs.len()];
        let reaches = vec![[f32::INFINITY; 4]; xs.len() / BLOCK];
        let last = len.saturating_sub(1);
        let rank = |share: f64| (last as f64 * share).round() as usize;
        let outside = [rank(0.02), last - rank(0.98)];
        let sides =
            [0, 1, 0, 1].map(|end| Side { outermost: (0..=outside[end]).collect(), found: Vec::new() });
        Turner { len, origin, xs, ys, us: coordinates.clone(), vs: coordinates, reaches, sides }
    }

    fn turned(&mut self, turn: usize) -> Turned {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * turn as f64 / TURNS as f64).sin_cos();
        let [xs, ys] = [&self.xs, &self.ys].map(|column| column.as_chunks::<BLOCK>().0);
        let [us, vs] = [&mut self.us, &mut self.vs].map(|column| column.as_chunks_mut::<BLOCK>().0);
        for ((((x, y), u), v), reach) in xs.iter().zip(ys).zip(us).zip(vs).zip(&mut self.reaches) {
            *reach = turn_block([x, y], [u, v], (sin as f32, cos as f32));
        }
        let reach = |side: usize| self.reaches.iter().map(move |reach| reach[side]);
        let [left, right, front, back] = &mut self.sides;
        let u = [left.turn(&self.us, reach(0), |u| u), -right.turn(&self.us, reach(1), |u| -u)];
        let v = [front.turn(&self.vs, reach(2), |v| v), -back.turn(&self.vs, reach(3), |v| -v)];
        Turned { sin, cos, u: u.map(f64::from), v: v.map(f64::from) }
    }

    /// Rectangle with each edge moved to the mean of the points nearest to it; the bounding rectangle is too large by
    /// the noise.
    fn settled(&self, mut turned: Turned) -> Turned {
        const ROUNDS: usize = 5;
        /// Minimum share of the points nearest to an edge for the edge to move.
        const LEAST_SHARE: f64 = 0.03;
        for _ in 0..ROUNDS {
            let ([u0, u1], [v0, v1]) = (turned.u, turned.v);
            let edges = [u0, u1, v0, v1].map(|edge| edge as f32);
            let mut sums = [(0.0, 0.0); 4];
            for (us, vs) in self.us.as_chunks::<BLOCK>().0.iter().zip(self.vs.as_chunks::<BLOCK>().0) {
                sums = add_nearest(sums, [us, vs], edges);
            }
            let least = LEAST_SHARE * self.len as f64;
            let amid = |n: usize, edge: f64| if sums[n].1 > least { sums[n].0 / sums[n].1 } else { edge };
            (turned.u, turned.v) = ([amid(0, u0), amid(1, u1)], [amid(2, v0), amid(3, v1)]);
        }
        turned
    }

    /// Sum of the squared distances of the points from their nearest edges, square metres; `None` above the bound.
    fn squares_within(&self, turned: &Turned, bound: f64) -> Option<f64> {
        let ([u0, u1], [v0, v1]) = (turned.u.map(|u| u as f32), turned.v.map(|v| v as f32));
        let lesser = |a: f32, b: f32| if a < b { a } else { b };
        let square = |u: f32, v: f32| {
            let across = lesser((u - u0).abs(), (u - u1).abs());
            let edge = lesser(across, lesser((v - v0).abs(), (v - v1).abs()));
            edge * edge
        };
        let (us, last_us) = self.us[..self.len].as_chunks::<BLOCK>();
        let (vs, last_vs) = self.vs[..self.len].as_chunks::<BLOCK>();
        let mut sum = 0.0;
        for (us, vs) in us.iter().zip(vs) {
            let squares: [f32; BLOCK] = std::array::from_fn(|i| square(us[i], vs[i]));
            sum += f64::from(squares.iter().sum::<f32>());
            if sum > bound {
                return None;
            }
        }
        sum += last_us.iter().zip(last_vs).map(|(u, v)| f64::from(square(*u, *v))).sum::<f64>();
        (sum <= bound).then_some(sum)
    }
}

/// Adds the points of a block to the sums of their nearest edges: sum of the coordinate across the edge, and number of
/// points.
#[inline(always)]
fn add_nearest(sums: [(f64, f64); 4], [us, vs]: [&[f32; BLOCK]; 2], edges: [f32; 4]) -> [(f64, f64); 4] {
    let mut own = [([0.0; BLOCK], [0.0; BLOCK]); 4];
    for i in 0..BLOCK {
        let places = [us[i], us[i], vs[i], vs[i]];
        let [a, b, c, d] = [0, 1, 2, 3].map(|n| (places[n] - edges[n]).abs());
        // The first of equals; what is no number is near none.
        let nearest = [
            (a <= b) & (a <= c) & (a <= d),
            (b < a) & (b <= c) & (b <= d),
            (c < a) & (c < b) & (c <= d),
            (d < a) & (d < b) & (d < c),
        ];
        for n in 0..4 {
            own[n].0[i] = if nearest[n] { places[n] } else { 0.0 };
            own[n].1[i] = if nearest[n] { 1.0 } else { 0.0 };
        }
    }
    let sum = |of: &[f32; BLOCK]| f64::from(of.iter().sum::<f32>());
    std::array::from_fn(|n| (sums[n].0 + sum(&own[n].0), sums[n].1 + sum(&own[n].1)))
}

/// Side of the rectangle, with the points on and outside it.
struct Side {
    /// Indices of the points that were on or outside the side at the last rotation.
    outermost: Vec<usize>,
    /// Sort keys of the outermost points, as of [`ranked`].
    found: Vec<u64>,
}

impl Side {
    /// Position of the side at a new rotation, from the points' positions across the side and the outermost position in
    /// each block; less is farther out.
    fn turn(&mut self, places: &[f32], reaches: impl Iterator<Item = f32>, way: impl Fn(f32) -> f32) -> f32 {
        // The side lies no farther in than the points that were outermost before.
        let before = self.outermost.iter().map(|&i| way(places[i]));
        let limit = before.fold(f32::NEG_INFINITY, f32::max);
        self.found.clear();
        for ((block, first), reach) in
            places.as_chunks::<BLOCK>().0.iter().zip((0..).step_by(BLOCK)).zip(reaches)
        {
            // Neighbours in an image are near each other: most blocks have none so far out.
            if reach <= limit {
                let (before, mut count) = (self.found.len(), 0);
                self.found.resize(before + BLOCK, 0);
                let some = &mut self.found[before..];
                for (place, number) in block.iter().map(|place| way(*place)).zip(first..) {
                    // Written over by the next if it is not so far out.
                    some[count % BLOCK] = ranked(place, number);
                    count += usize::from(place <= limit);
                }
                self.found.truncate(before + count);
            }
        }
        let last = self.outermost.len() - 1;
        let (farther, side, _) = self.found.select_nth_unstable(last);
        self.outermost.clear();
        self.outermost.extend(farther.iter().chain([&*side]).map(|ranked| *ranked as u32 as usize));
        way(places[self.outermost[last]])
    }
}

/// Sort key of a position and an index, ordered by position.
fn ranked(place: f32, number: u32) -> u64 {
    let bits = place.to_bits();
    // Of negative numbers the bits fall as they rise.
    let order = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    u64::from(order) << 32 | u64::from(number)
}

/// Rotates the points of a block, and returns their outermost coordinates across each side; NaN is ignored.
#[inline(always)]
fn turn_block(
    [xs, ys]: [&[f32; BLOCK]; 2],
    [us, vs]: [&mut [f32; BLOCK]; 2],
    (sin, cos): (f32, f32),
) -> [f32; 4] {
    /// Number of points rotated at a time. From: work.
    const LANES: usize = 4;
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let (mut least, mut most) = ([[f32::INFINITY; LANES]; 2], [[f32::NEG_INFINITY; LANES]; 2]);
    let [xs, ys] = [xs, ys].map(|column| column.as_chunks::<LANES>().0);
    let [us, vs] = [us, vs].map(|column| column.as_chunks_mut::<LANES>().0);
    for (((x, y), us), vs) in xs.iter().zip(ys).zip(us).zip(vs) {
        let u: [f32; LANES] = std::array::from_fn(|i| cos * x[i] + sin * y[i]);
        let v: [f32; LANES] = std::array::from_fn(|i| -sin * x[i] + cos * y[i]);
        least = [(u, least[0]), (v, least[1])].map(|(a, b)| std::array::from_fn(|i| lesser(a[i], b[i])));
        most = [(u, most[0]), (v, most[1])].map(|(a, b)| std::array::from_fn(|i| greater(a[i], b[i])));
        (*us, *vs) = (u, v);
    }
    let [left, front] = least.map(|lanes| lanes.into_iter().fold(f32::INFINITY, lesser));
    let [right, back] = most.map(|lanes| lanes.into_iter().fold(f32::NEG_INFINITY, greater));
    [left, -right, front, -back]
}

/// Rotated rectangle whose sides bound nearly all points: sine and cosine of the rotation, and the limits along both
/// rotated axes, metres.
struct Turned {
    sin: f64,
    cos: f64,
    u: [f64; 2],
    v: [f64; 2],
}

impl Turned {
    /// Sides along both rotated axes, metres.
    fn along_m(&self) -> [f64; 2] {
        [self.u, self.v].map(|[low, high]| high - low)
    }

    /// Rectangle in the frame in which the points' origin has the given coordinates.
    fn rectangle(&self, origin: [f64; 2], residual_m: f64) -> Rectangle {
        let ([u0, u1], [v0, v1]) = (self.u, self.v);
        let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
        let [a, b] = self.along_m();
        Rectangle {
            x: origin[0] + self.cos * u - self.sin * v,
            y: origin[1] + self.sin * u + self.cos * v,
            sides_m: [a.max(b), a.min(b)],
            turn: (self.sin, self.cos),
            along_m: [a, b],
            residual_m,
        }
    }
}
