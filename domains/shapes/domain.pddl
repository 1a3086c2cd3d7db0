; A robot with a laser among things on the floor: it drives around what it does not know, brings its scans together, and names it by its shape.
;
; What a scan is worth is computed: [expected-tightening] says by how much one from that pose lessens how far the thing may reach
; beyond what was met of it, and [expected-sureness] how sure one may be of its name then, so that a plan is the quickest way to enough
; scans from the right sides.

(define (domain shapes)
  (:requirements :typing :equality :negative-preconditions :universal-preconditions :existential-preconditions
                 :durative-actions :numeric-fluents :modules)

  (:types
    pose        ; somewhere to stand
    spot        ; a thing on the floor that the map does not show
    shape)      ; a shape that has a name

  (:constants
    this - spot) ; what stands nearest before the robot when it first scans

  (:modules
    (path-cost ?from ?to - pose                          cost             path_cost@descry)
    (circle-cost ?from ?to - pose ?what - spot           cost             circle_cost@descry)
    (can-scan ?from - pose ?what - spot                  conditionchecker can_scan@descry)
    (expected-tightening ?from - pose ?what - spot       cost             expected_tightening@descry)
    (expected-sureness ?what - spot                      cost             expected_sureness@descry)
    (expected-found ?what - spot ?name - shape           cost             expected_found@descry)
    (expected-discovery ?from - pose ?name - shape       cost             expected_discovery@descry))

  (:predicates
    (at ?where - pose)                          ; where the robot stands
    (time-left)                                 ; the deadline, if there is one, has not passed
    (around ?where - pose ?what - spot)         ; one of the poses around it
    (on-floor ?where - pose)                    ; a pose around nothing
    (out-of-reach ?where - pose)                ; a drive there has failed for good
    (scanned ?from - pose)                      ; the laser has swept from there
    (aligned ?what - spot)                      ; all scans of it are brought together
    (may-be ?what - spot ?name - shape)         ; its scans fit that shape
    (learned ?name - shape))                    ; its shape was learned in this run

  (:functions
    (looseness ?what - spot)                    ; how far on average it may reach beyond what was met of it, metres
    (sureness ?what - spot)                     ; how sure it is what it is, or that it is none of the known, 0 to 1
    (found ?name - shape))                      ; how sure it is that something on the floor has that shape, 0 to 1

  (:durative-action move
    :parameters (?from ?to - pose)
    :duration (= ?duration [path-cost ?from ?to])
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (on-floor ?to))
      (at start (not (= ?from ?to)))
      (at start (not (out-of-reach ?to))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  ; The map does not show what the robot drives around: it goes from pose to pose around it.
  (:durative-action circle
    :parameters (?from ?to - pose ?what - spot)
    :duration (= ?duration [circle-cost ?from ?to ?what])
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (around ?to ?what))
      (at start (not (= ?from ?to)))
      (at start (not (out-of-reach ?to))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?to))))

  ; There is no use in one more scan of what is known from all sides.
  (:durative-action scan
    :parameters (?from - pose ?what - spot)
    :duration (= ?duration 0.5)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (not (scanned ?from)))
      (at start (> (looseness ?what) 0.01))
      (at start ([can-scan ?from ?what])))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (scanned ?from))
      (at end (not (aligned ?what)))
      (at end (decrease (looseness ?what) [expected-tightening ?from ?what]))))

  (:durative-action survey
    :parameters (?from - pose)
    :duration (= ?duration 0.5)
    :condition (and
      (over all (time-left))
      (at start (at ?from))
      (at start (on-floor ?from))
      (at start (not (scanned ?from))))
    :effect (and
      (at start (not (at ?from)))
      (at end (at ?from))
      (at end (scanned ?from))
      (forall (?name - shape)
        (at end (increase (found ?name) [expected-discovery ?from ?name])))))

  (:durative-action align
    :parameters (?what - spot)
    :duration (= ?duration 0.1)
    :condition (and
      (over all (time-left))
      (at start (not (aligned ?what)))
      (at start (< (looseness ?what) 1)))
    :effect (and
      (at end (aligned ?what))
      (at end (increase (sureness ?what) [expected-sureness ?what]))
      (forall (?name - shape)
        (at end (increase (found ?name) [expected-found ?what ?name])))))

  ; A shape is learned when so little of its outline is open that others can be told from it.
  (:durative-action learn
    :parameters (?what - spot ?name - shape)
    :duration (= ?duration 0.1)
    :condition (and
      (over all (time-left))
      (at start (<= (looseness ?what) 0.015)))
    :effect (and
      (at end (aligned ?what))
      (at end (learned ?name)))))
