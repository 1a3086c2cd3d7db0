; A robot with a hand in a flat: it searches rooms, opens doors, and brings things.
;
; Looking is as on the tabletop. What is new: a drive leads through doors, which may turn out to be shut; the body carries one
; thing at a time, and looks while it carries nothing; and where a thing is expected, and what it costs to have looked in vain,
; decides where it is looked for first: what [search-cost] says of the first look at a surface counts beside the time that a plan takes.

(define (domain home)
  (:requirements :typing :equality :negative-preconditions :disjunctive-preconditions :universal-preconditions
                 :existential-preconditions :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand
    surface     ; a table, a desk, a shelf board
    room
    door
    thing       ; a known object, or a kind of object, that is spoken of; or one that was seen of a kind of which all are wanted
    kind)       ; a kind of object of which all are wanted

  (:modules
    (path-cost ?from ?to - pose                                  cost             path_cost@descry)
    (can-see ?from - pose ?on - surface                          conditionchecker can_see@descry)
    (worth-a-look ?from - pose ?on - surface                     conditionchecker worth_a_look@descry)
    (search-cost ?on - surface                                   cost             search_cost@descry)
    (expected-gain ?from - pose ?on - surface ?what - thing      cost             expected_gain@descry)
    (expected-presence ?from - pose ?on - surface ?what - thing  cost             expected_presence@descry)
    (expected-placing ?from - pose ?on - surface ?what - thing   cost             expected_placing@descry)
    (expected-clarity ?from - pose ?on - surface                 cost             expected_clarity@descry)
    (expected-completeness ?from - pose ?on - surface ?of - kind cost             expected_completeness@descry)
    (can-grasp ?from - pose ?what - thing ?on - surface          conditionchecker can_grasp@descry)
    (can-put ?from - pose ?on - surface                          conditionchecker can_put@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (time-left)                                 ; the deadline, if there is one, has not passed
    (in ?what - surface ?where - room)          ; by the map
    (beside ?where - pose ?way - door)          ; by the map: the door can be opened from there
    (shut ?way - door)                          ; it was found shut
    (stuck ?way - door)                         ; it could not be opened
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (observed ?from - pose ?on - surface)       ; this look has been taken, and nothing has been moved since
    (on ?what - thing ?on - surface)            ; it surely stands there
    (last-seen ?what - thing ?on - surface)     ; an earlier run saw it there last
    (is ?what - thing ?of - kind)               ; it was seen, and is surely of the kind
    (hand-free)
    (holding ?what - thing)
    (slippery ?what - thing)                           ; it could not be taken
    (beyond ?from - pose ?what - thing ?on - surface)  ; from that pose the hand could not reach it there
    (full ?from - pose ?on - surface))                 ; nothing could be put there from that pose

  (:functions
    (confidence ?what - thing)                  ; how sure we are that it stands where we believe it does, 0 to 1
    (presence ?what - thing ?on - surface)      ; how sure we are that it stands on that surface, 0 to 1
    (placed ?what - thing)                      ; how sure we are where on its surface that is, where we believe in one, 0 to 1
    (completeness ?of - kind)                   ; how sure we are of having found all of a kind, 0 to 1
    (completeness-in ?of - kind ?where - room)  ; the same of those in a room
    (clarity ?on - surface)                     ; how sure we are what each object on it is, the least sure one, 0 to 1
    (hours-since ?what - thing)                 ; how long ago an earlier run saw it
    (in-vain)                                   ; seconds that count for looks that may turn out to have been in vain
    (sure))                                     ; the confidence that was asked for

  (:durative-action move
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (not (= ?from ?to)))
      (at start (not (out-of-reach ?to))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  (:durative-action open-door
    :parameters (?from - pose ?way - door)
    :duration (= ?duration 6)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (over all (at ?from))
      (at start (beside ?from ?way))
      (at start (shut ?way))
      (at start (not (stuck ?way))))
    :effect (at end (not (shut ?way))))

  ; While it looks, the robot stands nowhere in particular: it neither looks elsewhere nor leaves.
  (:durative-action observe
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 2)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (hand-free))
      (at start (not (observed ?from ?on)))
      (at start ([can-see ?from ?on]))
      (at start ([worth-a-look ?from ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (observed ?from ?on))
      (at end (increase (in-vain) [search-cost ?on]))
      (at end (increase (clarity ?on) [expected-clarity ?from ?on]))
      (forall (?what - thing)
        (and (at end (increase (confidence ?what) [expected-gain ?from ?on ?what]))
             (at end (increase (presence ?what ?on) [expected-presence ?from ?on ?what]))
             (at end (increase (placed ?what) [expected-placing ?from ?on ?what]))))
      (forall (?of - kind)
        (at end (increase (completeness ?of) [expected-completeness ?from ?on ?of])))
      (forall (?of - kind ?where - room)
        (at end (increase (completeness-in ?of ?where) [expected-completeness ?from ?on ?of])))))

  (:durative-action pick-up
    :parameters (?from - pose ?what - thing ?on - surface)
    :duration (= ?duration 8)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (hand-free))
      (at start (not (slippery ?what)))
      (at start (not (beyond ?from ?what ?on)))
      (at start (>= (presence ?what ?on) (sure)))
      (at start ([can-grasp ?from ?what ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at start (not (hand-free)))
      (at end (holding ?what))
      (at end (not (on ?what ?on)))
      (at end (assign (presence ?what ?on) 0))))

  (:durative-action put-down
    :parameters (?from - pose ?what - thing ?on - surface)
    :duration (= ?duration 10)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (holding ?what))
      (at start (not (full ?from ?on)))
      (at start ([can-put ?from ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at start (not (holding ?what)))
      (at end (hand-free))
      (at end (on ?what ?on)))))
