//! Shape models from a planar laser: scans of one object, aligned by their bounding angles (Modayil
//! and Kuipers, *Autonomous Shape Model Learning for Object Localization and Recognition*).
//!
//! The pipeline, a file a step: a [`Scan`]; what of it is no background ([`observe`]); what it says of the thing ([`ObjectScan`]); how far poses violate
//! the angular constraints between scans ([`Violation`]: Eq. 1 to 3); poses that do so least ([`align`], or [`align_consistent`] where some scans may be
//! wrong), which make a [`ShapeModel`]; models brought onto each other and single scans onto models ([`fit`], [`localise`]: Eq. 4); what the thing is
//! ([`nearest`] by features, [`recognise`], and [`recognise_scan`] from one scan); where to scan from next ([`next_scan`]).

mod align;
mod background;
mod features;
mod fit;
mod known;
#[doc(hidden)]
pub mod least_squares;
mod next;
mod scan;
#[doc(hidden)]
pub mod shape;
#[doc(hidden)]
pub mod simplex;
#[doc(hidden)]
pub mod solve;
#[doc(hidden)]
pub mod violation;

pub use crate::occupancy::{Occupancy, Space};
pub use align::{Alignment, align, align_consistent};
pub use background::{Cluster, Ignored, Observation, ObserveError, ObserveOptions, observe, things};
pub use features::{FeatureClass, HullFeatures, Nearest, classes, groups, nearest};
pub use fit::{FitOptions, ModelFit, Start, fit, fit_scans, localise};
pub use known::{
    KnownShape, RecogniseOptions, Recognition, ShapeCandidate, Verdict, recognise, recognise_scan,
    recognise_scans,
};
pub use next::{NextOptions, NextScan, ScanGain, next_scan, undetermined_m2};
pub use scan::{Scan, ScanError};
pub use shape::{ObjectScan, PosedScan, ShapeError, ShapeModel};
pub use solve::{Objective, Solver, SolverOptions};
pub use violation::{ScanEnd, Violation};
