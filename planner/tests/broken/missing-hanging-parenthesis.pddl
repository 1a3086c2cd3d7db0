; What is in it hangs below the line in which `(and` opens, left of that sign; a name is misspelt besides.
(define (domain hanging)
  (:requirements :strips :typing)
  (:types place)
  (:predicates
    (at ?p - place)
    (road ?a ?b - place))
  (:action go
    :parameters (?a ?b - place)
    :precondition (and
      (at ?a)
      (raod ?a ?b)
    :effect (and
      (not (at ?a))
      (at ?b))))
