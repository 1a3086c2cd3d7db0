//! Euclidean clustering: points are connected if they are at most a given step apart.

use crate::cloud::is_finite;
use nalgebra::Point3;

/// Reason why points cannot be clustered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ClusterError {
    /// The step is not positive.
    #[error("a step of {step_m} m: give a positive length, such as 0.02")]
    Step {
        /// Given step, metres.
        step_m: f32,
    },
    /// A point lies too far from the first to be assigned to a cell.
    #[error(
        "a point lies more than a million steps of {step_m} m from the first: are these millimetres (scale by 0.001), or a stray return?"
    )]
    TooFar {
        /// Given step, metres.
        step_m: f32,
    },
}

/// Indices of the points of each cluster: connected by steps up to `step_m`, with at least `least` points. Largest
/// first, ties by first point; indices ascend within a cluster. Missing returns belong to no cluster.
///
/// Points within the step are connected whatever their order: single linkage, as DBSCAN with every point a core point.
///
/// # Errors
/// If the step is not positive, or a point lies more than about a million steps from the first.
pub fn euclidean(points: &[Point3<f32>], step_m: f32, least: usize) -> Result<Vec<Vec<u32>>, ClusterError> {
    let _span = tracing::debug_span!("clusters", points = points.len()).entered();
    if !(step_m > 0.0 && step_m.is_finite()) {
        return Err(ClusterError::Step { step_m });
    }
    let cells = Cells::new(points, step_m)?;
    let mut sets = Sets::new(cells.begin.len() - 1);
    cells.join(&mut sets, step_m);
    Ok(collect(&cells, &mut sets, least))
}

/// Points in cells whose diagonal is one step, so that points of a cell are always connected.
struct Cells {
    /// Cell coordinates, ascending by (z, y, x).
    key: Vec<[i32; 3]>,
    /// Index of each cell's first item, and the number of items at the end.
    begin: Vec<u32>,
    items: Vec<(Point3<f32>, u32)>,
}

/// Number of cells to either side that a step can reach: a cell's edge is the step over the square root of three.
const REACH: i32 = 2;

impl Cells {
    fn new(points: &[Point3<f32>], step_m: f32) -> Result<Cells, ClusterError> {
        const FARTHEST: f64 = (1 << 20) as f64;
        // A hair shorter than the exact edge, so that rounding keeps the diagonal within the step.
        let per_m = 3f64.sqrt() * 1.000_001 / f64::from(step_m);
        let origin = points.iter().find(|p| is_finite(p)).copied().unwrap_or(Point3::origin()).cast::<f64>();
        let mut sorted: Vec<(u64, u32)> = Vec::with_capacity(points.len());
        for (index, p) in (0u32..).zip(points).filter(|(_, p)| is_finite(p)) {
            let cell = (p.cast::<f64>() - origin).map(|c| (c * per_m).floor());
            if cell.amax() >= FARTHEST {
                return Err(ClusterError::TooFar { step_m });
            }
            let axis = |c: f64| (c as i64 + (1 << 20)) as u64;
            sorted.push((axis(cell.z) << 42 | axis(cell.y) << 21 | axis(cell.x), index));
        }
        sorted.sort_unstable();
        let mut cells = Cells { key: Vec::new(), begin: Vec::new(), items: Vec::with_capacity(sorted.len()) };
        let mut last = u64::MAX;
        for (key, index) in sorted {
            if key != last {
                last = key;
                let axis = |shift: u32| ((key >> shift) & ((1 << 21) - 1)) as i32;
                cells.key.push([axis(0), axis(21), axis(42)]);
                cells.begin.push(cells.items.len() as u32);
            }
            cells.items.push((points[index as usize], index));
        }
        cells.begin.push(cells.items.len() as u32);
        Ok(cells)
    }

    fn of(&self, cell: usize) -> &[(Point3<f32>, u32)] {
        &self.items[self.begin[cell] as usize..self.begin[cell + 1] as usize]
    }

    /// Joins all cells that have points within a step of each other. One cursor per preceding row of cells advances
    /// with the current cell, so that no search is needed.
    fn join(&self, sets: &mut Sets, step_m: f32) {
        let limit = step_m * step_m;
        let rows: Vec<(i32, i32)> = (-REACH..=0)
            .flat_map(|dz| (-REACH..=REACH).map(move |dy| (dy, dz)))
            .filter(|&(dy, dz)| dz < 0 || dy <= 0)
            .collect();
        let mut cursors = vec![0usize; rows.len()];
        for cell in 0..self.key.len() {
            let [x, y, z] = self.key[cell];
            for (&(dy, dz), cursor) in rows.iter().zip(&mut cursors) {
                let first = [z + dz, y + dy, x - REACH];
                while self.row_order(*cursor) < first {
                    *cursor += 1;
                }
                let last = if (dy, dz) == (0, 0) { x - 1 } else { x + REACH };
                let mut other = *cursor;
                while other < cell && self.row_order(other) <= [z + dz, y + dy, last] {
                    if !sets.same(cell, other) && near(self.of(cell), self.of(other), limit) {
                        sets.join(cell, other);
                    }
                    other += 1;
                }
            }
        }
    }

    fn row_order(&self, cell: usize) -> [i32; 3] {
        let [x, y, z] = self.key[cell];
        [z, y, x]
    }
}

/// True if a point of one cell is within a step of a point of the other; `limit`: square of the step, square metres.
fn near(a: &[(Point3<f32>, u32)], b: &[(Point3<f32>, u32)], limit: f32) -> bool {
    a.iter().any(|(p, _)| b.iter().any(|(q, _)| (p - q).norm_squared() <= limit))
}

/// Disjoint sets (union by index, path halving).
struct Sets {
    parent: Vec<u32>,
}

impl Sets {
    fn new(len: usize) -> Sets {
        Sets { parent: (0..len as u32).collect() }
    }

    fn root(&mut self, mut of: usize) -> usize {
        while self.parent[of] as usize != of {
            let up = self.parent[self.parent[of] as usize];
            self.parent[of] = up;
            of = up as usize;
        }
        of
    }

    fn same(&mut self, a: usize, b: usize) -> bool {
        self.root(a) == self.root(b)
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b) as u32;
    }
}

fn collect(cells: &Cells, sets: &mut Sets, least: usize) -> Vec<Vec<u32>> {
    let mut clusters: Vec<Vec<u32>> = vec![Vec::new(); cells.key.len()];
    for cell in 0..cells.key.len() {
        let root = sets.root(cell);
        clusters[root].extend(cells.of(cell).iter().map(|(_, index)| index));
    }
    clusters.retain(|c| c.len() >= least.max(1));
    clusters.iter_mut().for_each(|c| c.sort_unstable());
    clusters.sort_by(|a, b| b.len().cmp(&a.len()).then(a[0].cmp(&b[0])));
    clusters
}
