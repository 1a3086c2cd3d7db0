(define (domain heating)
  (:requirements :typing :durative-actions :numeric-fluents :continuous-effects)
  (:types room)
  (:predicates (cold ?r - room))
  (:functions (warmth ?r - room) (power ?r - room))

  (:durative-action heat
    :parameters (?r - room)
    :duration (= ?duration 10)
    :condition (at start (cold ?r))
    :effect (and (at end (not (cold ?r)))
                 (increase (power ?r) (* #t 2))
                 (increase (warmth ?r) (* #t (power ?r))))))
