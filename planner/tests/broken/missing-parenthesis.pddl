(define (domain kitchen)
  (:requirements :typing :negative-preconditions)
  (:types cup plate - dish  place)
  (:predicates
    (on ?d - dish ?p - place)
    (holding ?d - dish)
    (hand-free)
    (clean ?d - dish))

  (:action take
    :parameters (?d - dish ?p - place)
    :precondition (and (on ?d ?p) (hand-free)
    :effect (and (holding ?d) (not (on ?d ?p)) (not (hand-free))))

  (:action put
    :parameters (?d - dish ?p - place)
    :precondition (holding ?d)
    :effect (and (on ?d ?p) (hand-free) (not (holding ?d))))

  (:action wash
    :parameters (?d - dish)
    :precondition (and (holding ?d) (not (clean ?d)))
    :effect (clean ?d)))
