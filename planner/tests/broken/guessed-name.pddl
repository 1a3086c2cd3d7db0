(define (domain tower)
  (:requirements :typing)
  (:types block)
  (:predicates (on ?x ?y - block))
  (:action lift
    :parameters (?x - block)
    :effect (and (om ?x))))
