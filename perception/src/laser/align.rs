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
    /// True if the solver settled; false if it was cut short.
    pub converged: bool,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Times that the violation was computed.
    pub evaluations: usize,
    /// How far each scan's pose was moved: metres, and radians anticlockwise.
    pub moved: Vec<(f64, f64)>,
}

/// Scans that cannot be aligned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AlignError {
    /// The scans make no model.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// Minimises the boundary violation over the poses of all scans, from the poses given. One scan alone stays as it is.
///
/// # Errors
/// If there is no scan, or one is unsound.
pub fn align(scans: &[PosedScan], options: &SolverOptions) -> Result<Alignment, AlignError> {
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
        converged: solved.converged,
        iterations: solved.iterations,
        evaluations: solved.evaluations,
        moved: moved.collect(),
        model: ShapeModel::new(
            unposed
                .into_iter()
                .zip(&solved.poses)
                .map(|(s, pose)| PosedScan { scan: s.scan, model_from_laser: *pose })
                .collect(),
        )?,
    })
}
