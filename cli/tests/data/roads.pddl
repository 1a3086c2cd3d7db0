; Three places and a van; what a road costs is asked of a program.
(define (domain roads)
  (:requirements :typing :equality :durative-actions :modules)
  (:types van place)
  (:modules (path-cost ?from ?to - place cost path_cost@roads))
  (:predicates (at ?v - van ?where - place) (washed ?v - van))
  (:durative-action drive
    :parameters (?v - van ?from ?to - place)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and (at start (at ?v ?from)) (at start (not (= ?from ?to))))
    :effect (and (at start (not (at ?v ?from))) (at end (at ?v ?to)))))
