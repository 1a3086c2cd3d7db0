(define (problem round-3)
  (:domain tabletop)
  (:objects
    start table-1 table-2 table-3 table-4 table-5 table-6 table-7 table-8 - pose
    table - surface
    cup-a - thing
  )
  (:init
    (at table-6)
    (time-left)
    (on cup-a table)
    (= (confidence cup-a) 0.854308)
    (= (presence cup-a table) 0.854308)
    (= (clarity table) 0.704536)
    (observed table-5 table)
    (observed table-6 table)
  )
  (:goal (>= (confidence cup-a) 0.8))
  (:metric minimize (total-time)))
