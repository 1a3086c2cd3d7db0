//! Connected sets of cells in a plane, and convex hulls.

/// The largest set of cells that hang together, up to two cells apart (shadows of objects); ties go to the first in order. Each cell
/// is named once.
pub fn largest_part(cells: Vec<([i32; 2], u32)>) -> Vec<[i32; 2]> {
    parts(cells).into_iter().next().unwrap_or_default()
}

/// The sets of cells that hang together so, the one with most returns first; ties go to the first in order. Each cell is named once.
pub fn parts(mut cells: Vec<([i32; 2], u32)>) -> Vec<Vec<[i32; 2]>> {
    cells.sort_unstable_by_key(|(cell, _)| rank(*cell));
    let mut parts: Vec<(u32, Vec<[i32; 2]>)> = Vec::new();
    let mut numbers = vec![0; cells.len()];
    for (i, ((cell, count), first)) in cells.iter().zip(first_of_part(&cells)).enumerate() {
        if first == i {
            numbers[i] = parts.len();
            parts.push((0, Vec::new()));
        }
        let part = &mut parts[numbers[first]];
        part.0 += count;
        part.1.push(*cell);
    }
    parts.retain(|(count, _)| *count > 0);
    parts.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    parts.into_iter().map(|(_, cells)| cells).collect()
}

/// A number in the order of the cells: by x, then by y.
fn rank(cell: [i32; 2]) -> u64 {
    let [x, y] = cell.map(|at| u64::from(at.cast_unsigned() ^ 1 << 31));
    x << 32 | y
}

/// Area of a polygon with anticlockwise corners.
pub(crate) fn area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

/// The part of a convex polygon that lies in another, widened by a margin (Sutherland and Hodgman 1974).
pub(crate) fn clip(polygon: Vec<[f64; 2]>, by: &[[f64; 2]], margin: f64) -> Vec<[f64; 2]> {
    if by.len() < 3 {
        return Vec::new();
    }
    let edges = by.iter().zip(by.iter().cycle().skip(1));
    edges.fold(polygon, |polygon, (a, b)| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let inside = |p: &[f64; 2]| (along[0] * (p[1] - a[1]) - along[1] * (p[0] - a[0])) / length + margin;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (p, q) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
            let (from, to) = (inside(p), inside(q));
            if from >= 0.0 {
                kept.push(*p);
            }
            if (from >= 0.0) != (to >= 0.0) {
                let share = from / (from - to);
                kept.push([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])]);
            }
        }
        kept
    })
}

/// Cells of one column that hang together.
struct Run {
    x: i32,
    /// The first and the last.
    ends: [i32; 2],
    /// Index of the run's first cell among all cells in order, and its number of cells.
    at: usize,
    len: usize,
}

/// First connected cell, for each of the cells in order.
fn first_of_part(order: &[([i32; 2], u32)]) -> Vec<usize> {
    /// Cells so far apart hang together: shadows of objects. From: chosen.
    const GAP: i32 = 2;
    let mut at = 0;
    let in_column = order.chunk_by(|([x, y], _), ([next, on], _)| x == next && on.saturating_sub(*y) <= GAP);
    let run = |cells: &[([i32; 2], u32)]| {
        let (([x, first], _), ([_, last], _)) = (cells[0], cells[cells.len() - 1]);
        at += cells.len();
        Run { x, ends: [first, last], at: at - cells.len(), len: cells.len() }
    };
    let runs: Vec<Run> = in_column.map(run).collect();
    let mut first: Vec<usize> = (0..runs.len()).collect();
    // The runs that follow within reach, in the next columns. No gap in a run is wider than that reach.
    let mut ahead = [0; GAP as usize];
    for (i, Run { x, ends: [low, high], .. }) in runs.iter().enumerate() {
        let mut own = root(&mut first, i);
        for (dx, start) in (1..).zip(&mut ahead) {
            let column = x.saturating_add(dx);
            let from = [column, low.saturating_sub(GAP)];
            while runs.get(*start).is_some_and(|run| [run.x, run.ends[1]] < from) {
                *start += 1;
            }
            let to = [column, high.saturating_add(GAP)];
            let near = runs[*start..].iter().take_while(|run| [run.x, run.ends[0]] <= to);
            for j in (*start..).take(near.count()) {
                let other = root(&mut first, j);
                first[own.max(other)] = own.min(other);
                own = own.min(other);
            }
        }
    }
    let of_cells = |(i, run): (usize, &Run)| std::iter::repeat_n(runs[root(&mut first, i)].at, run.len);
    runs.iter().enumerate().flat_map(of_cells).collect()
}

fn root(first: &mut [usize], mut i: usize) -> usize {
    while first[i] != i {
        first[i] = first[first[i]];
        i = first[i];
    }
    i
}

/// Corners of the convex hull, anticlockwise (Andrew's monotone chain).
pub fn convex_hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    drop_inner(&mut points);
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_right = |hull: &[[f64; 2]], p: &[f64; 2]| match hull {
        [.., a, b] => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0.0,
        _ => false,
    };
    let half = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while turns_right(&chain, p) {
                chain.pop();
            }
            chain.push(*p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}

/// Extreme points in the given directions.
fn farthest<const N: usize>(points: &[[f64; 2]], ways: [[f64; 2]; N]) -> [[f64; 2]; N] {
    let mut far = [(f64::NEG_INFINITY, [0.0; 2]); N];
    for p in points {
        for (far, way) in far.iter_mut().zip(&ways) {
            let reach = way[0] * p[0] + way[1] * p[1];
            if reach > far.0 {
                *far = (reach, *p);
            }
        }
    }
    far.map(|(_, p)| p)
}

/// Drops points well inside the octagon of extreme points, which are no hull corners (Akl and
/// Toussaint 1978).
fn drop_inner(points: &mut Vec<[f64; 2]>) {
    /// Number of points below which they are sorted directly. From: work.
    const WORTH_IT: usize = 64;
    /// Directions of the corners of a box. From: derived, the four diagonals.
    const SLANTS: [[f64; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    /// Minimum doubled area between a point and an edge for the point to be inside, square metres.
    /// From: rounding.
    const CLEAR_M2: f64 = 1e-12;
    if points.len() < WORTH_IT {
        return;
    }
    // The box between the points that reach farthest at a slant lies in the hull, and holds most points.
    let [ne, nw, sw, se] = farthest(points, SLANTS);
    let (west, east) = (nw[0].max(sw[0]), ne[0].min(se[0]));
    let (south, north) = (sw[1].max(se[1]), nw[1].min(ne[1]));
    points.retain(|p| !(p[0] > west && p[0] < east && p[1] > south && p[1] < north));
    let [e, n, w, s] = farthest(points, [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]);
    let mut octagon = vec![e, ne, n, nw, w, sw, s, se];
    octagon.dedup();
    if octagon.len() < 3 {
        return;
    }
    let ends = octagon.iter().zip(octagon.iter().cycle().skip(1)).filter(|(a, b)| a != b);
    let edges: Vec<([f64; 2], [f64; 2])> = ends.map(|(a, b)| (*a, [b[0] - a[0], b[1] - a[1]])).collect();
    points.retain(|p| {
        let left_of = |(a, along): &([f64; 2], [f64; 2])| {
            along[0] * (p[1] - a[1]) - along[1] * (p[0] - a[0]) > CLEAR_M2
        };
        !edges.iter().all(left_of)
    });
}
