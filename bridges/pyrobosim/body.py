"""A pyrobosim robot as a body of descry: it drives between pyrobosim's navigation poses and opens hallways, over `robots/PROTOCOL.md`.

    python3 body.py PROBLEM --seed N --world FOLDER/world.sock [--result FILE]

What the protocol has no request for (picking, placing, opening and closing furniture, what is known of the world) goes over the second socket,
`world.sock`, to which the programs of the domain (`domain/ask.py`) connect.
"""

import argparse
import json
import math
import os
import pathlib
import socket
import sys
import threading

import numpy as np
import shapely

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "robots" / "python"))
import descry_robot as descry
from ways import Ways
from workshop import HAND_S, Failed, Workshop

CELL_M = 0.05
SPEED_M_S, TURN_RAD_S = 1.0, 1000.0  # pyrobosim's executor drives 1 m/s and turns at once
LONGEST_M = 20.0  # no way in these worlds is longer
BROKEN = "the battery is empty"


class Body(descry.Robot):
    def __init__(self, workshop, result=None):
        self.workshop, self.result, self.lock = workshop, result, threading.RLock()
        self.ways = legs(workshop)

    def now_ns(self):
        return round(self.workshop.clock.now_s * 1e9)

    def hello(self):
        origin, cells = self.cells()
        stations = [{"name": name, "map_from_base": planar(pose)} for name, pose in self.workshop.stations.items()]
        base = {"footprint": {"disc": {"radius_m": 0.001}}, "linear_m_s": SPEED_M_S, "angular_rad_s": TURN_RAD_S, "clearance_m": 0}
        grid = {"resolution_m": CELL_M, "origin_m": origin, "width": cells.shape[1], "height": cells.shape[0]}
        rooms = [{"name": room.name, "outline_m": corners(room.polygon)} for room in self.workshop.world.rooms]
        senses = [{"name": "battery", "about": "charge of the battery, per cent"}]
        return {
            "name": f"pyrobosim, problem {self.workshop.problem}", "simulated": True, "up": [0, 0, 1], "pose_sigma_m": 0.001,
            "pose_sigma_rad": 0.001, "base": base, "map": grid, "rooms": rooms, "stations": stations, "senses": senses,
            "doors": [door(name, hall) for name, hall in self.workshop.doors.items()],
        }, cells.tobytes()

    def cells(self):
        """Corner of the map and its cells. pyrobosim moves a point on a floor that it has shrunk by the robot's radius; so is this one."""
        world = self.workshop.world
        floor = shapely.union_all([entity.internal_collision_polygon for entity in world.rooms + world.hallways])
        shapely.prepare(floor)
        left, bottom, right, top = floor.bounds
        x, y = np.meshgrid(np.arange(left, right, CELL_M), np.arange(bottom, top, CELL_M))
        inside = shapely.covers(floor, shapely.box(x, y, x + CELL_M, y + CELL_M))
        return [left, bottom], (~inside).astype(np.uint8)

    def pose(self, request):
        with self.lock:
            return {"map_from_base": planar(self.workshop.robot.get_pose()), "station": self.workshop.station()}

    def drive_to(self, request, to, route_m):
        with self.lock:
            goal, total_m = self.workshop.stations[to["station"]], max(length(route_m), 1e-9)
            start_m = self.workshop.driven_m
            began_s = self.workshop.clock.now_s
            self.carry_out(request, lambda: self.workshop.navigate(
                [*route_m[:-1], (goal.x, goal.y)] if len(route_m) > 1 else [(goal.x, goal.y)] * 2, goal.get_yaw(),
                lambda: request.feedback((self.workshop.clock.now_s - began_s) / total_m, self.workshop.clock.now_s - began_s)))
            return {"distance_m": self.workshop.driven_m - start_m, "map_from_base": planar(self.workshop.robot.get_pose())}

    def open_door(self, request, door):
        with self.lock:
            hall = self.workshop.doors.get(door)
            if hall is None or self.workshop.robot.location is not hall:
                raise descry.Failure("unreachable", f"the {door} is not here")
            self.carry_out(request, self.workshop.open)
            return {}

    def read(self, request, sense):
        return {"said": round(self.workshop.robot.battery_level, 3)}

    def carry_out(self, request, action):
        """Carries out an action of pyrobosim, and says a failure of it in the protocol's kinds."""
        try:
            request.check()
            action()
            request.check_time()
        except Failed as failure:
            if self.workshop.robot.battery_level <= 0.0:
                raise descry.Failure("broken", BROKEN) from failure
            if failure.by:
                raise descry.Failure("blocked", str(failure), by=failure.by) from failure
            kind = "blocked" if "navigation" in str(failure) or "way" in str(failure) else "slipped"
            raise descry.Failure(kind, str(failure), **({"moved_m": 0.0} if kind == "slipped" else {})) from failure
        finally:
            self.keep()

    def keep(self):
        """Writes what has become of the world, for the table; nobody else reads it."""
        if self.result:
            w = self.workshop
            said = {"goal": w.goal_holds(), "seconds": w.clock.now_s, "metres": w.driven_m, "done": w.done, "failed": w.failed,
                    "battery": w.robot.battery_level}
            pathlib.Path(self.result + ".new").write_text(json.dumps(said))
            os.replace(self.result + ".new", self.result)

    # The second socket: words and actions of the domain.

    def act(self, action, arguments):
        w = self.workshop
        if action == "pick":
            w.pick(arguments[1])
        elif action == "put":
            w.put()
        elif action == "open":
            w.open()
        else:
            w.close()
        return f"{w.robot.battery_level:.0f} % of the battery are left"

    def state(self, word):
        """The atoms of a word of the domain."""
        w = self.workshop
        if word == "way":
            return [f"(= (way {symbol(a)} {symbol(b)}) {metres:.3f})" for a, b, metres, _ in self.ways]
        chance, use = w.facts["chance"], w.facts["use"]
        numbers = {
            "battery": w.robot.battery_level, "reserve": self.reserve(),
            "grip-use": use["pick"] / chance["pick"], "grip-time": HAND_S / chance["pick"],
            "hinge-use": use["open"] / chance["open"], "hinge-time": HAND_S / chance["open"],
        }
        if word in numbers:
            return [f"(= ({word}) {numbers[word]:.3f})"]
        lists = {
            "serves": lambda: [(symbol(s), s.rsplit(" ", 1)[0]) for s in w.stations if s.rsplit(" ", 1)[0] in w.spawns],
            "shut": lambda: [(symbol(name),) for name, hall in w.doors.items() if not hall.is_open],
            "way-to": lambda: [(symbol(a), symbol(b)) for a, b, _, hall in self.ways if hall is None],
            "through": lambda: [(symbol(a), symbol(b), symbol(hall)) for a, b, _, hall in self.ways if hall],
            "closed": lambda: [(name,) for name, spawn in w.spawns.items() if not spawn.parent.is_open],
            "full": lambda: [(name,) for name in sorted(w.full)],
            "charges": lambda: [(name,) for name, spawn in w.spawns.items() if spawn.parent.is_charger],
            "lies": lambda: [(name, place) for name, item in w.items.items() for place, spawn in w.spawns.items() if item.parent is spawn],
            "holding": lambda: [(name,) for name, item in w.items.items() if item is w.robot.manipulated_object],
            "hand-free": lambda: [()] if w.robot.manipulated_object is None else [],
        }
        return [f"({' '.join((word, *atom))})" for atom in lists[word]()]

    def reserve(self):
        """Charge for the longest drive to the charger, and as long as every hallway to it is shut, for three tries to open one and two to put
        down what is in the hand."""
        use, shut = self.workshop.facts["use"], not any(h.is_open for name, h in self.workshop.doors.items() if "closet" in name)
        return LONGEST_M * use["navigate"] + (3 * use["open"] + 2 * use["place"]) * shut

    def answer(self, question):
        with self.lock:
            if "fact" in question:
                return {"value": self.state(question["fact"])}
            try:
                return {"value": self.act(question["action"], question["arguments"])}
            except Failed as failure:
                return {"error": str(failure)}
            finally:
                self.keep()

    def listen(self, path):
        """Answers the programs of the domain, each on a connection of its own."""
        server = socket.socket(socket.AF_UNIX)
        pathlib.Path(path).unlink(missing_ok=True)
        server.bind(path)
        server.listen()
        threading.Thread(target=self.accept, args=(server,), daemon=True).start()

    def accept(self, server):
        while True:
            threading.Thread(target=self.serve, args=(server.accept()[0],), daemon=True).start()

    def serve(self, connection):
        with connection, connection.makefile("rw") as lines:
            for line in lines:
                question = json.loads(line)
                lines.write(json.dumps({"id": question["id"], **self.answer(question)}) + "\n")
                lines.flush()


def legs(workshop):
    """Ways between two stations of a room, and of two rooms through the hallway between them: from, to, metres, hallway."""
    ways, spots = Ways(workshop), {name: (float(p.x), float(p.y)) for name, p in workshop.stations.items()}
    every = frozenset(workshop.doors)
    inside = {a: {b: ways.metres(spots[a], spots[b], every) for b in spots} for a in spots}
    found = [(a, b, metres, None) for a in spots for b, metres in inside[a].items() if a != b]
    for hall in workshop.doors:
        sides = f"{hall} side 1", f"{hall} side 2"
        long = ways.metres(spots[sides[0]], spots[sides[1]], frozenset())
        found += [(a, b, inside[a][one] + long + inside[other][b], hall) for one, other in (sides, sides[::-1]) for a in spots for b in spots]
    return [leg for leg in found if leg[2] < math.inf]


def symbol(name):
    return name.replace(" ", "-")


def planar(pose):
    return descry.planar(float(pose.x), float(pose.y), float(pose.get_yaw()))


def corners(polygon):
    return [[float(x), float(y)] for x, y in polygon.exterior.coords[:-1]]


def length(points):
    return sum(math.dist(a, b) for a, b in zip(points, points[1:]))


def door(name, hall):
    one, other = hall.nav_poses[0], hall.nav_poses[-1]
    middle = hall.closed_polygon.centroid
    along = math.atan2(other.y - one.y, other.x - one.x) + math.pi / 2
    return {"name": name, "centre_m": [middle.x, middle.y], "along_rad": along, "width_m": hall.width,
            "between": [hall.room_start.name, hall.room_end.name]}


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("problem", type=int, choices=(1, 2, 3, 4))
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--world", help="path of the second socket")
    arguments.add_argument("--result", help="file for what has become of the world")
    given = arguments.parse_args()
    body = Body(Workshop(given.problem, given.seed), given.result)
    if given.world:
        body.listen(given.world)
    descry.serve(body)


if __name__ == "__main__":
    main()
