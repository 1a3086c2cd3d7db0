(define (problem round-1)
  (:domain tabletop)
  (:objects
    start table-1 table-2 table-3 table-4 table-5 table-6 table-7 table-8 - pose
    table - surface
    cup-a - thing
  )
  (:init
    (at start)
    (time-left)
    (= (confidence cup-a) 0.000000)
    (= (presence cup-a table) 0.000000)
    (= (clarity table) 0.250000)
  )
  (:goal (>= (confidence cup-a) 0.8))
  (:metric minimize (total-time)))
