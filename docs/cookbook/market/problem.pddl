(define (problem saturday) (:domain market)
  (:objects home fish cheese - place)
  (:init (at home)
    (at 30 (open fish)) (at 60 (not (open fish)))       ; from minute 30 to minute 60
    (at 0.001 (open cheese)) (at 28 (not (open cheese))))
  (:goal (and (bought fish) (bought cheese)))
  (:metric minimize (total-time)))
