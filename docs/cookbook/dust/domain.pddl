; A robot with two senses of its own: a nose for dust and a thermometer, both behind programs.

(define (domain dust)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions
                 :durative-actions :numeric-fluents :modules)

  (:types pose surface)

  (:modules
    (path-cost ?from ?to - pose             cost             path_cost@descry)
    (can-see ?from - pose ?on - surface     conditionchecker can_see@descry))

  (:predicates
    (at ?where - pose)              ; where the robot stands
    (out-of-reach ?where - pose)    ; a drive there has failed for good
    (sniffed ?on - surface)         ; the nose was held over it
    (dusty ?on - surface)           ; stated by senses.py, once it was sniffed
    (felt ?on - surface))           ; the thermometer was held to it

  (:functions
    (warmth ?on - surface))         ; degrees, stated by senses.py, once it was felt

  (:durative-action move
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and
      (at start (at ?from))
      (at start (not (= ?from ?to)))
      (at start (not (out-of-reach ?to))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  ; The effect names the word that the action finds out. Whether it holds, the program says.
  (:durative-action sniff
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 5)
    :condition (and
      (over all (at ?from))
      (at start ([can-see ?from ?on]))
      (at start (not (sniffed ?on))))
    :effect (and
      (at end (sniffed ?on))
      (at end (dusty ?on))))

  ; The same for a number: any value will do.
  (:durative-action feel
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 3)
    :condition (and
      (over all (at ?from))
      (at start ([can-see ?from ?on]))
      (at start (not (felt ?on))))
    :effect (and
      (at end (felt ?on))
      (at end (assign (warmth ?on) 20)))))
