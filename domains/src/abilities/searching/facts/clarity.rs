//! `(clarity ?on)`: how sure it is what each object on a surface is, and that none is hidden.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    let fluent =
        |on: usize| format!("(= (clarity {}) {:.6})", situation.surfaces[on].symbol, situation.clarity(on));
    (0..situation.surfaces.len()).map(fluent).collect()
}
