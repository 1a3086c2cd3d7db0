//! Checks common to all parts of a scene: lengths, numbers, names.

use crate::input::{Objection, Step};

pub(super) fn object(path: &[Step], problem: String, mend: String) -> Objection {
    Objection { path: path.to_vec(), problem, mend }
}

pub(super) fn positive(values: &[f64], path: &[Step]) -> Result<(), Objection> {
    match values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
        Some(v) => Err(object(
            path,
            format!("found {v}, expected a length above zero"),
            "metres, such as 0.1".into(),
        )),
        None => Ok(()),
    }
}

pub(super) fn finite(values: &[f64], path: &[Step]) -> Result<(), Objection> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(object(path, format!("found {v}, expected a number"), "a finite number".into())),
        None => Ok(()),
    }
}

/// Checks that a name is neither empty nor used earlier.
pub(super) fn unique<'a>(
    what: &str,
    name: &str,
    earlier: impl IntoIterator<Item = &'a str>,
    path: &[Step],
) -> Result<(), Objection> {
    if name.trim().is_empty() {
        return Err(object(path, format!("a {what} without a name"), "name = \"…\"".into()));
    }
    if earlier.into_iter().any(|other| other == name) {
        return Err(object(
            path,
            format!("a second {what} is called \"{name}\""),
            "give each its own name".into(),
        ));
    }
    Ok(())
}
