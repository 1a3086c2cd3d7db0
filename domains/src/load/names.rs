//! Checks of object names: a name means one object, or one kind of them. Letters and digits alone distinguish
//! names.

use descry_perception::recognise::ObjectModel;
use descry_planner::{Diagnostic, Findings, Source, Span};

use super::LoadError;
use crate::check::place::Places;
use crate::lexicon::{plural, symbol};

/// An object's file and what it says.
pub(super) type Read<'a> = (&'a (String, String), ObjectModel);

/// Checks that every name means one thing.
///
/// # Errors
/// [`LoadError::Findings`] points at a name that means another object, or a kind of several, too.
pub fn check(objects: &[Read<'_>]) -> Result<(), LoadError> {
    for (n, (file, object)) in objects.iter().enumerate() {
        for (key, name) in names(object) {
            let because = if symbol(name).is_empty() {
                Some((
                    format!("\"{name}\" has neither a letter nor a digit"),
                    "names are told apart by these".to_string(),
                ))
            } else {
                another(&objects[..n], name).or_else(|| several(objects, n, name))
            };
            if let Some((message, help)) = because {
                return Err(told(file, &key, message, help));
            }
        }
    }
    Ok(())
}

/// The names of an object, each with where it stands in its file.
fn names(object: &ObjectModel) -> impl Iterator<Item = (Vec<String>, &String)> {
    let phrases = object.phrases.iter().enumerate();
    let phrases = phrases.map(|(n, phrase)| (vec!["phrases".to_string(), n.to_string()], phrase));
    std::iter::once((vec!["name".to_string()], &object.name)).chain(phrases)
}

/// Fault of a name that means another object.
fn another(others: &[Read<'_>], name: &str) -> Option<(String, String)> {
    let is_called = |(_, other): &&Read<'_>| names(other).any(|(_, called)| symbol(called) == symbol(name));
    let (file, other) = others.iter().find(is_called)?;
    let message = format!("\"{name}\" means the object \"{}\" already", other.name);
    Some((
        message,
        format!("give it another name: that one is of {}; letters and digits alone tell names apart", file.0),
    ))
}

/// Fault of a name that is that of a kind with other members.
fn several(objects: &[Read<'_>], own: usize, name: &str) -> Option<(String, String)> {
    let others = objects.iter().enumerate().filter(|(n, _)| *n != own).map(|(_, (_, other))| other);
    let other = others.into_iter().find(|other| symbol(&other.kind) == symbol(name))?;
    let message = format!("\"{name}\" means a kind: \"{}\" is of it, too", other.name);
    Some((
        message,
        format!(
            "give it a name of its own, such as \"first {name}\"; what is asked of all {} is asked of the kind",
            plural(name)
        ),
    ))
}

fn told((path, text): &(String, String), key: &[String], message: String, help: String) -> LoadError {
    let key: Vec<&str> = key.iter().map(String::as_str).collect();
    let place = Span { source: 0, ..Places::of(text).at(&key) };
    let list = vec![Diagnostic::error("same-name", message, place, "this name").with_help(help)];
    LoadError::Findings {
        findings: Findings { sources: vec![Source::new(path.clone(), text.clone())], list },
    }
}
