(define (domain cooking)
  (:requirements :typing :durative-actions :duration-inequalities)
  (:types pot)
  (:predicates (cold ?p - pot) (hot ?p - pot) (watched ?p - pot))

  (:durative-action heat
    :parameters (?p - pot)
    :duration (and (>= ?duration 9) (<= ?duration 3))
    :condition (and (at start (cold ?p)) (watched ?p))
    :effect (and (at start (not (cold ?p))) (over all (watched ?p)) (hot ?p)))

  (:durative-action cool
    :parameters (?p - pot)
    :condition (at start (hot ?p))
    :effect (and (at start (not (hot ?p))) (at end (cold ?p)))))
