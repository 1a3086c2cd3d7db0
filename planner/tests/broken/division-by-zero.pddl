(define (domain tank)
  (:requirements :fluents)
  (:predicates (full))
  (:functions (level))
  (:action fill
    :parameters ()
    :precondition (> (/ (level) (- 2 2)) 1)
    :effect (and (full) (scale-down (level) 0))))
