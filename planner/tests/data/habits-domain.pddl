; Sections in an unusual order, upper case, missing spaces.
(DEFINE (DOMAIN Haul)
(:predicates(at ?x -thing ?p - place)(empty ?t - truck) (linked?a?b - place))
(:requirements :strips :typing :fluents :adl :durative-actions :modules :timed-initial-literals)
(:types place thing - object  truck parcel - thing)
(:functions (fuel ?t - truck)(total-cost) - number (home ?t - truck) - place)
(:constants depot - place)
(:modules (Path-Cost ?a ?b - place
             cost
             pathCost@libNav.so))
(:action DRIVE
 :parameters(?t - truck ?a ?b - place)
 :precondition(and(at ?t ?a)(not(= ?a ?b))(>= (fuel ?t) 1)
   (forall(?p - parcel)(imply(at ?p ?b)(linked ?a ?b))))
 :effect(and(at ?t ?b)(not(at ?t ?a))(increase(total-cost)2)
   (when(not(= ?b depot))(decrease (fuel ?t) 1))(when(= ?b depot)(and(assign (fuel ?t) 10)(assign (home ?t) ?b)))
   (forall(?o - truck)(when(and(at ?o ?b)(not(= ?o ?t)))(empty ?o)))))
(:durative-action rest
 :parameters (?t - truck)
 :duration (and (>= ?duration 1) (<= ?duration (fuel ?t)))
 :condition ()
 :effect (at end (empty ?t)))
(:durative-action crawl
 :parameters (?t - truck ?a ?b - place)
 :duration (= ?duration [path-cost ?a ?b])
 :condition (and (over all (at ?t ?a)) (at start (or (linked ?a ?b) (linked ?b ?a))))
 :effect (and (at end (not (at ?t ?a))) (at end (at ?t ?b)) (decrease (fuel ?t) (* #t 0.5)))))
