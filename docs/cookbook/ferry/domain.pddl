; A ferry carries one car at a time: classical planning, no numbers, no time.
(define (domain ferry)
  (:requirements :strips :typing)
  (:types car shore)
  (:predicates (ferry-at ?s - shore) (at ?c - car ?s - shore) (aboard ?c - car) (empty))
  (:action sail
    :parameters (?from ?to - shore)
    :precondition (ferry-at ?from)
    :effect (and (ferry-at ?to) (not (ferry-at ?from))))
  (:action board
    :parameters (?c - car ?s - shore)
    :precondition (and (ferry-at ?s) (at ?c ?s) (empty))
    :effect (and (aboard ?c) (not (at ?c ?s)) (not (empty))))
  (:action debark
    :parameters (?c - car ?s - shore)
    :precondition (and (ferry-at ?s) (aboard ?c))
    :effect (and (at ?c ?s) (empty) (not (aboard ?c)))))
