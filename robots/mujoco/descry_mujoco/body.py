"""The room as a body that descry drives: physics moves the base and what it pushes; the camera falls short as a camera does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import descry_robot as descry
import mujoco
import numpy as np

from . import machine, recording, truth
from .hand import Hand
from .localisation import Localisation, Pose, apply, turn
from .noise import DepthNoise
from .scenes import Scene
from .stage import Stage

# What the body says of itself: along the ground and on the spot; the head; how far the hand goes and how wide it opens.
LINEAR_M_S, ANGULAR_RAD_S, HEAD_RAD_S, REACH_M, OPENING_M = 0.4, 0.8, 1.0, 1.6, 0.11
# How quickly the base gains speed and brakes.
GAIN_M_S2, GAIN_RAD_S2 = 4.0, 10.0
HEAD = {"base_from_head": [0.0, 0.0, machine.HEAD_HEIGHT_M], "pan_limit_rad": 2.6, "tilt_down_rad": 1.2, "tilt_up_rad": 0.8}
CELL_M, CLEARANCE_M = 0.05, 0.1
FRAME_S = 0.1
# Between two commands to the motors; and how long a base may stand still before it counts as blocked.
TICK_S, STUCK_S = 0.02, 1.5
# The base is still this long after it was told to stand.
HALT_S = 0.1
# How far from the middle of a door the base stands at most to open it, and how fast the leaf goes.
DOOR_REACH_M, DOOR_M_S = 1.2, 0.3
# A point of the route that is nearer than this is not driven to.
NEAR_M = 0.02


@dataclass(frozen=True)
class Settings:
    """How well the body knows where it is, and how well it sees."""

    seed: int = 1
    sigma_m: float = 0.03
    sigma_rad: float = math.radians(2.0)
    holes: float = 0.002
    noise_scale: float = 1.0
    truth: Path | None = None


class Body(descry.Robot):
    """A round base with a pan-tilt head and a hand, in a scene."""

    def __init__(self, scene: Scene, settings: Settings):
        self.scene, self.settings = scene, settings
        self.stage = Stage(scene, robot=True)
        self.model, self.data = self.stage.model, self.stage.data
        self.localisation = Localisation(settings.sigma_m, settings.sigma_rad, np.random.default_rng([settings.seed, 5]))
        self.gaze, self.frames = (0.0, 0.0), 0
        self.arm = Hand(self.stage, self.run)
        machine.place(self.model, self.data, scene.start)
        for door in scene.doors:
            self._slide(door.name, 0.0 if door.shut else door.width_m)
            self.data.joint(door.name).qpos[0] = 0.0 if door.shut else door.width_m
        self.run(0.6)
        # What has settled is where the clock begins.
        self.data.time = 0.0
        self.stands = self.believed()
        self.tell_truth()

    # What it is.

    def now_ns(self) -> int:
        return round(self.data.time * 1e9)

    def hello(self):
        camera = self.stage.camera
        cx, cy = camera.centre_px
        width, height = (math.ceil(side / CELL_M) for side in self.scene.room_m)
        origin = [-0.5 * width * CELL_M, -0.5 * height * CELL_M]
        return {
            "name": f"MuJoCo {self.scene.name} {self.scene.seed}", "simulated": True, "up": [0, 0, 1],
            "pose_sigma_m": max(self.settings.sigma_m, 0.001), "pose_sigma_rad": max(self.settings.sigma_rad, 0.001),
            "base": {"footprint": {"disc": {"radius_m": machine.RADIUS_M}}, "linear_m_s": LINEAR_M_S, "angular_rad_s": ANGULAR_RAD_S, "clearance_m": CLEARANCE_M},
            "camera": {
                "width": camera.width, "height": camera.height, "fx": camera.focal_px, "fy": camera.focal_px, "cx": cx, "cy": cy,
                "range_m": list(DepthNoise().range_m), "colour": True,
            },
            "head": HEAD, "arm": {"reach_m": REACH_M, "hand_opening_m": OPENING_M},
            "map": {"resolution_m": CELL_M, "origin_m": origin, "width": width, "height": height},
            "surfaces": [{"name": t.name, "outline_m": t.outline_m(), "height_m": t.height_m, "room": t.room} for t in self.scene.tables],
            "rooms": [{"name": r.name, "outline_m": r.outline_m()} for r in self.scene.rooms],
            "doors": [
                {"name": d.name, "centre_m": d.centre_m, "along_rad": d.along_rad, "width_m": d.width_m, "between": d.between}
                for d in self.scene.doors
            ],
        }, self._cells(width, height, origin)

    def _cells(self, width: int, height: int, origin: list[float]) -> bytes:
        """The floor under tables is occupied, and what is no room's floor and no door's."""
        x = origin[0] + (np.arange(width) + 0.5) * CELL_M
        y = origin[1] + (np.arange(height) + 0.5) * CELL_M
        x, y = np.meshgrid(x, y)
        inside = (np.abs(x) <= 0.5 * self.scene.room_m[0]) & (np.abs(y) <= 0.5 * self.scene.room_m[1])
        floors = [part.holds(x, y) for part in [*self.scene.rooms, *self.scene.doors]]
        free = np.logical_or.reduce(floors) & inside if floors else inside
        for table in self.scene.tables:
            free &= ~table.has_below(x, y)
        return (~free).astype(np.uint8).tobytes()

    # Where it is.

    def truth(self) -> Pose:
        return tuple(float(self.data.joint(name).qpos[0]) for name in ("x", "y", "yaw"))

    def believed(self) -> Pose:
        return self.localisation.believed(self.truth())

    def pose(self, request):
        return {"map_from_base": descry.planar(*self.stands)}

    def stop(self) -> None:
        self._halt()

    def _halt(self) -> None:
        """The base comes to rest, and knows where it stands until it drives again."""
        self._command(0.0, 0.0)
        self.run(HALT_S)
        self.stands = self.believed()
        self.tell_truth()

    def tell_truth(self) -> None:
        """For reports: what no answer of the body says."""
        if self.settings.truth is not None:
            truth.tell(self.settings.truth, self.stage, self.now_ns(), self.truth(), self.arm.held)

    # The base.

    def run(self, seconds: float) -> None:
        """Lets time pass. What the hand holds goes where the base goes."""
        for _ in range(max(1, round(seconds / TICK_S))):
            self.arm.carry(self.truth())
            mujoco.mj_step(self.model, self.data, round(TICK_S / self.model.opt.timestep))

    def _command(self, forward_m_s: float, turning_rad_s: float) -> None:
        yaw = self.truth()[2]
        for name, value in (("x", forward_m_s * math.cos(yaw)), ("y", forward_m_s * math.sin(yaw)), ("yaw", turning_rad_s)):
            self.data.actuator(name).ctrl[0] = value

    def drive_to(self, request, to, route_m):
        goal = to["pose"]
        points = [np.array(p) for p in route_m or [self.believed()[:2], (goal["x_m"], goal["y_m"])]]
        legs = sum(float(np.linalg.norm(b - a)) for a, b in zip(points, points[1:]))
        self.localisation.depart()
        trip = Trip(self, request, max(legs, 1e-6))
        for point in points[1:]:
            self._go_straight(trip, point)
        self._turn_to(trip, goal["yaw_rad"])
        self.localisation.share = 1.0
        self._halt()
        return {"distance_m": trip.driven_m, "map_from_base": descry.planar(*self.stands)}

    def blocked(self) -> descry.Failure:
        """What the base says that does not come on."""
        doors = self.arm.felt(machine.BASE) & {d.name for d in self.scene.doors}
        if doors:
            name = doors.pop()
            return descry.Failure("blocked", f"the {name} is shut", by=name)
        return descry.Failure("blocked", "the base pushes against something and does not move")

    def _go_straight(self, trip: Trip, point: np.ndarray) -> None:
        x, y, yaw = self.believed()
        way = point - (x, y)
        length = float(np.linalg.norm(way))
        if length < NEAR_M:
            return
        self._turn_to(trip, math.atan2(way[1], way[0]))
        cruise = cruising(length, LINEAR_M_S, GAIN_M_S2)
        start = np.array([x, y])
        along = way / length
        while True:
            x, y, yaw = self.believed()
            left = length - float(((x, y) - start) @ along)
            if left <= 0.002:
                return
            aside = float(along[0] * (y - start[1]) - along[1] * (x - start[0]))
            heading = math.atan2(along[1], along[0]) - math.atan2(aside, 0.4)
            speed = min(cruise, trip.speed + GAIN_M_S2 * TICK_S, math.sqrt(2.0 * GAIN_M_S2 * left) + 0.01)
            trip.go(speed, 3.0 * turn(yaw, heading))

    def _turn_to(self, trip: Trip, heading: float) -> None:
        trip.halt()
        cruise = cruising(abs(turn(self.believed()[2], heading)), ANGULAR_RAD_S, GAIN_RAD_S2)
        speed = 0.0
        while True:
            left = turn(self.believed()[2], heading)
            if abs(left) <= 0.004:
                return
            speed = min(cruise, speed + GAIN_RAD_S2 * TICK_S, math.sqrt(2.0 * GAIN_RAD_S2 * abs(left)) + 0.02)
            trip.go(0.0, math.copysign(min(speed, abs(left) / TICK_S), left))

    # The head and the camera.

    def look_at(self, request, point_m):
        pan, tilt, miss_rad = descry.aim(HEAD, descry.into_base(self.stands, point_m))
        start = self.gaze
        seconds = max(abs(pan - start[0]), abs(tilt - start[1])) / HEAD_RAD_S
        ticks = max(1, math.ceil(seconds / TICK_S))
        for k in range(1, ticks + 1):
            self._aim(*(a + (b - a) * k / ticks for a, b in zip(start, (pan, tilt))))
            self.run(TICK_S)
            if k % 10 == 0:
                request.feedback(k / ticks)
        for _ in range(50):
            if max(abs(self.data.joint(n).qpos[0] - v) for n, v in (("pan", pan), ("tilt", tilt))) < 5e-4:
                break
            self.run(TICK_S)
        return {"miss_rad": miss_rad}

    def _aim(self, pan: float, tilt: float) -> None:
        self.gaze = pan, tilt
        self.data.actuator("pan").ctrl[0], self.data.actuator("tilt").ctrl[0] = pan, tilt

    def sense(self, request):
        self.run(FRAME_S)
        request.check()
        self.frames += 1
        frame = self.stage.frame(machine.HEAD_CAMERA)
        how = DepthNoise(scale=self.settings.noise_scale, holes=self.settings.holes)
        depth_m = self.stage.measure(frame, how, (self.settings.seed, 6, self.frames))
        chain = {"map_from_base": descry.planar(*self.stands), "base_from_camera": descry.base_from_camera(HEAD, *self.gaze)}
        return chain, recording.millimetres(depth_m).astype("<u2").tobytes() + frame.colour.tobytes()

    # The hand.

    def push_aside(self, request, object, direction, distance_m):
        self._reach(object)
        to_truth = self.localisation.truth_from_map(self.truth())
        way = apply((0.0, 0.0, to_truth[2]), np.array([*direction, 0.0]))
        moved_m = self.arm.push(request, apply(to_truth, np.array(object)), way / np.linalg.norm(way), distance_m)
        self.tell_truth()
        return {"moved_m": moved_m}

    def open_door(self, request, door):
        way = next((d for d in self.scene.doors if d.name == door), None)
        if way is None:
            raise descry.Failure("unreachable", f"there is no {door}")
        away = math.dist(self.stands[:2], way.centre_m)
        if away > DOOR_REACH_M:
            raise descry.Failure("unreachable", f"the {door} is {away:.2f} m away, and it is opened from {DOOR_REACH_M:.2f} m")
        start = float(self.data.joint(door).qpos[0])
        ticks = max(1, math.ceil(way.width_m / (DOOR_M_S * TICK_S)))
        for k in range(1, ticks + 1):
            self._slide(door, start + (way.width_m - start) * k / ticks)
            self.run(TICK_S)
            request.feedback(k / ticks)
        self.run(1.0)
        if truth.is_shut(self.stage, door):
            raise descry.Failure("slipped", f"the {door} is jammed", moved_m=0.0)
        self.tell_truth()
        return {}

    def _slide(self, door: str, at_m: float) -> None:
        """Where the leaf of a door is to be: 0 is shut."""
        self.data.actuator(door).ctrl[0] = at_m

    def grasp(self, request, object, width_m):
        if self.arm.held is not None:
            raise descry.Failure("unable", "the hand is full")
        if width_m > OPENING_M:
            raise descry.Failure("unable", f"it is {width_m:.3f} m wide and the hand opens {OPENING_M:.3f} m")
        self._reach(object)
        at = apply(self.localisation.truth_from_map(self.truth()), np.array(object))
        held_m = self.arm.grasp(request, at, OPENING_M)
        self.tell_truth()
        return {"width_m": held_m}

    def place(self, request, foot):
        if self.arm.held is None:
            raise descry.Failure("unable", "the hand is empty")
        self._reach(foot)
        self.arm.place(request, apply(self.localisation.truth_from_map(self.truth()), np.array(foot)))
        self.tell_truth()
        return {}

    def hand(self, request):
        return {"holds": self.arm.held is not None}

    def _reach(self, point) -> None:
        x, y, _ = self.stands
        away = math.hypot(point[0] - x, point[1] - y)
        if away > REACH_M:
            raise descry.Failure("unreachable", f"it is {away:.2f} m away and the arm reaches {REACH_M:.2f} m")


class Trip:
    """A drive that is under way."""

    def __init__(self, body: Body, request, length_m: float):
        self.body, self.request, self.length_m = body, request, length_m
        self.driven_m, self.speed, self._stuck_s, self._ticks = 0.0, 0.0, 0.0, 0

    def halt(self) -> None:
        self.speed = 0.0

    def go(self, speed_m_s: float, turning_rad_s: float) -> None:
        """One tick of the motors."""
        body = self.body
        before = body.truth()
        self.speed = speed_m_s
        body._command(speed_m_s, turning_rad_s)
        body.run(TICK_S)
        after = body.truth()
        moved = math.hypot(after[0] - before[0], after[1] - before[1])
        self.driven_m += moved
        body.localisation.share = min(self.driven_m / self.length_m, 1.0)
        wanted = speed_m_s * TICK_S + 0.3 * abs(turning_rad_s) * TICK_S
        done = moved + 0.3 * abs(turn(before[2], after[2]))
        self._stuck_s = self._stuck_s + TICK_S if done < 0.2 * wanted else 0.0
        if self._stuck_s > STUCK_S:
            raise body.blocked()
        self._ticks += 1
        if self._ticks % 10 == 0:
            self.request.feedback(0.99 * body.localisation.share, self.driven_m)
        else:
            self.request.check_time()


def cruising(amount: float, mean_speed: float, gain: float) -> float:
    """The speed between speeding up and braking with which `amount` takes as long as at the mean speed all the way."""
    seconds = amount / mean_speed
    root = (gain * seconds) ** 2 - 4.0 * gain * amount
    return 0.5 * (gain * seconds - math.sqrt(root)) if root > 0.0 else 0.5 * gain * seconds
