//! Tests of `load::names`.

use descry_domains::load::error::LoadError;
use descry_domains::load::{Files, parse_objects};

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
                let place =
                    &findings.sources[span.source as usize].text[span.start as usize..span.end as usize];
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
    check(&[a, b, &called("and")], Some(("\"and\"", "is a word of sentences")));
    check(&[a, b, &called("b\\u0007x")], Some(("\"b\\u0007x\"", "cannot be shown")));
    // The only one of a kind may be called like it.
    check(&[a, "name = \"mug\"\nkind = \"mug\"", &called("tin can")], None);
    check(
        &["name = \"mug\"\nkind = \"mug\"", "name = \"big mug\"\nkind = \"mug\""],
        Some(("\"mug\"", "\"big mug\" is of it")),
    );
}

#[test]
fn every_wrong_measure_is_shown_in_its_file() {
    let file = |n: usize, measures: &str| {
        let path = format!("objects/{n}.toml");
        (path.clone(), (path, format!("name = \"thing {n}\"\nkind = \"thing\"\n{measures}\n")))
    };
    let files: Files = [
        file(0, "height_m = 0.1\ndiameter_m = 0.07"),
        file(1, "height_m = 95\ndiameter_m = 80"),
        file(2, "height_m = 0.1"),
    ]
    .into();
    let Err(LoadError::Findings { findings }) = parse_objects(&files) else { panic!("nothing is found") };
    let at = |n: usize| {
        let span = findings.list[n].labels[0].span;
        let source = &findings.sources[span.source as usize];
        (source.name.as_str(), &source.text[span.start as usize..span.end as usize])
    };
    assert_eq!(findings.list.len(), 2, "{findings}");
    assert_eq!([at(0), at(1)], [("objects/1.toml", "80"), ("objects/2.toml", "\"thing 2\"")], "{findings}");
}
