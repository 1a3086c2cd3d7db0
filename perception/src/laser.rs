//! Shape models from a planar laser: scans of one thing, aligned by the angles that bound it (Modayil and Kuipers, *Autonomous Shape Model
//! Learning for Object Localization and Recognition*).
//!
//! The pipeline, a file a step: [`Scan`]s; what of them is no background ([`observe`]); what one scan says of the thing ([`ObjectScan`]); the
//! violation of its angular constraints (Eq. 1 to 3); poses that violate them least ([`align`]), which makes a [`ShapeModel`]; models brought onto
//! each other and single scans onto models ([`fit`], [`localise`]: Eq. 4); what the thing is ([`recognise`]); where to scan from next ([`next_scan`]).

mod align;
mod background;
mod features;
mod fit;
mod known;
mod least_squares;
mod next;
mod scan;
mod shape;
mod simplex;
mod solve;
mod violation;

pub use align::{AlignError, Alignment, align, align_consistent};
pub use background::{Ignored, Observation, ObserveError, ObserveOptions, Occupancy, Space, observe};
pub use features::{FeatureClass, Features, Nearest, classes, groups, nearest};
pub use fit::{FitOptions, ModelFit, Start, fit, localise};
pub use known::{Candidate, KnownShape, RecogniseOptions, Recognition, Verdict, recognise, recognise_scan};
pub use next::{NextOptions, NextScan, next_scan, undetermined_m2};
pub use scan::{Scan, ScanError};
pub use shape::{ObjectScan, PosedScan, ShapeError, ShapeModel};
pub use solve::{Objective, Solver, SolverOptions};
pub use violation::Violation;
