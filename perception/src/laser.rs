//! Shape models from a planar laser: scans of one object, aligned by their bounding angles (Modayil
//! and Kuipers, *Autonomous Shape Model Learning for Object Localization and Recognition*).
//!
//! The steps, in order:
//! - [`Scan`], [`observe`]: a scan, and its foreground.
//! - [`ObjectScan`]: one object in a scan.
//! - [`Violation`]: how far poses violate the angular constraints between scans (Eq. 1 to 3).
//! - [`align`], [`align_consistent`] (if some scans may be wrong): the poses with the least violation, which make a
//!   [`ShapeModel`].
//! - [`fit`], [`localise`]: models aligned with each other, and single scans with models (Eq. 4).
//! - [`nearest`] (by features), [`recognise`], [`recognise_scan`] (from one scan): the object's identity.
//! - [`next_scan`]: where to scan from next.

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
