; What the robot can do: it drives, looks, takes one vessel, and pours what is in it into another one.

(define (domain pour)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions :existential-preconditions
                 :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand and look from
    surface     ; a table
    thing)      ; a vessel

  (:modules
    (path-cost ?from ?to - pose                                    cost             path_cost@descry)
    (can-see ?from - pose ?on - surface                            conditionchecker can_see@descry)
    (worth-a-look ?from - pose ?on - surface                       conditionchecker worth_a_look@descry)
    (expected-presence ?from - pose ?on - surface ?what - thing    cost             expected_presence@descry)
    (can-grasp ?from - pose ?what - thing ?on - surface            conditionchecker can_grasp@descry)
    (can-pour ?from - pose ?what ?into - thing ?on - surface       conditionchecker can_pour@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (observed ?from - pose ?on - surface)       ; this look has been taken
    (on ?what - thing ?on - surface)            ; it surely stands there
    (hand-free)
    (holding ?what - thing)
    (slippery ?what - thing)                    ; it could not be taken
    (poured ?what ?into - thing)                ; this run has emptied it into the other one
    (spilt ?what ?into - thing)                 ; this run has tried to, and it went wrong
    (filled ?what - thing))                     ; there is surely something in it

  (:functions
    (presence ?what - thing ?on - surface)      ; how sure it is that it stands on that surface, 0 to 1
    (level ?what - thing)                       ; litres in it, where they are known
    (sure))                                     ; the confidence that was asked for

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

  ; While it looks or works, the robot stands nowhere in particular, so that it does not drive away.
  (:durative-action observe
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 2)
    :condition (and
      (at start (at ?from))
      (at start (hand-free))
      (at start (not (observed ?from ?on)))
      (at start ([can-see ?from ?on]))
      (at start ([worth-a-look ?from ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (observed ?from ?on))
      (forall (?what - thing)
        (at end (increase (presence ?what ?on) [expected-presence ?from ?on ?what])))))

  (:durative-action pick-up
    :parameters (?from - pose ?what - thing ?on - surface)
    :duration (= ?duration 8)
    :condition (and
      (at start (at ?from))
      (at start (hand-free))
      (at start (not (slippery ?what)))
      (at start (>= (presence ?what ?on) (sure)))
      (at start ([can-grasp ?from ?what ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at start (not (hand-free)))
      (at end (holding ?what))
      (at end (not (on ?what ?on)))
      (at end (assign (presence ?what ?on) 0))))

  (:durative-action pour
    :parameters (?from - pose ?what ?into - thing ?on - surface)
    :duration (= ?duration 10)
    :condition (and
      (at start (at ?from))
      (at start (holding ?what))
      (at start (not (= ?what ?into)))
      (at start (not (spilt ?what ?into)))
      (at start (>= (presence ?into ?on) (sure)))
      (at start ([can-pour ?from ?what ?into ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (poured ?what ?into))
      (at end (filled ?into))
      (at end (not (filled ?what))))))
