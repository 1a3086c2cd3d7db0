(define (problem two-books) (:domain shelf)
  (:objects atlas novel - book)
  (:init (= (used) 0))
  (:goal (and (placed atlas) (placed novel) (<= (used) 40))))
