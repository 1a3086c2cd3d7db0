; How long a drive takes, and whether a road is open, a program says: a call of kind cost and one of kind condition.
(define (domain roads)
  (:requirements :typing :durative-actions :modules)
  (:types place)
  (:modules
    (drive-time ?a ?b - place cost             drive_time@roads)
    (passable ?a ?b - place   conditionchecker passable@roads))
  (:predicates (at ?p - place) (parcel-at ?p - place) (loaded) (delivered))
  (:durative-action drive
    :parameters (?a ?b - place)
    :duration (= ?duration [drive-time ?a ?b])
    :condition (and (at start (at ?a)) (at start ([passable ?a ?b])))
    :effect (and (at start (not (at ?a))) (at end (at ?b)))))
