//! Pose graph of a drive: relative poses between stations in one least-squares problem (Lu and
//! Milios 1997), solved by Gauss-Newton with an envelope (skyline) matrix.

use nalgebra::{Isometry2, Matrix2x3, Matrix3, UnitComplex, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Relative pose of two stations, with its information.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// Index of the first station.
    pub from: usize,
    /// Index of the second station.
    pub to: usize,
    /// Pose of the second station in the frame of the first, metres.
    pub from_from_to: Isometry2<f64>,
    /// Information matrix of the relative pose: shift in the frame of `from` (metres), and rotation
    /// (radians).
    pub information: Matrix3<f64>,
    /// True if the edge may be a false loop closure; its weight then falls with its residual
    /// (Cauchy).
    pub doubtful: bool,
}

/// Pose graph: stations and the relative poses between them.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseGraph {
    /// Initial poses of the stations; the first is fixed.
    pub poses: Vec<Isometry2<f64>>,
    /// Relative poses between stations.
    pub edges: Vec<Edge>,
}

/// Result of optimising a pose graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// Optimised poses, one per station.
    pub poses: Vec<Isometry2<f64>>,
    /// Squared Mahalanobis error of each edge; about three if its information matrix is right.
    pub squares: Vec<f64>,
    /// Weight of each edge, from 0 (rejected) to 1.
    pub weights: Vec<f64>,
    /// Number of iterations.
    pub rounds: usize,
    /// False if the iteration limit was reached while poses still moved.
    pub converged: bool,
}

/// Reason why a pose graph cannot be optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GraphError {
    /// An edge names a missing station, or connects a station with itself.
    #[error(
        "edge {edge} goes from station {from} to {to}, of {stations}: name two different stations, counted from 0"
    )]
    Station {
        /// Index of the edge.
        edge: usize,
        /// Index of the edge's first station.
        from: usize,
        /// Index of the edge's second station.
        to: usize,
        /// Number of stations.
        stations: usize,
    },
    /// A pose or an edge is not finite.
    #[error("{what} {index} is not finite: mend the fit that it came from")]
    NotFinite {
        /// Kind of the element: `pose` or `edge`.
        what: &'static str,
        /// Index of the pose or edge.
        index: usize,
    },
    /// A station whose pose the edges do not determine.
    #[error("station {station} is held by no edge: give each the step from the one before it")]
    Loose {
        /// Index of the station.
        station: usize,
    },
}

const MOST_ROUNDS: usize = 60;
/// Motion of all poses, metres and radians, below which the optimisation ends.
const SETTLED: f64 = 1e-4;
/// Residual, in standard deviations, beyond which doubtful edges lose weight: start value, factor per iteration, and
/// end value. It decreases because drift on a long route is large at first.
const DOUBT: (f64, f64, f64) = (1e4, 0.5, 3.0);

impl PoseGraph {
    /// Optimises the poses.
    ///
    /// # Errors
    /// If an edge names a missing station, a number is not finite, or the edges do not determine a pose.
    pub fn settle(&self) -> Result<Settled, GraphError> {
        let _span =
            tracing::debug_span!("pose graph", poses = self.poses.len(), edges = self.edges.len()).entered();
        self.check()?;
        let mut poses = self.poses.clone();
        let mut doubt = DOUBT.0;
        let mut settled = Settled {
            poses: Vec::new(),
            squares: Vec::new(),
            weights: Vec::new(),
            rounds: 0,
            converged: false,
        };
        while settled.rounds < MOST_ROUNDS {
            settled.rounds += 1;
            let (squares, weights) = self.weighed(&poses, doubt);
            let moved = self.step(&mut poses, &weights)?;
            (settled.squares, settled.weights) = (squares, weights);
            if doubt <= DOUBT.2 && moved < SETTLED {
                settled.converged = true;
                break;
            }
            doubt = (doubt * DOUBT.1).max(DOUBT.2);
        }
        (settled.squares, settled.weights) = self.weighed(&poses, DOUBT.2);
        settled.poses = poses;
        Ok(settled)
    }

    fn check(&self) -> Result<(), GraphError> {
        let stations = self.poses.len();
        let is_finite = |pose: &Isometry2<f64>| {
            let turn = pose.rotation.complex();
            pose.translation.vector.iter().all(|c| c.is_finite()) && (turn.norm() - 1.0).abs() < 1e-6
        };
        if let Some(index) = self.poses.iter().position(|p| !is_finite(p)) {
            return Err(GraphError::NotFinite { what: "pose", index });
        }
        for (edge, e) in self.edges.iter().enumerate() {
            if e.from >= stations || e.to >= stations || e.from == e.to {
                return Err(GraphError::Station { edge, from: e.from, to: e.to, stations });
            }
            if !is_finite(&e.from_from_to) || !e.information.iter().all(|v| v.is_finite()) {
                return Err(GraphError::NotFinite { what: "edge", index: edge });
            }
        }
        Ok(())
    }

    /// Squared Mahalanobis errors and weights of the edges; doubtful edges lose weight beyond `doubt` standard
    /// deviations.
    fn weighed(&self, poses: &[Isometry2<f64>], doubt: f64) -> (Vec<f64>, Vec<f64>) {
        let weigh = |edge: &Edge| {
            let error = edge.error(poses);
            let square = error.dot(&(edge.information * error));
            (square, if edge.doubtful { 1.0 / (1.0 + square / (doubt * doubt)) } else { 1.0 })
        };
        self.edges.iter().map(weigh).unzip()
    }

    /// Applies a Gauss-Newton step; returns the largest motion of a pose, metres or radians.
    fn step(&self, poses: &mut [Isometry2<f64>], weights: &[f64]) -> Result<f64, GraphError> {
        let mut normal = Envelope::of(poses.len(), &self.edges);
        let mut right = vec![0.0; 3 * poses.len()];
        for (edge, weight) in self.edges.iter().zip(weights) {
            let error = edge.error(poses);
            let information = edge.information * *weight;
            let slopes = edge.slopes(poses);
            for (a, slope) in &slopes {
                let pull = slope.transpose() * information * error;
                (0..3).for_each(|k| right[3 * a + k] -= pull[k]);
                for (b, other) in &slopes {
                    normal.add(3 * a, 3 * b, &(slope.transpose() * information * other));
                }
            }
        }
        // The first station stays.
        (0..3).for_each(|k| normal.hold(k));
        normal.solve(&mut right).map_err(|row| GraphError::Loose { station: row / 3 })?;
        let mut moved = 0.0_f64;
        for (pose, by) in poses.iter_mut().zip(right.chunks_exact(3)) {
            pose.translation.vector += Vector2::new(by[0], by[1]);
            pose.rotation = UnitComplex::new(pose.rotation.angle() + by[2]);
            moved = by.iter().fold(moved, |m, v| m.max(v.abs()));
        }
        Ok(moved)
    }
}

impl Edge {
    /// Error of the edge at the given poses: shift in the frame of `from` (metres), and rotation (radians).
    fn error(&self, poses: &[Isometry2<f64>]) -> Vector3<f64> {
        let (from, to) = (&poses[self.from], &poses[self.to]);
        let seen = from.inv_mul(to);
        let shift = seen.translation.vector - self.from_from_to.translation.vector;
        shift.push(self.from_from_to.rotation.angle_to(&seen.rotation))
    }

    /// Jacobians of the error with respect to both poses, each with the index of its station.
    fn slopes(&self, poses: &[Isometry2<f64>]) -> [(usize, Matrix3<f64>); 2] {
        let (from, to) = (&poses[self.from], &poses[self.to]);
        let back = from.rotation.inverse().to_rotation_matrix().into_inner();
        let seen = back * (to.translation.vector - from.translation.vector);
        let with = |sign: f64, turn: Vector2<f64>| {
            let mut slope = Matrix3::zeros();
            slope.fixed_view_mut::<2, 3>(0, 0).copy_from(&Matrix2x3::from_columns(&[
                back.column(0) * sign,
                back.column(1) * sign,
                turn.column(0).into_owned(),
            ]));
            slope[(2, 2)] = sign;
            slope
        };
        [(self.from, with(-1.0, Vector2::new(seen.y, -seen.x))), (self.to, with(1.0, Vector2::zeros()))]
    }
}

/// Symmetric matrix in envelope storage: the lower triangle, each row from its first non-zero column to the diagonal.
/// Solving overwrites it with its Cholesky factor.
struct Envelope {
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Envelope {
    fn of(poses: usize, edges: &[Edge]) -> Envelope {
        let mut first: Vec<usize> = (0..poses).collect();
        for edge in edges {
            let (low, high) = (edge.from.min(edge.to), edge.from.max(edge.to));
            first[high] = first[high].min(low);
        }
        let first: Vec<usize> = first.iter().flat_map(|f| [3 * f; 3]).collect();
        let rows = first.iter().enumerate().map(|(row, from)| vec![0.0; row + 1 - from]).collect();
        Envelope { first, rows }
    }

    /// Adds a 3x3 block at a row and column; entries above the diagonal are dropped.
    fn add(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        for i in 0..3 {
            for j in 0..3 {
                let (r, c) = (row + i, column + j);
                if c <= r {
                    self.rows[r][c - self.first[r]] += block[(i, j)];
                }
            }
        }
    }

    /// Fixes an unknown at zero by a large diagonal entry.
    fn hold(&mut self, row: usize) {
        let at = row - self.first[row];
        self.rows[row][at] += 1e12;
    }

    /// Solves the system in place for a right-hand side; `Err` with the row of an undetermined unknown.
    fn solve(&mut self, right: &mut [f64]) -> Result<(), usize> {
        for row in 0..self.rows.len() {
            let (above, rest) = self.rows.split_at_mut(row);
            let own = &mut rest[0];
            let first = self.first[row];
            for column in first..row {
                let other = &above[column];
                let from = first.max(self.first[column]);
                let a = &own[from - first..column - first];
                let b = &other[from - self.first[column]..column - self.first[column]];
                let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                own[column - first] = (own[column - first] - dot) / other[column - self.first[column]];
            }
            let (diagonal, before) = own.split_last_mut().ok_or(row)?;
            let left = *diagonal - before.iter().map(|v| v * v).sum::<f64>();
            if left.is_nan() || left <= 1e-9 {
                return Err(row);
            }
            *diagonal = left.sqrt();
        }
        for row in 0..self.rows.len() {
            let (own, first) = (&self.rows[row], self.first[row]);
            let dot: f64 = own.iter().zip(&right[first..row]).map(|(a, b)| a * b).sum();
            right[row] = (right[row] - dot) / own[row - first];
        }
        for row in (0..self.rows.len()).rev() {
            let (own, first) = (&self.rows[row], self.first[row]);
            right[row] /= own[row - first];
            let value = right[row];
            right[first..row].iter_mut().zip(own).for_each(|(r, a)| *r -= a * value);
        }
        Ok(())
    }
}
