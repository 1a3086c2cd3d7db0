"""A whole robot in a hundred lines: a disc on wheels with a pan-tilt depth camera and a laser, alone in a room with an empty table.

Copy it, and put your driver where its small simulation is. It passes `descry robot check "program:python3 template.py"`.
"""

import array
import math
import sys

import descry_robot as descry

ROOM, CELL, TABLE, TABLE_TOP = 2.5, 0.05, (0.8, 0.4), 0.72  # half sides of the room and the table, metres
SPEED, TURN = 0.4, 0.8  # metres and radians a second
WIDTH, HEIGHT, FOCAL = 64, 48, 58.0
LEVEL = [0.0, 0.0, 0.0, 1.0]
LASER = {"base_from_laser": {"translation": [0.0, 0.0, 0.4], "rotation": LEVEL}, "first_rad": -1.57, "step_rad": 0.0175, "readings": 180, "reach_m": 8.0}
HEAD = {"base_from_head": [0.0, 0.0, 1.4], "pan_limit_rad": 2.6, "tilt_down_rad": 1.2, "tilt_up_rad": 0.8}


class Template(descry.Robot):
    def __init__(self):
        self.clock_s, self.at, self.gaze = 0.0, (-2.0, 0.0, 0.0), (0.0, 0.0)

    def now_ns(self):
        return round(self.clock_s * 1e9)

    def hello(self):
        cells = round(2 * ROOM / CELL)
        middle = [-ROOM + (k + 0.5) * CELL for k in range(cells)]
        occupied = bytes(abs(x) < TABLE[0] and abs(y) < TABLE[1] for y in middle for x in middle)
        corners = [[i * TABLE[0], j * TABLE[1]] for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        return {
            "name": "template", "simulated": True, "up": [0, 0, 1], "pose_sigma_m": 0.03, "pose_sigma_rad": 0.03, "head": HEAD, "laser": LASER,
            "base": {"footprint": {"disc": {"radius_m": 0.25}}, "linear_m_s": SPEED, "angular_rad_s": TURN},
            "camera": {"width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": 31.5, "cy": 23.5, "range_m": [0.4, 6.0]},
            "map": {"resolution_m": CELL, "origin_m": [-ROOM, -ROOM], "width": cells, "height": cells},
            "surfaces": [{"name": "table", "outline_m": corners, "height_m": TABLE_TOP}],
        }, occupied

    def pose(self, request):
        return {"map_from_base": descry.planar(*self.at)}

    def drive_to(self, request, to, route_m):
        goal = to["pose"]
        legs = []  # where each step of the way ends, and what it takes: a turn, then straight on, and a turn at the end
        x, y, yaw = self.at
        for px, py in route_m[1:]:
            heading, length = math.atan2(py - y, px - x), math.hypot(px - x, py - y)
            legs += [((x, y, heading), self.turning(yaw, heading), 0.0)]
            steps = math.ceil(length / 0.05)
            legs += [((x + (px - x) * k / steps, y + (py - y) * k / steps, heading), length / steps / SPEED, length / steps) for k in range(1, steps + 1)]
            x, y, yaw = px, py, heading
        legs += [((goal["x_m"], goal["y_m"], goal["yaw_rad"]), self.turning(yaw, goal["yaw_rad"]), 0.0)]
        total_s, driven_m = sum(seconds for _, seconds, _ in legs) or 1.0, 0.0
        for at, seconds, metres in legs:
            if request.elapsed_s() + seconds > request.time_limit_s:
                raise descry.Failure("timed_out", f"the way takes {total_s:.1f} s")
            self.at, self.clock_s, driven_m = at, self.clock_s + seconds, driven_m + metres
            request.feedback(request.elapsed_s() / total_s, driven_m)
        return {"distance_m": driven_m, "map_from_base": descry.planar(*self.at)}

    @staticmethod
    def turning(a, b):
        return abs((b - a + math.pi) % (2 * math.pi) - math.pi) / TURN

    def look_at(self, request, point_m):
        pan, tilt, miss_rad = descry.aim(HEAD, descry.into_base(self.at, point_m))
        self.clock_s += max(abs(pan - self.gaze[0]), abs(tilt - self.gaze[1]))
        self.gaze = pan, tilt
        return {"miss_rad": miss_rad}

    def sense(self, request):
        self.clock_s += 0.1
        chain = {"map_from_base": descry.planar(*self.at), "base_from_camera": descry.base_from_camera(HEAD, *self.gaze)}
        return chain, array.array("H", self.depths_mm()).tobytes()

    def scan(self, request):
        self.clock_s += 0.1
        return {"map_from_base": descry.planar(*self.at)}, descry.ranges([self.wall_m(k) for k in range(LASER["readings"])])

    def wall_m(self, k):
        """How far a level ray goes to the walls, below the table. A real robot reads its laser here."""
        x, y, yaw = self.at
        angle = yaw + LASER["first_rad"] + k * LASER["step_rad"]
        return min((math.copysign(ROOM, d) - p) / d for p, d in ((x, math.cos(angle)), (y, math.sin(angle))) if abs(d) > 1e-9)

    def depths_mm(self):
        """What the camera sees, row by row: floor and table; 0 where nothing returns. A real robot reads its camera here."""
        right, down, forward = descry.camera_axes(*self.gaze)
        x, y, yaw = self.at
        c, s = math.cos(yaw), math.sin(yaw)
        for v in range(HEIGHT):
            for u in range(WIDTH):
                a, b = (u - 31.5) / FOCAL, (v - 23.5) / FOCAL
                bx, by, bz = (f + a * r + b * d for r, d, f in zip(right, down, forward))
                ray, depth = (c * bx - s * by, s * bx + c * by, bz), 0.0
                for plane in (TABLE_TOP, 0.0):
                    z = (plane - 1.4) / ray[2] if ray[2] < -1e-6 else 0.0
                    inside = abs(x + z * ray[0]) < TABLE[0] and abs(y + z * ray[1]) < TABLE[1]
                    if 0.4 < z < 6.0 and (inside or plane == 0.0):
                        depth = z
                        break
                yield round(depth * 1000)


if __name__ == "__main__":
    descry.serve(Template(), *sys.argv[1:])  # over standard input and output, or over the socket that is named
