"""A flat: a kitchen, a study, a wall between them with a sliding door that may be shut, four surfaces of different heights."""

from __future__ import annotations

import math

import numpy as np

from .scenes import Arranger, Doorway, Room, Scene, Table, wood
from .things import Maker

WALL_M, SHUT_SHARE = 0.15, 0.3


def home(seed: int, rng: np.random.Generator) -> Scene:
    """Kitchen to the west, study to the east. The kitchen table stands free, the others along the walls; cup A on any of them."""
    kitchen_m, study_m, deep_m = (float(rng.uniform(low, high)) for low, high in ((4.0, 4.6), (3.8, 4.4), (4.4, 4.9)))
    width_m = kitchen_m + WALL_M + study_m
    west, wall, east = -0.5 * width_m, -0.5 * width_m + kitchen_m, 0.5 * width_m
    rooms = [
        Room("kitchen", (0.5 * (west + wall), 0.0), (kitchen_m, deep_m)),
        Room("study", (0.5 * (wall + WALL_M + east), 0.0), (study_m, deep_m)),
    ]
    between = (wall + 0.5 * WALL_M, float(rng.uniform(-0.7, -0.1)) - 0.3)
    door = Doorway("study door", between, 0.5 * math.pi, 0.95, WALL_M, ("kitchen", "study"), bool(rng.random() < SHUT_SHARE))
    tables = _surfaces(rng, west, east, deep_m)
    scene = Scene("home", seed, (width_m, deep_m), tables, floor_colour=wood(rng), wall_colour=wood(rng), rooms=rooms, doors=[door])
    scene.start = (wall - 0.7, 0.5 * deep_m - float(rng.uniform(1.2, 1.6)), math.pi + float(rng.uniform(-0.4, 0.4)))
    _set_out(scene, rng)
    scene.target = "cup A"
    return scene


def _surfaces(rng: np.random.Generator, west: float, east: float, deep_m: float) -> list[Table]:
    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def against(name: str, room: str, size: tuple[float, float], height: float, at: tuple[float, float], yaw: float, leg: float) -> Table:
        return Table(name, size, height, at, yaw, top_m=between(0.02, 0.04), leg_m=leg, colour=wood(rng), room=room)

    counter, desk, board = between(0.55, 0.62), between(0.6, 0.7), between(0.3, 0.36)
    gap = 0.03
    return [
        against("kitchen table", "kitchen", (between(1.1, 1.3), between(0.75, 0.85)), between(0.74, 0.78), (west + between(1.7, 1.9), between(-0.6, -0.3)), between(-0.25, 0.25), 0.05),
        against("counter", "kitchen", (between(1.4, 1.8), counter), between(0.87, 0.93), (west + between(1.4, 1.7), 0.5 * deep_m - 0.5 * counter - gap), 0.0, 0.0),
        against("desk", "study", (between(1.2, 1.5), desk), between(0.64, 0.70), (east - between(1.2, 1.4), -0.5 * deep_m + 0.5 * desk + gap), 0.0, 0.06),
        against("board", "study", (between(1.1, 1.3), board), between(0.96, 1.04), (east - between(1.2, 1.5), 0.5 * deep_m - 0.5 * board - gap), 0.0, 0.04),
    ]


def _set_out(scene: Scene, rng: np.random.Generator) -> None:
    """The cups and a mug anywhere, two or three other things a surface; what is large finds its place first."""
    make, put = Maker(rng), Arranger(scene, rng)
    tables = list(scene.tables)
    wanted = [(thing, tables[int(rng.integers(len(tables)))]) for thing in (make.cup_a(), make.cup_b(), make.mug())]
    for table in tables:
        narrow = table.name == "board"
        others = "bottle canister small_box" if narrow else "bottle canister small_box bowl white_cylinder tall_box"
        wanted += [(make.any_of(others), table) for _ in range(int(rng.integers(1, 3 if narrow else 4)))]
    for thing, table in sorted(wanted, key=lambda pair: -pair[0].radius_m):
        put.put(thing, table, tuple(side - 0.06 for side in table.size_m), gap=0.04)
