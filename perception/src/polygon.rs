//! Convex polygons in a plane: hull, area, intersection, and point-in-polygon test.

/// Area of a polygon with anticlockwise corners.
pub(crate) fn area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

/// Intersection of a convex polygon with the polygon `by`, the latter widened by a margin (Sutherland and Hodgman
/// 1974); empty if `by` has fewer than three corners.
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

/// Corners of the convex hull, anticlockwise (Andrew's monotone chain). Fewer than three different points are returned
/// as they are.
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

/// Farthest point in each of the given directions.
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
    /// Number of points below which none are dropped. From: work.
    const WORTH_IT: usize = 64;
    /// Directions towards the corners of a box. From: derived, the four diagonals.
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

/// True if a convex polygon (corners anticlockwise) contains a point; the border counts as inside.
pub fn holds<P: Copy + Into<[f64; 2]>>(outline: &[P], place: P) -> bool {
    let (n, p) = (outline.len(), place.into());
    n >= 3
        && (0..n).all(|i| {
            let (a, b) = (outline[i].into(), outline[(i + 1) % n].into());
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0
        })
}
