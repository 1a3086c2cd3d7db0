(define (domain search)
  (:requirements :typing :durative-actions :modules)
  (:types pose thing)
  (:modules
    (can-see ?p - pose ?t - thing conditionchecker canSee@libsearch.so)
    (drive-time ?a ?b - pose cost))
  (:predicates (at ?p - pose) (seen ?t - thing))

  (:durative-action drive
    :parameters (?a ?b - pose)
    :duration (= ?duration [drive-time ?a ?b])
    :condition (at start (at ?a))
    :effect (and (at start (not (at ?a))) (at end (at ?b))))

  (:durative-action look
    :parameters (?p - pose ?t - thing)
    :duration (= ?duration 2)
    :condition (and (over all (at ?p)) (at start ([can-se ?p ?t])))
    :effect (at end (seen ?t))))
