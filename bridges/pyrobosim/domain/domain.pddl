; A robot with one hand among rooms, furniture that may be shut, and a battery: the ROSCon 2024 deliberation workshop in pyrobosim.
;
; What is open, what lies where, how long ways are and how full the battery is, the body states in every round. Actions may fail by a known chance:
; seconds and uses are those that are expected, over as many tries as that takes. Plans count what the hand takes of the battery; what drives
; take is seen as it goes, and (reserve) is left for a drive to the charger, opening a way to it and putting down what is in the hand.

(define (domain workshop)
  (:requirements :typing :negative-preconditions :numeric-fluents)

  (:types
    pose        ; a navigation pose of pyrobosim
    door        ; a hallway
    furniture
    item)

  (:predicates
    (at ?where - pose)                         ; where the robot stands
    (beside ?where - pose ?way - door)         ; the hallway can be opened from there
    (shut ?way - door)
    (way-to ?from ?to - pose)                  ; without a hallway between them
    (through ?from ?to - pose ?way - door)     ; from one end of the hallway to the other
    (serves ?where - pose ?place - furniture)  ; the hand reaches the furniture from there
    (closed ?place - furniture)
    (full ?place - furniture)                  ; nothing could be put there
    (charges ?place - furniture)
    (lies ?what - item ?place - furniture)
    (holding ?what - item)
    (hand-free))

  (:functions
    (seconds)                   ; what the plan takes
    (way ?from ?to - pose)      ; metres, and so seconds at 1 m/s
    (battery)                   ; per cent
    (reserve)                   ; what is left for the way to the charger
    (grip-use)                  ; of the battery, until a pick or a place has worked
    (grip-time)                 ; seconds, the same
    (hinge-use)                 ; of the battery, until something is opened or closed
    (hinge-time))               ; seconds, the same

  (:action move
    :parameters (?from ?to - pose)
    :precondition (and
      (at ?from)
      (way-to ?from ?to))
    :effect (and
      (not (at ?from))
      (at ?to)
      (increase (seconds) (way ?from ?to))))

  (:action recharge
    :parameters (?from ?to - pose ?dock - furniture)
    :precondition (and
      (at ?from)
      (way-to ?from ?to)
      (serves ?to ?dock)
      (charges ?dock))
    :effect (and
      (not (at ?from))
      (at ?to)
      (assign (battery) 100)
      (increase (seconds) (way ?from ?to))))

  (:action cross
    :parameters (?from ?to - pose ?way - door)
    :precondition (and
      (at ?from)
      (through ?from ?to ?way)
      (not (shut ?way)))
    :effect (and
      (not (at ?from))
      (at ?to)
      (increase (seconds) (way ?from ?to))))

  (:action open-hallway
    :parameters (?from - pose ?way - door)
    :precondition (and (at ?from) (beside ?from ?way) (shut ?way) (hand-free) (>= (battery) (hinge-use)))
    :effect (and (not (shut ?way)) (decrease (battery) (hinge-use)) (increase (seconds) (hinge-time))))

  (:action open
    :parameters (?from - pose ?place - furniture)
    :precondition (and
      (at ?from)
      (serves ?from ?place)
      (closed ?place)
      (hand-free)
      (>= (battery) (+ (reserve) (hinge-use))))
    :effect (and (not (closed ?place)) (decrease (battery) (hinge-use)) (increase (seconds) (hinge-time))))

  (:action close
    :parameters (?from - pose ?place - furniture)
    :precondition (and
      (at ?from)
      (serves ?from ?place)
      (not (closed ?place))
      (hand-free)
      (>= (battery) (+ (reserve) (hinge-use))))
    :effect (and (closed ?place) (decrease (battery) (hinge-use)) (increase (seconds) (hinge-time))))

  (:action pick
    :parameters (?from - pose ?what - item ?place - furniture)
    :precondition (and
      (at ?from)
      (serves ?from ?place)
      (not (closed ?place))
      (lies ?what ?place)
      (hand-free)
      (>= (battery) (+ (reserve) (grip-use))))
    :effect (and
      (not (hand-free))
      (not (lies ?what ?place))
      (holding ?what)
      (decrease (battery) (grip-use))
      (increase (seconds) (grip-time))))

  (:action put
    :parameters (?from - pose ?what - item ?place - furniture)
    :precondition (and
      (at ?from)
      (serves ?from ?place)
      (not (closed ?place))
      (not (full ?place))
      (holding ?what)
      (>= (battery) (grip-use)))
    :effect (and
      (not (holding ?what))
      (hand-free)
      (lies ?what ?place)
      (decrease (battery) (grip-use))
      (increase (seconds) (grip-time)))))
