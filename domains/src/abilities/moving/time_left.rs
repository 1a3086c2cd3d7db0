//! `(time-left)`: true until the deadline has passed.

use crate::situation::Situation;

pub(super) fn state(situation: &Situation) -> Vec<String> {
    match situation.time_left_s {
        None => vec!["(time-left)".into()],
        Some(s) if s > 0.0 => vec!["(time-left)".into(), format!("(at {s:.3} (not (time-left)))")],
        Some(_) => Vec::new(),
    }
}
