//! What objects are called: a name means one object, or one kind of them. Letters and digits alone tell names apart.

use descry_perception::recognise::ObjectModel;
use descry_planner::{Diagnostic, Findings, Source, Span};

use super::LoadError;
use crate::check::place::Places;
use crate::lexicon::{plural, symbol};

/// An object's file and what it says.
pub(super) type Read<'a> = (&'a (String, String), ObjectModel);

/// Whether every name means one thing.
///
/// # Errors
/// [`LoadError::Findings`] points at a name that means another object, or a kind of several, too.
pub(super) fn check(objects: &[Read<'_>]) -> Result<(), LoadError> {
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

/// That a name means another object.
fn another(others: &[Read<'_>], name: &str) -> Option<(String, String)> {
    let is_called = |(_, other): &&Read<'_>| names(other).any(|(_, called)| symbol(called) == symbol(name));
    let (file, other) = others.iter().find(is_called)?;
    let message = format!("\"{name}\" means the object \"{}\" already", other.name);
    Some((
        message,
        format!("give it another name: that one is of {}; letters and digits alone tell names apart", file.0),
    ))
}

/// That a name is that of a kind of which there are others.
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

#[cfg(test)]
mod tests {
    use super::super::{Files, LoadError, parse_objects};

    #[test]
    fn a_name_means_one_thing() {
        let check = |objects: &[&str], expected: Option<(&str, &str)>| {
            let file = |(n, said): (usize, &&str)| {
                let path = format!("objects/{n}.toml");
                let text =
                    format!("{said}\nheight_m = 0.1\ndiameter_m = 0.07\ntop = \"open\"\nhandle = \"none\"\n");
                (path.clone(), (path, text))
            };
            let files: Files = objects.iter().enumerate().map(file).collect();
            let found = match parse_objects(&files) {
                Ok(_) => None,
                Err(LoadError::Findings { findings }) => {
                    let span = findings.list[0].labels[0].span;
                    let place = &findings.sources[0].text[span.start as usize..span.end as usize];
                    Some((place.to_string(), findings.to_string()))
                }
                Err(other) => panic!("{objects:?}: {other}"),
            };
            let as_said = found.as_ref().map(|(place, _)| place.as_str()) == expected.map(|(place, _)| place);
            let says =
                expected.is_none_or(|(_, says)| found.as_ref().is_some_and(|(_, text)| text.contains(says)));
            assert!(as_said && says, "{objects:?}: {found:?}");
        };
        let (a, b) = ("name = \"cup A\"\nkind = \"cup\"", "name = \"cup B\"\nkind = \"cup\"");
        check(&[a, b], None);
        check(&[a, "name = \"cup-a\"\nkind = \"cup\""], Some(("\"cup-a\"", "means the object \"cup A\"")));
        check(&[a, "name = \"Cup a\"\nkind = \"tin\""], Some(("\"Cup a\"", "objects/0.toml")));
        let called = |name: &str| format!("name = \"tin\"\nkind = \"tin\"\nphrases = [\"box\", \"{name}\"]");
        check(&[a, b, &called("cup b")], Some(("\"cup b\"", "\"cup B\"")));
        check(&[a, b, &called("cup")], Some(("\"cup\"", "means a kind")));
        check(&[a, b, &called("!!")], Some(("\"!!\"", "neither a letter nor a digit")));
        // The only one of a kind may be called like it.
        check(&[a, "name = \"mug\"\nkind = \"mug\"", &called("tin can")], None);
        check(
            &["name = \"mug\"\nkind = \"mug\"", "name = \"big mug\"\nkind = \"mug\""],
            Some(("\"mug\"", "\"big mug\" is of it")),
        );
    }
}
