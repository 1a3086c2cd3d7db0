//! Pixels of recorded frames.

use crate::request::Pixels;

/// Recorded frames, one at each station.
pub trait Footage: Send + Sync {
    /// Pixels of the frame at a station.
    ///
    /// # Errors
    /// The reason for which the frame cannot be read.
    fn pixels(&self, station: usize) -> Result<Pixels, String>;
}
