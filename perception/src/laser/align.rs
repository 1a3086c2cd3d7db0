//! Scan alignment: poses of all scans with the least violation of their angular constraints (section III).

use super::shape::{PosedScan, ShapeError, ShapeModel};
use super::solve::{Objective, Problem, SolverOptions, solve};
use super::violation::{Assembly, Kind, ScanEnd, Violation};
use nalgebra::Isometry2;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

/// Shape model from scans, with the quality of the alignment.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// Scans at their aligned poses.
    pub model: ShapeModel,
    /// Violation at the given poses.
    pub before: Violation,
    /// Violation at the aligned poses.
    pub after: Violation,
    /// Objective after alignment, square metres: boundary violation, with the tie-breaker of [`Objective::Centred`] if
    /// that was chosen.
    pub objective_m2: f64,
    /// True if the solver converged; false at the iteration limit.
    pub converged: bool,
    /// Number of iterations of the solver.
    pub iterations: usize,
    /// Number of evaluations of the violation.
    pub evaluations: usize,
    /// Motion of each scan of the model: metres, and radians anticlockwise.
    pub moved: Vec<(f64, f64)>,
    /// Indices of contradicting scans left out of the model; only by [`align_consistent`].
    pub left_out: Vec<usize>,
    /// False ends, which contradict other scans, with the index of the scan; in the model, the scan's bound on that
    /// side lies far from the object. Set by [`align_consistent`] only.
    pub opened: Vec<(usize, ScanEnd)>,
}

impl Alignment {
    /// Largest error after alignment, metres; above twice the laser's precision, the scans contradict each other.
    pub fn longest_m(&self) -> f64 {
        self.after.exterior_m.max(self.after.interior_m)
    }

    /// True if a scan ended too far from its stated pose; false also if the accuracy of stated poses is unknown.
    fn strays(&self, options: &SolverOptions) -> bool {
        let Objective::Centred { pose_sigma_m, pose_sigma_rad } = options.objective else { return false };
        self.moved.iter().any(|(m, rad)| *m > FAR * pose_sigma_m || rad.abs() > FAR * pose_sigma_rad)
    }
}

/// Minimises the boundary violation over the poses of all scans, starting from the given poses; a single scan keeps its
/// pose.
///
/// # Errors
/// If there is no scan, or one is invalid.
pub fn align(scans: &[PosedScan], options: &SolverOptions) -> Result<Alignment, ShapeError> {
    let _span = tracing::debug_span!("align", scans = scans.len()).entered();
    let model = ShapeModel::new(scans.to_vec())?;
    let unposed: Vec<PosedScan> = scans
        .iter()
        .map(|s| PosedScan { scan: s.scan.clone(), model_from_laser: Isometry2::identity() })
        .collect();
    let assembly = Assembly::new(unposed.iter().map(std::slice::from_ref));
    let start: Vec<Isometry2<f64>> = model.scans().iter().map(|s| s.model_from_laser).collect();
    let solved = solve(&Problem::free(&assembly, &start, options), options);
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
        opened: Vec::new(),
        model: ShapeModel::new(
            unposed
                .into_iter()
                .zip(&solved.poses)
                .map(|(s, pose)| PosedScan { scan: s.scan, model_from_laser: *pose })
                .collect(),
        )?,
    })
}

/// Minimum number of scans for finding a wrong one: two contradict each other, a third decides.
const FEWEST: usize = 3;
/// Maximum displacement of a scan from its stated pose, in standard deviations; beyond it, the
/// stated pose was wrong.
const FAR: f64 = 4.0;
/// Angle from the object to which the bound of a false end is moved, radians; it then constrains nothing.
const OPEN_RAD: f64 = 0.5;

/// Aligns scans of which some may have false ends: if an end of the object was taken for
/// background, the bound lies on the object and contradicts other scans.
///
/// While an error exceeds `longest_m`, scans are aligned with such errors as outliers ([`SolverOptions::outlier_m`]).
/// Ends that at least two other scans contradict are opened (see [`Alignment::opened`]), and scans that contradict at
/// least two ends are left out. All scans are kept, unchanged, if fewer than three scans or no more than half of the
/// scans or ends agree, or if they agree only far from their stated poses; [`Alignment::longest_m`] then shows the
/// contradiction.
///
/// # Errors
/// As [`align`].
pub fn align_consistent(
    scans: &[PosedScan],
    longest_m: f64,
    options: &SolverOptions,
) -> Result<Alignment, ShapeError> {
    let all = align(scans, options)?;
    let mut best = all.clone();
    let mut kept: Vec<(usize, PosedScan)> = scans.iter().cloned().enumerate().collect();
    let mut opened: Vec<(usize, ScanEnd)> = Vec::new();
    while best.longest_m() > longest_m {
        let rest: Vec<PosedScan> = kept.iter().map(|(_, scan)| scan.clone()).collect();
        let found = contradictions(&rest, longest_m, options)?;
        for (at, side) in &found.ends {
            let (index, posed) = &mut kept[*at];
            open(posed, *side);
            opened.push((*index, *side));
        }
        let is_left_out: Vec<usize> = found.scans.iter().map(|&at| kept[at].0).collect();
        kept.retain(|(index, _)| !is_left_out.contains(index));
        opened.retain(|(index, _)| !is_left_out.contains(index));
        let ends = 2 * kept.len() - opened.len();
        let agree = kept.len() >= FEWEST.max(scans.len() / 2 + 1) && ends > scans.len();
        if found.is_none() || !agree {
            return Ok(all);
        }
        best = align(&kept.iter().map(|(_, scan)| scan.clone()).collect::<Vec<_>>(), options)?;
    }
    let is_whole = kept.len() == scans.len() && opened.is_empty();
    if !is_whole && best.strays(options) {
        return Ok(all);
    }
    best.left_out = (0..scans.len()).filter(|i| kept.iter().all(|(index, _)| index != i)).collect();
    best.opened = opened;
    Ok(best)
}

/// Moves the bound of a scan on one side away from the object, so that it constrains nothing.
fn open(posed: &mut PosedScan, side: ScanEnd) {
    let scan = &mut posed.scan;
    let most = |other: f64| (other.abs() - 1e-3).min(OPEN_RAD);
    match side {
        ScanEnd::Left => {
            let room = PI - (scan.left_object_rad - scan.right_bound_rad);
            scan.left_bound_rad = scan.left_object_rad + most(room);
        }
        ScanEnd::Right => {
            let room = PI - (scan.left_bound_rad - scan.right_object_rad);
            scan.right_bound_rad = scan.right_object_rad - most(room);
        }
    }
}

/// False ends and wrong scans, by index of the scan.
#[derive(Default)]
struct Contradictions {
    ends: BTreeSet<(usize, ScanEnd)>,
    scans: BTreeSet<usize>,
}

impl Contradictions {
    fn is_none(&self) -> bool {
        self.ends.is_empty() && self.scans.is_empty()
    }
}

/// Finds contradictions by majority: an end contradicted by two other scans is false; a scan that alone contradicts two
/// ends has false points or lacks some. Without a majority, all contradicted ends are false.
fn contradictions(
    scans: &[PosedScan],
    longest_m: f64,
    options: &SolverOptions,
) -> Result<Contradictions, ShapeError> {
    let robust = align(scans, &SolverOptions { outlier_m: longest_m, ..*options })?;
    let assembly = Assembly::new(robust.model.scans().iter().map(std::slice::from_ref));
    let placed = assembly.placed(&vec![Isometry2::identity(); scans.len()]);
    let mut beyond: BTreeMap<(usize, ScanEnd), BTreeSet<usize>> = BTreeMap::new();
    let mut short: BTreeMap<(usize, ScanEnd), BTreeSet<usize>> = BTreeMap::new();
    assembly.residuals(&placed, 0.0, |r| {
        let of = match r.kind {
            Kind::Exterior => &mut beyond,
            Kind::Interior => &mut short,
            Kind::Slack => return,
        };
        if r.value_m > longest_m {
            of.entry((r.line, r.side)).or_default().insert(r.point);
        }
    });
    let mut found = Contradictions::default();
    found.ends.extend(beyond.iter().filter(|(_, by)| by.len() > 1).map(|(end, _)| *end));
    // A scan of which an end is false lacks what lies there.
    let lacks = |scan: &usize| {
        [ScanEnd::Left, ScanEnd::Right].iter().any(|side| found.ends.contains(&(*scan, *side)))
    };
    short.values_mut().for_each(|by| by.retain(|scan| !lacks(scan)));
    let far: Vec<(usize, ScanEnd)> =
        short.iter().filter(|(_, by)| by.len() > 1).map(|(end, _)| *end).collect();
    found.ends.extend(far);
    let mut accused: BTreeMap<usize, usize> = BTreeMap::new();
    for (_, by) in beyond.iter().chain(&short).filter(|(end, _)| !found.ends.contains(*end)) {
        by.iter().for_each(|scan| *accused.entry(*scan).or_default() += 1);
    }
    found.scans.extend(accused.iter().filter(|(_, times)| **times > 1).map(|(scan, _)| *scan));
    if found.is_none() {
        // One against one: the end goes, which loses less than a scan.
        found.ends.extend(beyond.keys().chain(short.keys().filter(|end| !short[end].is_empty())));
    }
    Ok(found)
}
