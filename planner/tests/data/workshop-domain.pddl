(define (domain workshop)
  (:requirements :typing :durative-actions :duration-inequalities :numeric-fluents :conditional-effects
                 :continuous-effects :timed-initial-literals :modules)
  (:types part spot)
  (:modules
    (walk-time ?a ?b - spot cost walk-time@libshop.so)
    (weigh ?p - part (mass ?p) (known ?p) effect weigh@libshop.so))
  (:predicates (raw ?p - part) (done ?p - part) (known ?p - part) (lit) (free) (closed) (aired) (at ?s - spot))
  (:functions (heat) (mass ?p - part))

  (:durative-action light
    :parameters ()
    :duration (= ?duration 5)
    :condition (at start (not (lit)))
    :effect (and (at start (lit)) (at end (not (lit)))))

  (:durative-action join
    :parameters (?p - part)
    :duration (= ?duration 2)
    :condition (and (at start (and (free) (raw ?p) (lit) (not (closed)))) (over all (lit)) (at end (lit)))
    :effect (and (at start (not (free))) (at end (free)) (at end (done ?p)) (at end (not (raw ?p)))))

  (:durative-action wait
    :parameters ()
    :duration (and (>= ?duration 1) (<= ?duration 4))
    :effect (and))

  (:durative-action walk
    :parameters (?a ?b - spot)
    :duration (= ?duration [walk-time ?a ?b])
    :condition (at start (at ?a))
    :effect (and (at start (not (at ?a))) (at end (at ?b))))

  (:durative-action heat-up
    :parameters ()
    :duration (>= ?duration 1)
    :condition (over all (<= (heat) 90))
    :effect (and (increase (heat) (* #t 2)) (when (at start (not (closed))) (at end (aired)))))

  (:durative-action weigh-it
    :parameters (?p - part)
    :duration (= ?duration 1)
    :condition (at start (raw ?p))
    :effect (at end ([weigh ?p]))))
