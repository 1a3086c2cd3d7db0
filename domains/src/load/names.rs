//! Checks of object files: names are unambiguous (only letters and digits distinguish) and bodies
//! have plausible sizes.

use descry_perception::recognise::{ModelError, ObjectModel};
use descry_planner::{Diagnostic, Findings, Source, Span};

use crate::english::{is_function_word, plural};
use crate::load::error::LoadError;
use crate::symbol::symbol;
use crate::toml_place::TomlPlaces;

/// Object file (name for errors, and text) and its parsed model.
pub(super) type Read<'a> = (&'a (String, String), ObjectModel);

/// Checks the objects of a folder: every name can be spoken and is unambiguous, and every body has
/// a plausible size.
///
/// # Errors
/// [`LoadError::Findings`] points at everything that is wrong, file by file.
pub fn check(objects: &[Read<'_>]) -> Result<(), LoadError> {
    let mut list = Vec::new();
    for (n, ((_, text), object)) in objects.iter().enumerate() {
        let place = |key: &[&str]| Span { source: n as u32, ..TomlPlaces::of(text).at(key) };
        for (key, name) in names(object) {
            let fault = unsayable(name)
                .or_else(|| another(&objects[..n], name))
                .or_else(|| several(objects, n, name));
            if let Some((message, help)) = fault {
                let key: Vec<&str> = key.iter().map(String::as_str).collect();
                list.push(Diagnostic::error("same-name", message, place(&key), "this name").with_help(help));
            }
        }
        if let Some((message, help)) = unsayable(&object.kind) {
            list.push(Diagnostic::error("same-name", message, place(&["kind"]), "this kind").with_help(help));
        }
        if let Err(fault) = object.check() {
            let key = match &fault {
                ModelError::Range { field, .. } => field,
                ModelError::Missing { .. } | ModelError::Twice { .. } => "name",
            };
            let message = fault.to_string();
            list.push(Diagnostic::error("no-measure", message, place(&[key]), "here"));
        }
    }
    if list.is_empty() {
        return Ok(());
    }
    let sources = objects.iter().map(|((path, text), _)| Source::new(path.clone(), text.clone())).collect();
    Err(LoadError::Findings { findings: Findings { sources, list } })
}

/// Fault of a name that no sentence can contain.
fn unsayable(name: &str) -> Option<(String, String)> {
    let shown = name.escape_debug();
    if name.chars().any(char::is_control) {
        let message = format!("\"{shown}\" holds a sign that cannot be shown");
        return Some((message, "write it in letters, digits and spaces".into()));
    }
    if symbol(name).is_empty() {
        let message = format!("\"{shown}\" has neither a letter nor a digit");
        return Some((message, "names are told apart by these".into()));
    }
    let message = || format!("\"{shown}\" is a word of sentences, so no sentence can speak of it");
    is_function_word(name).then(|| (message(), "give it the name of a thing".into()))
}

/// Names of an object, each with its key path in the file.
fn names(object: &ObjectModel) -> impl Iterator<Item = (Vec<String>, &String)> {
    let phrases = object.phrases.iter().enumerate();
    let phrases = phrases.map(|(n, phrase)| (vec!["phrases".to_string(), n.to_string()], phrase));
    std::iter::once((vec!["name".to_string()], &object.name)).chain(phrases)
}

/// Fault of a name that already means another object.
fn another(others: &[Read<'_>], name: &str) -> Option<(String, String)> {
    let is_called = |(_, other): &&Read<'_>| names(other).any(|(_, called)| symbol(called) == symbol(name));
    let (file, other) = others.iter().find(is_called)?;
    let message = format!("\"{name}\" means the object \"{}\" already", other.name);
    Some((
        message,
        format!("give it another name: that one is of {}; letters and digits alone tell names apart", file.0),
    ))
}

/// Fault of a name that is also a kind with other members.
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
