//! Tests of `vocabulary`.

use descry_domains::load::Domain;
use descry_domains::origin;
use descry_domains::vocabulary::*;
use descry_planner::Source;

#[test]
fn every_word_has_its_value_from_somewhere() {
    let pddl = "(define (domain d)
        (:requirements :typing :derived-predicates :numeric-fluents)
        (:types pose person - object poet - person)
        (:constants anna - poet)
        (:predicates (at ?p - pose) (told ?w - person) (shut) (open) (rain) (known ?w - person))
        (:functions (calls ?w - person) (size))
        (:derived (known ?w - person) (told ?w))
        (:action tell :parameters (?w - person) :precondition (open)
          :effect (and (told ?w) (increase (calls ?w) 1))))";
    let mut domain = Domain::load("tabletop").unwrap();
    domain.vocabulary = Vocabulary::read(&Source::new("d.pddl", pddl)).unwrap();
    domain.config.word = toml::from_str("rain.program = [\"sh\"]\nopen.is = \"planned\"").unwrap();
    domain.config.action = toml::from_str("tell.gives_up = [\"(shut)\"]").unwrap();
    let check = |name: &str, expected: &str| {
        let origin = origin::of(&domain, &domain.vocabulary.word(name).unwrap());
        assert!(format!("{origin:?}").starts_with(expected), "{name}: {origin:?}");
    };
    check("at", "Sensed(");
    check("told", "Remembered");
    check("calls", "Remembered");
    check("shut", "Remembered");
    check("open", "Planned");
    check("rain", "SensedByProgram");
    check("size", "Fixed");
    check("known", "Derived");
    let vocabulary = &domain.vocabulary;
    assert!(vocabulary.is_a("poet", "person") && !vocabulary.is_a("person", "poet"));
    assert_eq!(vocabulary.constants("person"), ["anna"]);
    assert_eq!(vocabulary.action("tell"), Some(vec![("?w".to_string(), "person".to_string())]));
}
