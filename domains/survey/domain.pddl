; A robot in rooms of which it has no map: it makes one, and looks for things on the surfaces that it finds.
;
; What a look is worth is computed: [expected-view] says how much floor that is unknown one from that pose would show beyond those before it, so that
; a plan is the quickest way past poses from which all would be seen; each look changes what there is to be seen.

(define (domain survey)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions
                 :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand and look from
    surface     ; something level to put things on, of those on the map
    thing       ; a known object, or a kind of object, that is being looked for
    kind)       ; a kind of object of which all are wanted

  (:modules
    (path-cost ?from ?to - pose                 cost             path_cost@descry)
    (expected-view ?from - pose                 cost             expected_view@descry)
    (expected-discovery ?from - pose ?what - thing cost          expected_discovery@descry)
    (expected-discoveries ?from - pose ?of - kind cost           expected_discoveries@descry)
    (can-see ?from - pose ?on - surface         conditionchecker can_see@descry)
    (worth-a-look ?from - pose ?on - surface    conditionchecker worth_a_look@descry)
    (expected-gain ?from - pose ?on - surface ?what - thing cost expected_gain@descry)
    (expected-completeness ?from - pose ?on - surface ?of - kind cost expected_completeness@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (time-left)                                 ; the deadline, if there is one, has not passed
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (outlook ?from - pose)                      ; a look from there would show floor that is not known yet
    (charted ?from - pose)                      ; that look has been taken
    (observed ?from - pose ?on - surface))      ; this look has been taken, and nothing has been moved since

  (:functions
    (unseen)                                    ; floor that is unknown and expected to be seen from somewhere, square metres
    (confidence ?what - thing)                  ; how sure we are that it stands where we believe it does, 0 to 1
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

  ; Something that is sought may stand on what is not known yet: as long as that is so, looking there may raise the confidence in it, and
  ; in having found all of a kind.
  (:durative-action chart
    :parameters (?from - pose)
    :duration (= ?duration 2)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (outlook ?from))
      (at start (not (charted ?from))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (charted ?from))
      (at end (decrease (unseen) [expected-view ?from]))
      (forall (?what - thing)
        (at end (increase (confidence ?what) [expected-discovery ?from ?what])))
      (forall (?of - kind)
        (at end (increase (completeness ?of) [expected-discoveries ?from ?of])))))

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
      (forall (?what - thing)
        (at end (increase (confidence ?what) [expected-gain ?from ?on ?what])))
      (forall (?of - kind)
        (at end (increase (completeness ?of) [expected-completeness ?from ?on ?of]))))))
