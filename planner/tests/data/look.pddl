(define (domain look)
  (:requirements :strips :typing :durative-actions :numeric-fluents :modules)
  (:types pose surface thing)
  (:modules
    (path-cost ?from ?to - pose cost path_cost@nav.so)
    (can-see ?p - pose ?s - surface conditionchecker can_see@view.so)
    (expected ?p - pose ?o - thing (confidence ?o) effect expected_confidence@view.so))
  (:predicates (at-pose ?p - pose) (observed ?p - pose ?s - surface) (on ?o - thing ?s - surface))
  (:functions (confidence ?o - thing))

  (:durative-action move
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and (at start (at-pose ?from)) (at start (not (= ?from ?to))))
    :effect (and (at start (not (at-pose ?from))) (at end (at-pose ?to))))

  (:durative-action observe
    :parameters (?p - pose ?s - surface ?o - thing)
    :duration (= ?duration 2)
    :condition (and (over all (at-pose ?p)) (at start (on ?o ?s)) (at start (not (observed ?p ?s)))
                    (at start ([can-see ?p ?s])))
    :effect (and (at end (observed ?p ?s)) (at end ([expected ?p ?o]))))
)
