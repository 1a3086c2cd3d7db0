; A robot that looks at what stands on surfaces.
;
; Two actions are enough to search a room: drive somewhere, and look from there. Where no look can settle what is asked,
; a third moves out of the way what hides it. What geometry knows is asked of it through calls in square brackets: how
; long a drive takes, whether a pose sees a surface at all, how much of what is still in doubt a look from there would
; settle, and whether a push would uncover any of it.

(define (domain tabletop)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions
                 :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand and look from
    surface     ; a table top, a shelf
    obstacle    ; an object on a surface that may be pushed aside; there are none while looking alone can help
    thing       ; a known object, or a kind of object, that is being looked for
    kind)       ; a kind of object of which all are wanted

  (:modules
    (path-cost ?from ?to - pose                 cost             path_cost@descry)
    (can-see ?from - pose ?on - surface         conditionchecker can_see@descry)
    (worth-a-look ?from - pose ?on - surface    conditionchecker worth_a_look@descry)
    (worth-a-push ?from - pose ?what - obstacle conditionchecker worth_a_push@descry)
    (expected-gain ?from - pose ?what - thing   cost             expected_gain@descry)
    (expected-clarity ?from - pose ?on - surface cost            expected_clarity@descry)
    (expected-completeness ?from - pose ?of - kind cost          expected_completeness@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (time-left)                                 ; the deadline, if there is one, has not passed
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (pushed ?what - obstacle)                   ; it is out of the way
    (observed ?from - pose ?on - surface))      ; this look has been taken, and nothing has been moved since

  (:functions
    (confidence ?what - thing)                  ; how sure we are that it stands where we believe it does, 0 to 1
    (clarity ?on - surface)                     ; how sure we are what each object on it is, the least sure one, 0 to 1
    (completeness ?of - kind))                  ; how sure we are of having found all of a kind, 0 to 1

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

  ; A look is expected to raise confidence by the share of the doubt that it can settle. What one look shows, the next
  ; cannot show again: the calls read which looks have been taken.
  (:durative-action observe
    :parameters (?from - pose ?on - surface)
    :duration (= ?duration 2)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (over all (at ?from))
      (at start (not (observed ?from ?on)))
      (at start ([can-see ?from ?on]))
      (at start ([worth-a-look ?from ?on])))
    :effect (and
      (at end (observed ?from ?on))
      (at end (increase (clarity ?on) [expected-clarity ?from ?on]))
      (forall (?what - thing)
        (at end (increase (confidence ?what) [expected-gain ?from ?what])))
      (forall (?of - kind)
        (at end (increase (completeness ?of) [expected-completeness ?from ?of])))))

  ; What a push uncovers is seen by the looks after it, also from where the robot has looked before. While it pushes, the
  ; robot stands nowhere in particular: it neither looks nor leaves.
  (:durative-action push-aside
    :parameters (?from - pose ?what - obstacle)
    :duration (= ?duration 12)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (not (pushed ?what)))
      (at start ([worth-a-push ?from ?what])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (pushed ?what))
      (forall (?pose - pose ?on - surface)
        (at end (not (observed ?pose ?on)))))))
