//! Scan-alignment: poses of all scans that violate their angular constraints least (section III).

use super::shape::{PosedScan, ShapeError, ShapeModel};
use super::solve::{Problem, SolverOptions, solve};
use super::violation::{Assembly, Violation};
use nalgebra::Isometry2;

/// A shape model made of scans, and how well they go together.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// The scans at their poses after alignment.
    pub model: ShapeModel,
    /// Violation at the poses that were given.
    pub before: Violation,
    /// Violation after.
    pub after: Violation,
    /// What was minimised, after: the violation, and what chooses among poses that violate nothing; square metres.
    pub objective_m2: f64,
    /// True if the solver settled; false if it was cut short.
    pub converged: bool,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Times that the violation was computed.
    pub evaluations: usize,
    /// How far the pose of each scan of the model was moved: metres, and radians anticlockwise.
    pub moved: Vec<(f64, f64)>,
    /// Scans that contradict the others and are no part of the model, by their index; only [`align_consistent`] leaves out any.
    pub left_out: Vec<usize>,
}

impl Alignment {
    /// The longest error of either kind after alignment, metres: beyond twice the laser's precision the scans contradict each other.
    pub fn longest_m(&self) -> f64 {
        self.after.exterior_m.max(self.after.interior_m)
    }
}

/// Minimises the boundary violation over the poses of all scans, from the poses given. One scan alone stays as it is.
///
/// # Errors
/// If there is no scan, or one is unsound.
pub fn align(scans: &[PosedScan], options: &SolverOptions) -> Result<Alignment, ShapeError> {
    let _span = tracing::debug_span!("align", scans = scans.len()).entered();
    let model = ShapeModel::new(scans.to_vec())?;
    let unposed: Vec<PosedScan> = scans
        .iter()
        .map(|s| PosedScan { scan: s.scan.clone(), model_from_laser: Isometry2::identity() })
        .collect();
    let assembly = Assembly::new(unposed.iter().map(std::slice::from_ref));
    let start: Vec<Isometry2<f64>> = model.scans().iter().map(|s| s.model_from_laser).collect();
    let solved = solve(&Problem::free(&assembly, &start, options.objective), options);
    let moved = start.iter().zip(&solved.poses).map(|(from, to)| {
        ((to.translation.vector - from.translation.vector).norm(), from.rotation.angle_to(&to.rotation))
    });
    Ok(Alignment {
        before: assembly.violation(&start),
        after: assembly.violation(&solved.poses),
        objective_m2: solved.cost,
        converged: solved.converged,
        iterations: solved.iterations,
        evaluations: solved.evaluations,
        moved: moved.collect(),
        left_out: Vec::new(),
        model: ShapeModel::new(
            unposed
                .into_iter()
                .zip(&solved.poses)
                .map(|(s, pose)| PosedScan { scan: s.scan, model_from_laser: *pose })
                .collect(),
        )?,
    })
}

/// Fewest scans that can tell which of them is wrong: two contradict each other, a third decides.
const FEWEST: usize = 3;

/// Aligns scans of which some may be wrong: where the end of the thing was taken for background, a bound lies on the thing and contradicts all other scans.
///
/// While an error is longer than `longest_m`, the scan is left out without which the rest go together best. If no three scans, or no more than half of
/// all, agree, none is left out, and [`Alignment::longest_m`] says that they do not go together.
///
/// # Errors
/// As [`align`].
pub fn align_consistent(
    scans: &[PosedScan],
    longest_m: f64,
    options: &SolverOptions,
) -> Result<Alignment, ShapeError> {
    let all = align(scans, options)?;
    let mut kept: Vec<usize> = (0..scans.len()).collect();
    let mut best = all.clone();
    while best.longest_m() > longest_m {
        if kept.len() <= FEWEST.max(scans.len() / 2 + 1) {
            return Ok(all);
        }
        let mut without: Option<(f64, usize, Alignment)> = None;
        for out in 0..kept.len() {
            let rest: Vec<PosedScan> =
                (0..kept.len()).filter(|&i| i != out).map(|i| scans[kept[i]].clone()).collect();
            let alignment = align(&rest, options)?;
            let cost = alignment.objective_m2;
            if without.as_ref().is_none_or(|(least, ..)| cost < *least) {
                without = Some((cost, out, alignment));
            }
        }
        let Some((_, out, alignment)) = without else { return Ok(all) };
        kept.remove(out);
        best = alignment;
    }
    best.left_out = (0..scans.len()).filter(|i| !kept.contains(i)).collect();
    Ok(best)
}
