; A market that opens late and closes early: timed initial literals say when.
(define (domain market)
  (:requirements :typing :equality :negative-preconditions :durative-actions :timed-initial-literals)
  (:types place)
  (:predicates (at ?p - place) (open ?p - place) (bought ?p - place))
  (:durative-action walk
    :parameters (?a ?b - place)
    :duration (= ?duration 15)
    :condition (and (at start (at ?a)) (at start (not (= ?a ?b))))
    :effect (and (at start (not (at ?a))) (at end (at ?b))))
  (:durative-action buy
    :parameters (?p - place)
    :duration (= ?duration 10)
    :condition (and (over all (at ?p)) (over all (open ?p)))
    :effect (at end (bought ?p))))
