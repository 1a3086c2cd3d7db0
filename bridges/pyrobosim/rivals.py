"""The other ways to carry out a problem: a plan made once, and always the nearest thing that helps."""

import math

from workshop import Failed

LOW = 40.0  # per cent of the battery below which nearest-first charges
MOST_STEPS, MOST_TRIES = 1000, 100


class Stuck(Exception):
    """It can do nothing more."""


class Hands:
    """Drives by the exact shortest way, and carries out an action where it stands."""

    def __init__(self, workshop, ways):
        self.workshop, self.ways = workshop, ways
        self.spots = {name: (float(p.x), float(p.y)) for name, p in workshop.stations.items()}

    def shut(self):
        return frozenset(name for name, hall in self.workshop.doors.items() if not hall.is_open)

    def metres(self, station):
        here = self.workshop.robot.get_pose()
        return self.ways.metres((float(here.x), float(here.y)), self.spots[station], self.shut())

    def go(self, station):
        here = self.workshop.robot.get_pose()
        way, metres = self.ways.way((float(here.x), float(here.y)), self.spots[station], self.shut())
        if metres == math.inf:
            raise Stuck(f"no way to {station}")
        if metres > 1e-6:
            self.workshop.navigate(way, self.workshop.stations[station].get_yaw())

    def do(self, action, *what):
        if self.workshop.robot.battery_level <= 0.0:
            raise Stuck("the battery is empty")
        getattr(self.workshop, action)(*what)


def once(hands, steps, tries):
    """Carries out the steps of a plan, each up to so many times."""
    for step in steps:
        name, *arguments = step
        for left in reversed(range(tries)):
            try:
                if name in ("move", "cross", "recharge"):
                    hands.go(arguments[1])
                elif name == "pick":
                    hands.do("pick", arguments[1])
                else:
                    hands.do({"open-hallway": "open"}.get(name, name))
                break
            except Failed as failure:
                if not left or hands.workshop.robot.battery_level <= 0.0:
                    raise Stuck(str(failure)) from failure


def nearest_first(hands):
    """Looks at the state after every action, and does what helps and is nearest; below 40 % it charges first."""
    for _ in range(MOST_STEPS):
        if hands.workshop.goal_holds():
            return
        try:
            step(hands)
        except Failed:
            if hands.workshop.robot.battery_level <= 0.0:
                raise Stuck("the battery is empty") from None
    raise Stuck("too many steps")


def step(hands):
    w = hands.workshop
    if w.robot.battery_level < LOW:
        wanted = [("charge", "charger front", ())]
        if w.robot.manipulated_object is not None and hands.metres("charger front") == math.inf:
            wanted = [put_down(hands)]
    else:
        wanted = helpful(hands)
    near = [(hands.metres(station), action, station, what) for action, station, what in wanted]
    far, action, station, what = min(near, key=lambda n: n[0])
    if far == math.inf:
        action, station, what = open_a_hallway(hands, {place_of(station) for _, station, _ in wanted})
    hands.go(station)
    if action != "charge":
        hands.do(action, *what)


def helpful(hands):
    """Actions that bring the goal nearer, with the station where they are done."""
    w, wanted = hands.workshop, []
    is_open = lambda name: w.spawns[name].parent.is_open
    todo = {item: place for item, place in w.facts["bring"] if w.items[item].parent is not w.spawns[place]}
    held = w.robot.manipulated_object
    if held is not None:
        target = todo.get(held.name)
        return [("put", f"{target} front", ())] if target and is_open(target) else [put_down(hands)]
    for item, place in todo.items():
        source = next(name for name, spawn in w.spawns.items() if w.items[item].parent is spawn)
        shut = [name for name in (source, place) if not is_open(name)]
        wanted += [("open", f"{name} front", ()) for name in shut] or [("pick", f"{source} front", (item,))]
    busy = set(todo.values()) | {name for name, spawn in w.spawns.items() for item in todo if w.items[item].parent is spawn}
    return wanted + [("close", f"{name} front", ()) for name in w.facts["close"] if is_open(name) and name not in busy]


def put_down(hands):
    w = hands.workshop
    open_places = [name for name, spawn in w.spawns.items() if spawn.parent.is_open and name not in w.full and name != "charger"]
    return "put", f"{min(open_places, key=lambda name: hands.metres(f'{name} front'))} front", ()


def place_of(station):
    return station.rsplit(" ", 1)[0]


def open_a_hallway(hands, places):
    """The nearest shut hallway into a room where something is wanted; the hand must be free for it."""
    w = hands.workshop
    if w.robot.manipulated_object is not None:
        return put_down(hands)
    rooms = {w.spawns[place].parent.parent.name for place in places}
    sides = [f"{name} side {k}" for name, hall in w.doors.items() if not hall.is_open and rooms & {hall.room_start.name, hall.room_end.name}
             for k in (1, 2)]
    side = min(sides, key=hands.metres)
    return "open", side, ()
