"""The fake robot's world, without ROS: a room with tables and perhaps a cup, a base that drives straight, a camera on a pan-tilt head,
and a hand.

Run as a program it is a robot of descry: `world.py SEED`, with what `home.toml` says of it. `fake_robot.py` puts it behind ROS 2.
"""

import math
import pathlib
import sys
import threading
import time

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[2] / "python")]
import descry_robot as descry
import numpy as np

ROOM, CELL, RADIUS, HEIGHT, WALL = 2.5, 0.05, 0.035, 0.104, 0.003  # half the room's side and a cell of its map; the cup and its wall
HEAD = {"base_from_head": [0.0, 0.0, 1.3], "pan_limit_rad": 2.6, "tilt_down_rad": 1.2, "tilt_up_rad": 0.8}
WIDE, HIGH, FOCAL, SPEED, TICK_S = 640, 480, 570.0, 3.0, 0.02
REACH_M, OPENING_M, CAUGHT_M = 1.6, 0.1, 0.05
# Name, middle, half sides and height of each table.
TABLE = ("table", (0.0, 0.0), (0.6, 0.4), 0.72)
DESK = ("desk", (1.6, -1.75), (0.5, 0.35), 0.76)


def nearest(candidates):
    """The smallest positive of several distances, pixel by pixel."""
    return np.min([np.where(np.isfinite(t) & (t > 0.05) & ok, t, np.inf) for t, ok in candidates], axis=0)


def outline(table):
    _, (x, y), (a, b), _ = table
    return [[x + i * a, y + j * b] for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


class World:
    """Without a seed the cup is on the only table; a seed puts it somewhere on one of two, or nowhere."""

    def __init__(self, seed=None, has_cup=True):
        self.at, self.gaze, self.tables, self.held = (-1.8, 0.0, 0.0), (0.0, 0.3), [TABLE], False
        self.is_driving, self.shown = False, (None, None)
        self.cup, self.noise = (0.1, -0.05, 0.72), np.random.default_rng(seed or 1)
        if seed is not None:
            self.tables = [TABLE, DESK]
            on = self.noise.choice([0, 0, 1, 1, 2])
            _, middle, half, top = self.tables[on % 2]
            x, y = (m + self.noise.uniform(-1, 1) * (h - 0.12) for m, h in zip(middle, half))
            self.cup, has_cup = (float(x), float(y), top), on < 2
        self.cup = self.cup if has_cup else None

    def occupied(self):
        """The cells of the map, row by row with x fastest: the floor under tables."""
        middles = [-ROOM + (k + 0.5) * CELL for k in range(round(2 * ROOM / CELL))]
        below = lambda x, y: any(abs(x - cx) < a and abs(y - cy) < b for _, (cx, cy), (a, b), _ in self.tables)
        return bytes(below(x, y) for y in middles for x in middles)

    def drive(self, to, upto, is_stopped):
        """Straight to a pose, or up to a share of the way: tells the share at each step; the end tells whether it was stopped."""
        begin, length = self.at, math.dist(self.at[:2], to[:2])
        steps = max(math.ceil(upto * length / SPEED / TICK_S), 1)
        self.is_driving = True
        try:
            for k in range(1, steps + 1):
                if is_stopped():
                    return
                share = k / steps * upto
                self.at = (begin[0] + share * (to[0] - begin[0]), begin[1] + share * (to[1] - begin[1]), to[2])
                time.sleep(TICK_S)
                yield share, share * length
        finally:
            self.is_driving = False

    def reaches(self, point):
        return math.dist(self.at[:2], point[:2]) <= REACH_M

    def grasp(self, point):
        """Closes the hand on the cup; None if it closes on nothing."""
        if self.held or self.cup is None or math.dist(self.cup[:2], point[:2]) > CAUGHT_M:
            return None
        self.cup, self.held = None, True
        return 2 * RADIUS

    def place(self, foot):
        """Puts the cup down on the table beneath."""
        self.cup, self.held = (foot[0], foot[1], min((t[3] for t in self.tables), key=lambda top: abs(top - foot[2]))), False

    def frame(self):
        """Pose, gaze and depths in millimetres, 0 where nothing returns; none if something moved meanwhile."""
        at, gaze, cup = state = self.at, self.gaze, self.cup
        if not self.is_driving and self.shown[0] != state:
            self.shown = state, self.depths(at, *gaze, cup)
        if self.is_driving or state != (self.at, self.gaze, self.cup):
            return None
        z = self.shown[1]
        z = z + self.noise.normal(0.0, 0.001, z.shape) * z * z
        return at, gaze, np.where((z > 0.4) & (z < 6.0), np.rint(z * 1000), 0).astype("<u2")

    def depths(self, at, pan, tilt, cup):
        """Metres along the optical axis, inf where nothing returns, without noise."""
        x, y, yaw = at
        c, s = math.cos(yaw), math.sin(yaw)
        axes = np.array(descry.camera_axes(pan, tilt)) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        u, v = np.meshgrid(np.arange(WIDE), np.arange(HIGH))
        d = ((u - WIDE / 2 + 0.5) / FOCAL)[..., None] * axes[0] + ((v - HIGH / 2 + 0.5) / FOCAL)[..., None] * axes[1] + axes[2]
        o = np.array([x, y, HEAD["base_from_head"][2]])
        with np.errstate(divide="ignore", invalid="ignore"):
            level = lambda z: (z - o[2]) / d[..., 2]
            on = lambda t: (o[0] + t * d[..., 0], o[1] + t * d[..., 1])
            hits = [(level(0.0), True)]
            hits += [((math.copysign(ROOM, 1) * k - o[i]) / d[..., i], True) for i in (0, 1) for k in (-1, 1)]
            for _, middle, half, height in self.tables:
                top = level(height)
                px, py = on(top)
                hits += [(top, (abs(px - middle[0]) < half[0]) & (abs(py - middle[1]) < half[1]))]
            for radius, turn in ((RADIUS, -1), (RADIUS - WALL, 1)) if cup else ():  # outside, from outside; inside, from within
                ex, ey = o[0] - cup[0], o[1] - cup[1]
                a = d[..., 0] ** 2 + d[..., 1] ** 2
                b = ex * d[..., 0] + ey * d[..., 1]
                t = (-b + turn * np.sqrt(b * b - a * (ex * ex + ey * ey - radius * radius))) / a
                z = o[2] + t * d[..., 2]
                hits += [(t, (z > cup[2]) & (z < cup[2] + HEIGHT))]
            for z, inner, outer in ((HEIGHT, RADIUS - WALL, RADIUS), (WALL, 0.0, RADIUS - WALL)) if cup else ():
                t = level(cup[2] + z)
                px, py = on(t)
                r = np.hypot(px - cup[0], py - cup[1])
                hits += [(t, (r <= outer) & (r >= inner))]
            return nearest(hits)


class Plain(descry.Robot):
    """The world as a robot of descry, without ROS."""

    def __init__(self, world):
        self.world, self.began, self.halted = world, time.monotonic(), threading.Event()

    def now_ns(self):
        return round((time.monotonic() - self.began) * 1e9)

    def hello(self):
        cells = round(2 * ROOM / CELL)
        return {
            "name": "plain robot", "up": [0, 0, 1], "pose_sigma_m": 0.05, "pose_sigma_rad": 0.05, "head": HEAD,
            "base": {"footprint": {"disc": {"radius_m": 0.25}}, "linear_m_s": 0.4, "angular_rad_s": 0.8},
            "camera": {"width": WIDE, "height": HIGH, "fx": FOCAL, "fy": FOCAL, "cx": WIDE / 2 - 0.5, "cy": HIGH / 2 - 0.5, "range_m": [0.4, 6.0]},
            "arm": {"reach_m": REACH_M, "hand_opening_m": OPENING_M},
            "map": {"resolution_m": CELL, "origin_m": [-ROOM, -ROOM], "width": cells, "height": cells},
            "surfaces": [{"name": t[0], "outline_m": outline(t), "height_m": t[3]} for t in self.world.tables],
        }, self.world.occupied()

    def pose(self, request):
        return {"map_from_base": descry.planar(*self.world.at)}

    def drive_to(self, request, to, route_m):
        goal, driven_m = to["pose"], 0.0
        for share, driven_m in self.world.drive((goal["x_m"], goal["y_m"], goal["yaw_rad"]), 1.0, lambda: False):
            request.feedback(share, driven_m)
        return {"distance_m": driven_m, **self.pose(request)}

    def look_at(self, request, point_m):
        pan, tilt, miss_rad = descry.aim(HEAD, descry.into_base(self.world.at, point_m))
        self.world.gaze = (pan, tilt)
        return {"miss_rad": miss_rad}

    def sense(self, request):
        at, gaze, millimetres = self.world.frame()
        return {"map_from_base": descry.planar(*at), "base_from_camera": descry.base_from_camera(HEAD, *gaze)}, millimetres.tobytes()

    def grasp(self, request, object, width_m):
        if not self.world.reaches(object):
            raise descry.Failure("unreachable", "it is out of reach")
        width_m = self.world.grasp(object)
        if width_m is None:
            raise descry.Failure("slipped", "the hand closed on nothing", moved_m=0.0)
        return {"width_m": width_m}

    def place(self, request, foot):
        if not self.world.reaches(foot):
            raise descry.Failure("unreachable", "it is out of reach")
        self.world.place(foot)
        return {}

    def hand(self, request):
        return {"holds": self.world.held}


if __name__ == "__main__":
    descry.serve(Plain(World(int(sys.argv[1]))))
