(define (domain kitchen)
  (:requirements :adl :fluents :object-fluents :derived-predicates :modules :preferences :constraints)
  (:types dish place person)
  (:modules (reachable ?p - place conditionchecker reachable@libkitchen.so))
  (:constants ann bob - person  table - place)
  (:predicates (on ?d - dish ?p - place) (held ?d - dish) (left) (right) (tidy))
  (:functions (height ?p - place) (weight ?d - dish) (load) (total-cost) (mood) - number (owner ?d - dish) - person)

  (:derived (tidy) (forall (?d - dish) (exists (?p - place) (and (on ?d ?p) (< (height ?p) 2) (not (= ?p table))))))

  (:action take
    :parameters (?d - dish ?p - place)
    :precondition (and (on ?d ?p) (forall (?o - dish) (not (held ?o))))
    :effect (and (held ?d) (not (on ?d ?p)) (increase (total-cost) 1)))

  (:action put
    :parameters (?d - dish ?p - place)
    :precondition (and (held ?d) ([reachable ?p]))
    :effect (and (on ?d ?p) (not (held ?d)) (increase (total-cost) 1)))

  (:action give
    :parameters (?d - dish ?to - person)
    :precondition (not (= (owner ?d) ?to))
    :effect (assign (owner ?d) ?to))

  (:action lift
    :parameters (?d - dish)
    :precondition (<= (+ (load) (weight ?d)) 8)
    :effect (increase (load) (weight ?d)))

  (:action wobble
    :parameters (?p - place)
    :effect (scale-up (height ?p) 3))

  (:action ask
    :parameters ()
    :effect (increase (mood) 1))

  (:action swap
    :parameters ()
    :effect (and (when (left) (and (right) (not (left)))) (when (right) (and (left) (not (right)))))))
