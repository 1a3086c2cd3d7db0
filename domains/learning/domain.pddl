; A robot that visits places again and again, notices what is new there, looks at it from all around and learns it, so that it knows it again.
;
; Where to look from is computed: [expected-sides] says how much of what is new a look from there would show that those before it did not, so that a
; plan is the quickest way to enough looks from all sides that can be reached.

(define (domain learning)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions :existential-preconditions
                 :disjunctive-preconditions :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand and look from
    surface     ; something to put things on
    thing       ; something that was learned, and is being looked for
    kind        ; a kind of object of which all are wanted
    novelty)    ; something that stands where nothing stood before

  (:modules
    (path-cost ?from ?to - pose                 cost             path_cost@descry)
    (expected-sides ?from - pose ?what - novelty cost            expected_sides@descry)
    (can-see ?from - pose ?on - surface         conditionchecker can_see@descry)
    (worth-a-look ?from - pose ?on - surface    conditionchecker worth_a_look@descry)
    (expected-gain ?from - pose ?on - surface ?what - thing cost expected_gain@descry)
    (expected-presence ?from - pose ?on - surface ?what - thing cost expected_presence@descry)
    (expected-clarity ?from - pose ?on - surface cost            expected_clarity@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (time-left)                                 ; the deadline, if there is one, has not passed
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (way-in ?where - pose)                      ; one may drive there from anywhere
    (next-to ?one ?other - pose)                ; neighbours on the way around something new
    (waypoint ?where - pose)                    ; a place is visited from there
    (patrolled ?where - pose)                   ; it was visited in this run
    (stand ?where - pose ?what - novelty)       ; one can look at it from there
    (before ?one ?other - novelty)              ; one is learned after the other
    (faced ?from - pose ?what - novelty)        ; that look was taken
    (settled ?what - novelty)                   ; it was learned, is known, or cannot be learned
    (observed ?from - pose ?on - surface))      ; this look has been taken, and nothing has been moved since

  (:functions
    (unfaced ?what - novelty)                   ; share of the directions around it that were not seen and can be seen
    (confidence ?what - thing)                  ; how sure we are that it stands where we believe it does, 0 to 1
    (presence ?what - thing ?on - surface)      ; how sure we are that it stands on that surface, 0 to 1
    (clarity ?on - surface))                    ; how sure we are what each object on it is, the least sure one, 0 to 1

  (:durative-action move
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (way-in ?to))
      (at start (not (= ?from ?to)))
      (at start (not (out-of-reach ?to))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  ; Around something new the robot goes from one stand to the next.
  (:durative-action follow
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (next-to ?from ?to))
      (at start (not (out-of-reach ?to))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  (:durative-action patrol
    :parameters (?from - pose)
    :duration (= ?duration 2)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (waypoint ?from))
      (at start (not (patrolled ?from))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (patrolled ?from))))

  (:durative-action face
    :parameters (?from - pose ?what - novelty)
    :duration (= ?duration 1.5)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (stand ?from ?what))
      (at start (forall (?other - novelty) (imply (before ?other ?what) (settled ?other))))
      (at start (not (faced ?from ?what))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (faced ?from ?what))
      (at end (decrease (unfaced ?what) [expected-sides ?from ?what]))))

  ; Sides that can be seen from nowhere are not waited for: what was seen is learned, and what was not is said.
  (:durative-action model
    :parameters (?what - novelty)
    :duration (= ?duration 1)
    :condition (and
      (over all (time-left))
      (at start (not (settled ?what)))
      (at start (forall (?other - novelty) (imply (before ?other ?what) (settled ?other))))
      (at start (<= (unfaced ?what) 0.03)))
    :effect (at end (settled ?what)))

  (:durative-action observe
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 2)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (not (observed ?from ?on)))
      (at start ([can-see ?from ?on]))
      (at start ([worth-a-look ?from ?on])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (observed ?from ?on))
      (at end (increase (clarity ?on) [expected-clarity ?from ?on]))
      (forall (?what - thing)
        (and (at end (increase (confidence ?what) [expected-gain ?from ?on ?what]))
             (at end (increase (presence ?what ?on) [expected-presence ?from ?on ?what])))))))
