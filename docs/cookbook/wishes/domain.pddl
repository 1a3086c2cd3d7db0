; Wishes that cost when they are not granted: preferences (PDDL3).
(define (domain wishes)
  (:requirements :typing :preferences :negative-preconditions)
  (:types guest seat)
  (:predicates (sits ?g - guest ?s - seat) (free ?s - seat) (seated ?g - guest))
  (:action seat
    :parameters (?g - guest ?s - seat)
    :precondition (and (free ?s) (not (seated ?g)))
    :effect (and (sits ?g ?s) (seated ?g) (not (free ?s)))))
