//! The map of a building from a drive with a range camera (Viejo and Cazorla, *Construcción de mapas 3D y extracción de primitivas geométricas
//! del entorno*).
//!
//! The pipeline, a file a step: what the camera saw at each stop of the drive, levelled ([`Station`]), and its plan without floor and ceiling;
//! how two stops in a row lie to each other ([`rectify_pair`]: ICP-EM, Eq. 1 to 3); where the drive came by again ([`closures`]) and all poses
//! together ([`PoseGraph`]), which the paper leaves open; all points as small pieces of surface ([`Cells`], normals by regions: Eq. 4); the
//! orientations of walls ([`orientations`]: k-means); patches grown and planes put through them ([`PlaneEstimator`], [`Constraints`]) and joined
//! ([`FuseOptions`]); pillars and round walls ([`UprightCylinder`]); the map of walls, level surfaces and open floor ([`Survey`], [`RoomMap`]); where to go next to see more of it ([`next_poses`]).

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
