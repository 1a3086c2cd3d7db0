//! The map of a building from a drive with a range camera (Viejo and Cazorla, *Construcción de mapas 3D y extracción de
//! primitivas geométricas del entorno*).
//!
//! The steps, in order:
//! - [`Station`]: the levelled points of one stop of the drive, and their plan without floor and ceiling.
//! - [`rectify_pair`]: relative pose of two consecutive stations (ICP-EM, Eq. 1 to 3).
//! - [`closures`] and [`PoseGraph`]: loop closures and optimised poses, which the paper leaves open.
//! - [`Cells`]: all points as small surface elements with normals (by regions, Eq. 4).
//! - [`orientations`]: orientations of walls (k-means).
//! - [`PlaneEstimator`], [`Constraints`], [`FuseOptions`]: patches, the planes through them, and joining these planes.
//! - [`UprightCylinder`]: pillars and round walls.
//! - [`Survey`], [`RoomMap`]: the map of walls, level surfaces and open floor.
//! - [`next_poses`]: where to go next to see more of the building.

mod cells;
mod closure;
mod cylinder;
mod error;
#[doc(hidden)]
pub mod frontier;
mod fuse;
#[doc(hidden)]
pub mod graph;
mod grid;
mod likelihood_field;
#[doc(hidden)]
pub mod orientation;
mod outlook;
mod patch;
mod room;
mod scan_matching;
#[doc(hidden)]
pub mod station;

pub use cells::{Cells, CellsError, Facet, NormalOptions, by_regions};
pub use closure::{Closure, ClosureOptions, closures, correct_drive, relocate};
pub use cylinder::{CylinderOptions, UprightCylinder};
pub use error::MappingError;
pub use frontier::{ExploreOptions, Frontier, NextPose, Reach, frontiers, next_poses, standable};
pub use fuse::FuseOptions;
pub use graph::{Edge, GraphError, PoseGraph, Settled};
pub use orientation::{OrientationOptions, Orientations, orientations};
pub use outlook::{Outlook, Unseen, nearest_frontier, outlooks};
pub use patch::{Constraints, PlaneEstimator};
pub use room::{Level, MapOptions, RoomMap, Survey, Wall};
pub use scan_matching::{Matcher, PairFit, RectifyOptions, chained, rectify_drive, rectify_pair};
pub use station::{FieldOfView, Station, StationError};
