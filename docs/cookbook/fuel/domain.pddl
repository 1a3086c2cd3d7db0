; A van that must not run dry: numbers in conditions and effects, and a metric.
(define (domain fuel)
  (:requirements :typing :numeric-fluents)
  (:types place)
  (:predicates (at ?p - place) (road ?a ?b - place) (pump ?p - place))
  (:functions (litres) (needs ?a ?b - place) (spent))
  (:action drive
    :parameters (?a ?b - place)
    :precondition (and (at ?a) (road ?a ?b) (>= (litres) (needs ?a ?b)))
    :effect (and (not (at ?a)) (at ?b) (decrease (litres) (needs ?a ?b))))
  (:action refuel
    :parameters (?p - place)
    :precondition (and (at ?p) (pump ?p))
    :effect (and (assign (litres) 40) (increase (spent) 55))))
