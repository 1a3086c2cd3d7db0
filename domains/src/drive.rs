//! Handling of finished drives.

use descry_skills::Outcome;

use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::mind::Mind;
use crate::note::Note;
use crate::situation::Situation;

/// Handles a finished drive: the body is at its destination.
pub(crate) fn has_driven(
    mind: &mut Mind,
    _: Eyes<'_>,
    situation: &Situation,
    arguments: &[&str],
    outcome: &Outcome,
    _: &mut Vec<Note>,
) -> Result<String, WorldError> {
    let Outcome::Driven(driven) = outcome else { return Err(WorldError::strange(outcome)) };
    let to = situation.candidate(arguments[1]).map_err(|e| WorldError::Bug(e.to_string()))?;
    mind.known.at = to;
    mind.known.has_moved();
    mind.distance_m += driven.distance_m;
    Ok(format!("drove {:.2} m in {:.1} s", driven.distance_m, driven.duration_s))
}
