(define (problem two-cars) (:domain ferry)
  (:objects red blue - car west east - shore)
  (:init (ferry-at west) (at red west) (at blue east) (empty))
  (:goal (and (at red east) (at blue west))))
