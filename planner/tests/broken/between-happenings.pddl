(define (domain tank)
  (:requirements :durative-actions :numeric-fluents :continuous-effects :derived-predicates :constraints)
  (:predicates (slow) (steep))
  (:functions (x) (y) (rate))

  (:derived (steep) (> (/ (x) (+ 1 (y))) 3))

  (:durative-action fill
    :parameters ()
    :duration (= ?duration 4)
    :condition (and (over all (< (* (x) (x)) 100))
                    (over all (<= (* (x) (y) (- (x) 3)) 5))
                    (over all (not (steep)))
                    (at end (<= (* (x) (x) (x)) 5)))
    :effect (and (increase (x) (* #t (rate))) (decrease (y) (* #t 2)) (at end (slow))))

  (:constraints (and (always (<= (x) 9)) (at end (<= (x) 4)) (sometime (slow)) (always (not (steep))))))
