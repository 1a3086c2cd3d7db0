; A courier with a battery, a dock and a locked gate: no camera, all of it words that are remembered and programs that act.
(define (domain courier)
  (:requirements :typing :negative-preconditions :durative-actions :numeric-fluents)
  (:types place gate letter)
  (:predicates
    (stands ?p - place)                     ; where the courier is
    (joined ?a ?b - place ?d - gate)        ; a way leads through the gate
    (locked ?d - gate)
    (key-at ?p - place) (has-key)
    (dock ?p - place)                       ; it can charge there
    (waits ?l - letter ?p - place) (carries ?l - letter) (delivered ?l - letter ?p - place))
  (:functions (battery))                    ; per cent
  (:durative-action go
    :parameters (?a ?b - place ?d - gate)
    :duration (= ?duration 20)
    :condition (and (at start (stands ?a)) (at start (joined ?a ?b ?d)) (at start (not (locked ?d)))
                    (at start (>= (battery) 20)))
    :effect (and (at start (not (stands ?a))) (at end (stands ?b)) (at end (decrease (battery) 20))))
  (:durative-action take-key
    :parameters (?p - place)
    :duration (= ?duration 2)
    :condition (and (over all (stands ?p)) (at start (key-at ?p)))
    :effect (and (at start (not (key-at ?p))) (at end (has-key))))
  (:durative-action unlock
    :parameters (?a ?b - place ?d - gate)
    :duration (= ?duration 5)
    :condition (and (over all (stands ?a)) (over all (has-key)) (at start (joined ?a ?b ?d)) (at start (locked ?d)))
    :effect (at end (not (locked ?d))))
  (:durative-action charge
    :parameters (?p - place)
    :duration (= ?duration 60)
    :condition (and (over all (stands ?p)) (at start (dock ?p)))
    :effect (at end (assign (battery) 100)))
  (:durative-action pick
    :parameters (?l - letter ?p - place)
    :duration (= ?duration 3)
    :condition (and (over all (stands ?p)) (at start (waits ?l ?p)))
    :effect (and (at start (not (waits ?l ?p))) (at end (carries ?l))))
  (:durative-action hand-over
    :parameters (?l - letter ?p - place)
    :duration (= ?duration 3)
    :condition (and (over all (stands ?p)) (at start (carries ?l)))
    :effect (and (at end (not (carries ?l))) (at end (delivered ?l ?p)))))
