//! Errors of the search for a surface.

use super::level::Sign;
use super::sample::FARTHEST_M;

/// Reason no surface was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// Too few points to speak of a surface.
    #[error("{found} finite points do not make a surface: at least {needed} are needed")]
    TooFew {
        /// Number of finite points in the cloud.
        found: usize,
        /// Minimum number of points.
        needed: usize,
    },
    /// The points lie where no sensor of a robot measures.
    #[error(
        "{far} of {found} points lie farther than {FARTHEST_M} m from the origin: the coordinates are damaged, or in another unit or order of bytes"
    )]
    TooFar {
        /// Number of finite points in the cloud.
        found: usize,
        /// Number of points that are out of range.
        far: usize,
    },
    /// No plane is as requested.
    #[error("{}: widen the height band, give or check the direction of up, or look at the table", no_plane(wanted, *tried))]
    NotFound {
        /// Number of planes examined.
        tried: usize,
        /// The wanted surface, in words.
        wanted: String,
    },
    /// The up direction is ambiguous, or nothing level is in view.
    #[error(
        "which way is up cannot be told from what is in view: say which way is up, or look at the table with what stands on it"
    )]
    UpUntold,
    /// Every surface that is as wanted is the floor.
    #[error(
        "all that is level here is the floor ({because}): look at the table, or give the height band that it is in"
    )]
    OnlyFloor {
        /// Evidence that the surface is the floor.
        because: Sign,
    },
    /// None of the requested surfaces is a support.
    #[error("what is level here is nothing to stand things on ({because}): look at the table")]
    OnlyOther {
        /// Evidence that the surface is no support.
        because: Sign,
    },
}

fn no_plane(wanted: &str, tried: usize) -> String {
    match tried {
        0 => format!("no plane {wanted}, and no other that is level"),
        _ => format!("no plane {wanted} among the {tried} largest"),
    }
}
