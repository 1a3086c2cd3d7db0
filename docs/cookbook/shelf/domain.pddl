; Where on a shelf there is room, a program proposes (grounding); how much is used afterwards, it says too (effect).
(define (domain shelf)
  (:requirements :typing :negative-preconditions :numeric-fluents :modules :grounding-modules)
  (:types book)
  (:modules
    (free-slot ?b - book                 grounding free_slot@shelf)
    (used-after ?b - book (used)         effect    used_after@shelf))
  (:predicates (placed ?b - book))
  (:functions (used))                    ; centimetres of the shelf, from the left
  (:action place
    :parameters (?b - book)
    :grounding ([free-slot ?b])
    :precondition (not (placed ?b))
    :effect (and (placed ?b) ([used-after ?b]))))
