(define (problem homeless)
  (:objects mug - cup table - place)
  (:init (on mug table) (hand-free))
  (:goal (and (holding mug) (clean mug))))
