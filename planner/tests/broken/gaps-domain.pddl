(define (domain kitchen)
  (:requirements :strips :typing :fluents)
  (:types dish place)
  (:predicates (on ?d - dish ?p - place) (clean ?d - dish) (broken ?d - dish))
  (:functions (water) (weight ?d - dish) (heat ?p - place) (soap))

  (:action wash
    :parameters (?d - dish ?p - place)
    :precondition (and (on ?d ?p) (not (clean ?d)) (or (on ?d ?p) (clean ?d)) (>= (heat ?p) 1) (>= (water) 1))
    :effect (and (clean ?d) (decrease (water) 1))))
