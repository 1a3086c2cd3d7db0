//! The map of a building from a drive with a range camera (Viejo and Cazorla, *Construcción de mapas 3D y extracción de primitivas geométricas
//! del entorno*).
//!
//! The pipeline, a file a step: what the camera saw at each stop of the drive, levelled ([`Station`]), and its plan without floor and ceiling;
//! how two stops in a row lie to each other ([`rectify_pair`]: ICP-EM, Eq. 1 to 3); where the drive came by again ([`closures`]) and all poses
//! together ([`PoseGraph`]), which the paper leaves open.

mod closure;
mod field;
mod graph;
mod pair;
mod station;

pub use closure::{Closure, ClosureOptions, closures, correct_drive};
pub use graph::{Edge, GraphError, PoseGraph, Settled};
pub use pair::{Matcher, PairFit, RectifyOptions, chained, rectify_drive, rectify_pair};
pub use station::{FieldOfView, Station, StationError};
