(define (problem round-2)
  (:domain tabletop)
  (:objects
    start table-1 table-2 table-3 table-4 table-5 table-6 table-7 table-8 - pose
    table - surface
    cup-a - thing
  )
  (:init
    (at table-5)
    (time-left)
    (= (confidence cup-a) 0.701059)
    (= (presence cup-a table) 0.701059)
    (= (clarity table) 0.393760)
    (observed table-5 table)
  )
  (:goal (>= (confidence cup-a) 0.8))
  (:metric minimize (total-time)))
