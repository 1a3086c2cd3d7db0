; A van whose battery a program reckons.
(define (domain courier)
  (:requirements :typing :numeric-fluents :modules)
  (:types place)
  (:modules (drain ?from ?to - place (battery) effect drain_battery@courier))
  (:predicates (at ?p - place) (road ?from ?to - place))
  (:functions (battery) - number)
  (:action drive
    :parameters (?from ?to - place)
    :precondition (and (at ?from) (road ?from ?to) (>= (battery) 1))
    :effect (and (not (at ?from)) (at ?to) ([drain ?from ?to]))))
