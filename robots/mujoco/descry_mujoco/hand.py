"""The hand: it pushes with a pad that comes down behind things, and lifts them by suction from above."""

from __future__ import annotations

import math
from typing import Callable

import descry_robot as descry
import mujoco
import numpy as np

from . import machine
from .stage import Stage
from .world import FELT

TICK_S, PUSH_M_S, MOVE_M_S, CARRY_M_S = 0.02, 0.1, 0.4, 1.0
# A push starts this far behind the middle of an object, at the first of these where the hand has room.
BEHIND_M = (0.06, 0.09, 0.12, 0.15, 0.18, 0.21, 0.24)
# Above its surface: low, so that what is pushed slides and does not fall.
PUSH_HEIGHT_M = 0.035
# A push that felt its object for less than this share of what was asked for has slipped.
SLIPPED_SHARE = 0.5
# Over things on its way, and beside the middle of what it is to lift, metres.
ABOVE_M, ASIDE_M = 0.45, 0.03
# The range sensor in the wrist looks down on so much around a point, in steps; and for so long, seconds.
FIND_M, FIND_STEP_M, FIND_S = 0.08, 0.01, 0.2
# What stops higher than this above where it was to stand, stands on something else.
STANDS_M = 0.02
# Where what is held is carried: in the base's frame, beside what the camera sees and above the base.
CARRIED_M = (0.0, -0.2, 1.0)


class Hand:
    """A hand in the room. `run` lets time pass."""

    def __init__(self, stage: Stage, run: Callable[[float], None]):
        self.model, self.data, self.scene, self._run = stage.model, stage.data, stage.scene, run
        self.held: str | None = None
        self._at, self._yaw, self._busy = np.array(machine.PARKED_M), 0.0, False

    def carry(self, base: tuple[float, float, float]) -> None:
        """What is held goes with the base."""
        if self.held is None or self._busy:
            return
        way = self._carried(base) - self._at
        step = CARRY_M_S * TICK_S
        self._put(self._at + way * min(1.0, step / max(float(np.linalg.norm(way)), 1e-9)), self._yaw)

    @staticmethod
    def _carried(base: tuple[float, float, float]) -> np.ndarray:
        c, s = math.cos(base[2]), math.sin(base[2])
        x, y, z = CARRIED_M
        return np.array([base[0] + c * x - s * y, base[1] + s * x + c * y, z])

    def _put(self, at: np.ndarray, yaw: float) -> None:
        self._at, self._yaw = at, yaw
        machine.put_hand(self.data, at, yaw)

    def _park(self) -> None:
        self._put(np.array(machine.PARKED_M), 0.0)
        self._run(0.5)

    def felt(self, body: str = machine.HAND) -> set[str]:
        """The bodies that a body touches; the room is "world"."""
        number, felt = self.model.body(body).id, set()
        for contact in self.data.contact[: self.data.ncon]:
            pair = [self.model.geom_bodyid[g] for g in (contact.geom1, contact.geom2)]
            if number in pair:
                felt.add(self.model.body(pair[0] if pair[1] == number else pair[1]).name)
        return felt

    def _move(self, request, to: np.ndarray, speed_m_s: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Straight to a point; true if it got there before `until`."""
        start, way = self._at, to - self._at
        length = float(np.linalg.norm(way))
        steps = max(1, math.ceil(length / (speed_m_s * TICK_S)))
        for k in range(1, steps + 1):
            self._put(start + way * k / steps, self._yaw)
            self._run(TICK_S)
            request.feedback(0.5)
            if until():
                return False
        return True

    def push(self, request, at: np.ndarray, way: np.ndarray, distance_m: float) -> float:
        """Pushes what stands at a point; how far the hand went while it felt something."""
        if self.held is not None:
            raise descry.Failure("unable", "the hand is full")
        start = self._room_behind(at, way)
        if start is None:
            raise descry.Failure("slipped", "there is no room for the hand behind it", moved_m=0.0)
        approach_m = float(np.linalg.norm((at - start)[:2]))
        gone, moved, step = 0.0, 0.0, PUSH_M_S * TICK_S
        try:
            while moved < distance_m and gone < approach_m + (distance_m + 0.1 if moved > 0.0 else 0.05):
                gone += step
                self._put(start + gone * way, self._yaw)
                self._run(TICK_S)
                moved += step if self.felt() else 0.0
                request.feedback(min(moved / distance_m, 1.0))
        finally:
            self._park()
        if moved < SLIPPED_SHARE * distance_m:
            because = "the hand met nothing there" if moved == 0.0 else f"it came off after {moved:.2f} m"
            raise descry.Failure("slipped", because, moved_m=moved)
        return moved

    def _room_behind(self, at: np.ndarray, way: np.ndarray) -> np.ndarray | None:
        """Where the hand can come down behind what it is to push."""
        heights = [t.height_m for t in self.scene.tables if t.height_m <= at[2] + 0.02]
        height = max(heights, default=0.0) + PUSH_HEIGHT_M
        for behind in BEHIND_M:
            start = np.array([*(at - behind * way)[:2], height])
            self._put(start, math.atan2(way[1], way[0]))
            mujoco.mj_forward(self.model, self.data)
            if not self.felt():
                return start
        self._put(np.array(machine.PARKED_M), 0.0)
        mujoco.mj_forward(self.model, self.data)
        return None

    def grasp(self, request, at: np.ndarray, opening_m: float) -> float:
        """Comes down on what stands at a point and lifts it; how wide that is."""
        self._put(at + [0.0, 0.0, ABOVE_M], 0.0)
        self._busy = True
        try:
            self._run(FIND_S)
            at = self._found(at)
            self._move(request, at, PUSH_M_S, until=self.felt)
            thing = self._under(at, opening_m)
            self._hold(thing.name)
            self._move(request, self._at + [0.0, 0.0, ABOVE_M], PUSH_M_S)
        finally:
            self._busy = False
            if self.held is None:
                self._park()
        return min(2.0 * thing.radius_m, opening_m)

    def _found(self, at: np.ndarray) -> np.ndarray:
        """The middle of the top that is nearest to a point, of those that reach above it, as ranges from above show it; localisation
        errs by more than the hand may. The point itself if there is none."""
        steps = round(FIND_M / FIND_STEP_M)
        cells = [(i, j) for i in range(-steps, steps + 1) for j in range(-steps, steps + 1)]
        tops = {cell for cell in cells if self._height_under(self._cell(at, cell) + [0.0, 0.0, ABOVE_M]) > at[2]}
        middles = [np.mean([self._cell(at, cell) for cell in top], axis=0) for top in connected(tops)]
        return min(middles, key=lambda m: float(np.linalg.norm(m - at)), default=at)

    @staticmethod
    def _cell(at: np.ndarray, cell: tuple[int, int]) -> np.ndarray:
        return at + [FIND_STEP_M * cell[0], FIND_STEP_M * cell[1], 0.0]

    def _height_under(self, eye: np.ndarray) -> float:
        """What a ray straight down meets of things that can move; the depths if nothing."""
        groups, geom = np.zeros(6, dtype=np.uint8), np.zeros(1, dtype=np.int32)
        groups[FELT] = 1
        away = mujoco.mj_ray(self.model, self.data, eye, np.array([0.0, 0.0, -1.0]), groups, 0, self.model.body(machine.HAND).id, geom)
        return float(eye[2] - away) if away >= 0.0 else -math.inf

    def _under(self, at: np.ndarray, opening_m: float):
        """The thing that the hand has come down on."""
        things = {p.thing.name: p.thing for p in self.scene.placed}
        felt = self.felt() & set(things)
        if len(felt) != 1:
            because = "the hand closed on nothing" if not felt else f"{len(felt)} things are in its way"
            raise descry.Failure("slipped", because, moved_m=0.0)
        thing = things[felt.pop()]
        aside_m = float(np.linalg.norm(self.data.body(thing.name).xpos[:2] - at[:2]))
        narrow = min(thing.size["x"], thing.size["y"]) if thing.is_box else 2.0 * thing.radius_m
        if aside_m > ASIDE_M or narrow > opening_m:
            raise descry.Failure("slipped", "it slid out of the hand", moved_m=0.0)
        return thing

    def _hold(self, name: str) -> None:
        """The weld between hand and thing keeps them as they are to each other now."""
        hand, thing = self.data.body(machine.HAND), self.data.body(name)
        back, place, turned = np.zeros(4), np.zeros(3), np.zeros(4)
        mujoco.mju_negQuat(back, hand.xquat)
        mujoco.mju_rotVecQuat(place, thing.xpos - hand.xpos, back)
        mujoco.mju_mulQuat(turned, back, thing.xquat)
        number = self.model.equality(name).id
        self.model.eq_data[number, :11] = [0.0, 0.0, 0.0, *place, *turned, 1.0]
        self.data.eq_active[number] = 1
        self.held = name

    def place(self, request, foot: np.ndarray) -> None:
        """Puts what it holds down with its foot at a point."""
        held, grip = self.held, self._at - self.data.body(self.held).xpos
        over = foot + [grip[0], grip[1], grip[2] + ABOVE_M]
        height = max(over[2], self._at[2])
        self._busy = True
        try:
            self._move(request, np.array([*self._at[:2], height]), MOVE_M_S)
            self._move(request, np.array([*over[:2], height]), MOVE_M_S)
            down = over - [0.0, 0.0, ABOVE_M - 0.001]
            arrived = self._move(request, down, PUSH_M_S, until=lambda: bool(self.felt(held) - {machine.HAND}))
            if not arrived and self.data.body(held).xpos[2] - foot[2] > STANDS_M:
                self._move(request, self._at + [0.0, 0.0, ABOVE_M], MOVE_M_S)
                raise descry.Failure("blocked", "something stands there")
            self.data.eq_active[self.model.equality(held).id] = 0
            self.held = None
        finally:
            self._busy = False
        self._park()


def connected(cells: set[tuple[int, int]]) -> list[set[tuple[int, int]]]:
    """Cells that hang together by their sides."""
    left, parts = set(cells), []
    while left:
        part, edge = set(), [min(left)]
        while edge:
            i, j = edge.pop()
            if (i, j) in left:
                left.remove((i, j))
                part.add((i, j))
                edge += [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        parts.append(part)
    return parts
