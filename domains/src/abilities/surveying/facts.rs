//! Predicates and functions whose values *surveying* states.

use crate::ability::Fact;
use crate::situation::Situation;

/// All facts of *surveying*.
pub(super) const ALL: &[Fact] = &[
    Fact {
        name: "outlook",
        types: &["pose"],
        about: "a look from there would show floor that is not known yet",
        states: outlook,
        bounds: None,
    },
    Fact {
        name: "unseen",
        types: &[],
        about: "floor that is unknown and expected to be seen from somewhere, square metres",
        states: unseen,
        bounds: None,
    },
];

fn outlook(s: &Situation) -> Vec<String> {
    if s.chart().map.is_none() {
        return vec![format!("(outlook {})", s.candidates[s.at].symbol)];
    }
    s.chart().open.iter().map(|(symbol, _)| format!("(outlook {symbol})")).collect()
}

fn unseen(s: &Situation) -> Vec<String> {
    vec![format!("(= (unseen) {:.4})", s.chart().unseen_m2())]
}
