//! The objects on a surface, each in one piece.

use crate::surface::Surface;
use serde::{Deserialize, Serialize};

/// One object: points that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Indices into the cloud that was segmented, ascending.
    pub indices: Vec<u32>,
    /// Height of what it stands on above the surface, metres: 0 on the surface itself, more on another object.
    pub base_m: f64,
}

/// A surface with the objects on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// What they stand on.
    pub surface: Surface,
    /// The objects, largest first.
    pub segments: Vec<Segment>,
}
