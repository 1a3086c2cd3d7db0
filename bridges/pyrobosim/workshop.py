"""The four worlds of the ROSCon 2024 deliberation workshop in pyrobosim, headless and on a clock of their own.

pyrobosim's wheel holds the workshop's rooms, furniture and objects. What its four problems add, which doors are shut, which actions fail how often
and what they take of the battery, is the table `PROBLEMS` below; `https://github.com/ros-wg-delib/roscon24-workshop` has the same as YAML.
"""

import copy
import logging
import math
import pathlib

import numpy as np
import pyrobosim
import shapely
import yaml
from pyrobosim.core import WorldYamlLoader
from pyrobosim.navigation import execution
from pyrobosim.planning import actions
from pyrobosim.planning.actions import ExecutionStatus, TaskAction
from pyrobosim.utils.path import Path
from pyrobosim.utils.pose import Pose
from pyrobosim.utils.world_collision import is_path_collision_free

HAND_S = 2.0  # duration of a pick, a place, an opening or a closing; pyrobosim's own `delay`, which the workshop leaves at 0
ALWAYS = {"navigate": 1.0, "pick": 1.0, "place": 1.0, "open": 1.0, "close": 1.0}
OFTEN = {"navigate": 0.9, "pick": 0.5, "place": 0.5, "open": 0.75, "close": 0.75}
FREE = {"navigate": 0.0, "pick": 0.0, "place": 0.0, "open": 0.0, "close": 0.0}
DEAR = {"navigate": 0.5, "pick": 5.0, "place": 5.0, "open": 8.0, "close": 8.0}  # per cent; of a drive, a metre
OPEN_HALLS = ({"dining", "office"}, {"dining", "kitchen"})  # in all problems; the others are shut in 2 to 4
TRASH = (("waste0", "dumpster"), ("waste1", "dumpster"))
FOOD = (("bread0", "table"), ("butter0", "table"))
PROBLEMS = {
    1: {"shut": (), "halls_shut": False, "chance": ALWAYS, "use": FREE, "bring": (("snacks0", "table"),), "close": ()},
    2: {"shut": ("fridge", "dumpster"), "halls_shut": True, "chance": ALWAYS, "use": FREE, "bring": TRASH, "close": ("dumpster",)},
    3: {"shut": ("fridge", "pantry", "dumpster"), "halls_shut": True, "chance": OFTEN, "use": FREE, "bring": FOOD, "close": ("fridge", "pantry")},
    4: {"shut": ("fridge", "pantry", "dumpster"), "halls_shut": True, "chance": OFTEN, "use": DEAR, "bring": TRASH + FOOD,
        "close": ("dumpster", "fridge", "pantry")},
}


class Clock:
    """Stands where pyrobosim's modules expect `time`: sleeping advances it, nobody waits."""

    def __init__(self):
        self.now_s = 0.0

    def time(self):
        return self.now_s

    def sleep(self, seconds):
        self.now_s += seconds


class Pace(Clock):
    """The same for the executor of paths: the clock follows the trajectory, and whoever drives may listen and stop it."""

    def __init__(self, clock, executor):
        self.clock, self.executor, self.began_s, self.listen = clock, executor, 0.0, None

    def time(self):
        return self.clock.now_s

    def sleep(self, seconds):
        if self.executor.following_path:
            self.clock.now_s = self.began_s + float(self.executor.current_traj_time)
            if self.listen:
                self.listen()


class Failed(Exception):
    """An action that pyrobosim did not carry out. `status` is its own; `by` names a shut door in the way."""

    def __init__(self, status, message, by=None):
        super().__init__(message)
        self.status, self.by = status, by


class Workshop:
    """One problem, laid out and failing by a seed. Names of doors, places and poses are those that descry is told."""

    def __init__(self, problem, seed):
        self.problem, self.facts = problem, PROBLEMS[problem]
        self.clock = actions.time = Clock()
        self.world = _world(self.facts, seed)
        self.robot = self.world.robots[0]
        self.pace = execution.time = Pace(self.clock, self.robot.path_executor)
        self.doors = {f"{h.room_start.name} {h.room_end.name} hall": h for h in self.world.hallways}
        self.spawns = {spawn.parent.name: spawn for spawn in self.world.object_spawns}
        self.items = {o.name: o for o in self.world.objects}
        self.stations = {"beginning": self.robot.get_pose()}
        for name, spawn in self.spawns.items():
            self.stations[name + " front"] = min(spawn.nav_poses, key=lambda p: math.hypot(p.x, p.y))
        for name, hall in self.doors.items():
            self.stations.update({f"{name} side {k}": p for k, p in enumerate(hall.nav_poses, 1)})
        self.full = set()  # furniture at which a placing found no room, until something is taken from there
        self.done, self.failed, self.driven_m = 0, 0, 0.0

    def station(self):
        """The station where the robot stands, the nearest one if it was stopped between them."""
        here = self.robot.get_pose()
        turn = lambda p: abs((p.get_yaw() - here.get_yaw() + math.pi) % (2 * math.pi) - math.pi)
        return min(self.stations, key=lambda s: (round(here.get_linear_distance(self.stations[s]), 6), turn(self.stations[s])))

    def place(self):
        """The furniture at which the robot stands, or None."""
        return next((name for name, spawn in self.spawns.items() if self.robot.location is spawn), None)

    def goal_holds(self):
        """The workshop's own test of the goal."""
        brought = all(self.items[item].parent is self.spawns[place] for item, place in self.facts["bring"])
        return brought and not any(self.spawns[name].parent.is_open for name in self.facts["close"])

    def navigate(self, points, yaw, listen=None):
        """Follows a path of points; `listen` is called as it goes and may raise to stop it."""
        poses = [self.robot.get_pose()] + [Pose(x=x, y=y) for x, y in points[1:]]
        poses[-1] = Pose(x=points[-1][0], y=points[-1][1], yaw=yaw)
        path = Path(poses=poses)
        path.fill_yaws()
        self._check_way(path)
        self.pace.began_s, self.pace.listen = self.clock.now_s, listen
        try:
            self._act(TaskAction("navigate", path=path))
        finally:
            self.driven_m += self.clock.now_s - self.pace.began_s  # 1 m/s
            self.robot.executing_nav = self.robot.executing_action = False
            self.robot.path_executor.reset_state()

    def _check_way(self, path):
        if is_path_collision_free(path, self.robot):
            return
        line = shapely.LineString([(p.x, p.y) for p in path.poses])
        shut = [name for name, hall in self.doors.items() if not hall.is_open and line.intersects(hall.inflated_closed_polygon)]
        because = f"the {shut[0]} is shut" if shut else "something is in the way"
        raise Failed(ExecutionStatus.PLANNING_FAILURE, because, by=shut[0] if shut else None)

    def pick(self, item):
        self._act(TaskAction("pick", object=item))
        self.full.discard(self.place())

    def put(self):
        try:
            self._act(TaskAction("place"))
        except Failed as failure:
            if failure.status is ExecutionStatus.PLANNING_FAILURE:
                self.full.add(self.place())
            raise

    def open(self):
        self._act(TaskAction("open"))

    def close(self):
        self._act(TaskAction("close"))

    def _act(self, action):
        result = self.robot.execute_action(action)
        if not result.is_success():
            self.failed += 1
            raise Failed(result.status, result.message or result.status.name)
        self.done += 1


def _world(facts, seed):
    data = pathlib.Path(pyrobosim.__file__).parent / "data"
    text = yaml.safe_load((data / "roscon_2024_workshop_world.yaml").read_text())
    for hall in text["hallways"]:
        hall["is_open"] = not facts["halls_shut"] or {hall["room_start"], hall["room_end"]} in OPEN_HALLS
    for location in text["locations"]:
        location["is_open"] = location["name"] not in facts["shut"]
    robot = text["robots"][0]
    for sensor in ("sensors", "start_sensor_threads"):  # a lidar for pictures, in a thread of its own
        robot.pop(sensor, None)
    robot["action_execution_options"] = {
        name: {"success_probability": chance, "battery_usage": facts["use"][name], "rng_seed": 1000 * seed + k,
               "delay": 0.0 if name == "navigate" else HAND_S}
        for k, (name, chance) in enumerate(facts["chance"].items())
    }
    logging.disable(logging.CRITICAL)
    np.random.seed(seed)
    return WorldYamlLoader().from_yaml(copy.deepcopy(text), data)
