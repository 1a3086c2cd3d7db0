; What the robot can do, in PDDL: it drives somewhere, and it looks at a surface.
;
; Every word here has its value from somewhere: `descry check` says from where. What geometry knows is asked of it through
; calls in square brackets.

(define (domain new-domain)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions
                 :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand and look from
    surface     ; a table
    thing)      ; a known object that is being looked for

  (:modules
    (path-cost ?from ?to - pose                             cost             path_cost@descry)
    (can-see ?from - pose ?on - surface                     conditionchecker can_see@descry)
    (worth-a-look ?from - pose ?on - surface                conditionchecker worth_a_look@descry)
    (expected-gain ?from - pose ?on - surface ?what - thing cost             expected_gain@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (observed ?from - pose ?on - surface)       ; this look has been taken
    (on ?what - thing ?on - surface)            ; it surely stands there
    (time-left))                                ; the deadline of the goal, if it has one, has not passed

  (:functions
    (confidence ?what - thing))                 ; how sure it is where the thing stands, 0 to 1

  (:durative-action move
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and
      (at start (at ?from))
      (at start (not (= ?from ?to)))
      (at start (not (out-of-reach ?to)))
      (over all (time-left)))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  ; While it looks, the robot stands nowhere in particular, so that it does not drive away.
  (:durative-action observe
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 2)
    :condition (and
      (at start (at ?from))
      (at start (not (observed ?from ?on)))
      (at start ([can-see ?from ?on]))
      (at start ([worth-a-look ?from ?on]))
      (over all (time-left)))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (observed ?from ?on))
      (forall (?what - thing)
        (at end (increase (confidence ?what) [expected-gain ?from ?on ?what]))))))
