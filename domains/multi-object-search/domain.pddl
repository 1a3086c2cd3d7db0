; Five things lie somewhere in a household of five places; each belongs somewhere. One robot searches, takes and places them.
;
; What is where is known only after a place was searched. A search is planned for one thing, as if that were there, and takes as
; much longer as it is likely to be in vain; it shows everything that lies there, and then there is a new plan.

(define (domain multi-object-search)
  (:requirements :typing :negative-preconditions :durative-actions :numeric-fluents :modules)

  (:types location item)

  (:constants
    start living-room kitchen bedroom office - location
    knife notebook clock mug pillow          - item)

  (:modules
    (way ?from ?to - location                       cost way@world)
    (search-time ?what - item ?where - location     cost search_time@world))

  (:predicates
    (stands ?where - location)
    (hand-free)
    (holding ?what - item)
    (searched ?where - location)
    (located ?what - item ?where - location)        ; stated by world.py: it was seen there
    (could-be ?what - item ?where - location))      ; stated by world.py: it has not been seen, and there nobody has looked

  (:functions (clock-s))                            ; stated by world.py

  (:durative-action move
    :parameters (?from ?to - location)
    :duration (= ?duration [way ?from ?to])
    :condition (and (at start (stands ?from)) (at start (not (= ?from ?to))))
    :effect (and (at start (not (stands ?from))) (at end (stands ?to))))

  (:durative-action search
    :parameters (?what - item ?where - location)
    :duration (= ?duration [search-time ?what ?where])
    :condition (and
      (at start (stands ?where))
      (at start (could-be ?what ?where)))
    :effect (and
      (at start (not (stands ?where)))
      (at end (stands ?where))
      (at end (searched ?where))
      (at end (not (could-be ?what ?where)))
      (at end (located ?what ?where))))

  (:durative-action pick
    :parameters (?what - item ?where - location)
    :duration (= ?duration 5)
    :condition (and
      (at start (stands ?where))
      (at start (hand-free))
      (at start (located ?what ?where)))
    :effect (and
      (at start (not (stands ?where)))
      (at end (stands ?where))
      (at start (not (hand-free)))
      (at end (not (located ?what ?where)))
      (at end (holding ?what))))

  (:durative-action place
    :parameters (?what - item ?where - location)
    :duration (= ?duration 5)
    :condition (and
      (at start (stands ?where))
      (at start (holding ?what)))
    :effect (and
      (at start (not (stands ?where)))
      (at end (stands ?where))
      (at end (not (holding ?what)))
      (at end (hand-free))
      (at end (located ?what ?where)))))
