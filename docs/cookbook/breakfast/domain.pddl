; Two things at once: while the kettle boils, there are hands for the toast.
(define (domain breakfast)
  (:requirements :typing :durative-actions)
  (:types bread tea - dish)
  (:predicates (hands-free) (hot-water) (ready ?d - dish))
  (:durative-action boil
    :parameters ()
    :duration (= ?duration 180)
    :condition (at start (hands-free))
    :effect (at end (hot-water)))
  (:durative-action toast
    :parameters (?d - bread)
    :duration (= ?duration 90)
    :condition (at start (hands-free))
    :effect (and (at start (not (hands-free))) (at end (hands-free)) (at end (ready ?d))))
  (:durative-action brew
    :parameters (?d - tea)
    :duration (= ?duration 60)
    :condition (and (at start (hot-water)) (at start (hands-free)))
    :effect (and (at start (not (hands-free))) (at end (hands-free)) (at end (ready ?d)))))
