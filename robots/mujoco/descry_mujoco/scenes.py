"""Rooms with tables and things on them. A seed fixes all of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Callable

import numpy as np

from .things import Maker, Outline, Thing, gap_m

# Between two things, and between a thing and the edge of its table, metres.
GAP_M = 0.015
# Whole arrangements tried before a scene is given up, and places tried for a thing within one.
ROUNDS, PLACES = 200, 80


@dataclass
class Table:
    """Stands on the floor; things stand on it. Lengths in metres."""

    name: str
    size_m: tuple[float, float]
    height_m: float
    position_m: tuple[float, float] = (0.0, 0.0)
    yaw_rad: float = 0.0
    top_m: float = 0.03
    # Four legs; a closed body below the top (a sideboard) if zero.
    leg_m: float = 0.05
    colour: tuple[float, float, float] = (0.6, 0.45, 0.3)
    # The room that it stands in, where rooms have names.
    room: str | None = None

    def to_map(self, x: float, y: float) -> tuple[float, float]:
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.position_m[0] + c * x - s * y, self.position_m[1] + s * x + c * y

    def outline_m(self) -> list[tuple[float, float]]:
        a, b = 0.5 * self.size_m[0], 0.5 * self.size_m[1]
        return [self.to_map(i * a, j * b) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]

    def centre_m(self) -> np.ndarray:
        return np.array([*self.position_m, self.height_m])

    def has_below(self, x, y):
        """Whether its top is above (or below) a point of the map, or each of an array of them."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        dx, dy = x - self.position_m[0], y - self.position_m[1]
        return (abs(c * dx + s * dy) <= 0.5 * self.size_m[0]) & (abs(c * dy - s * dx) <= 0.5 * self.size_m[1])


@dataclass
class Room:
    """A floor between walls, its sides along the map's axes. Metres."""

    name: str
    centre_m: tuple[float, float]
    size_m: tuple[float, float]

    def outline_m(self) -> list[tuple[float, float]]:
        (x, y), (a, b) = self.centre_m, (0.5 * side for side in self.size_m)
        return [(x + i * a, y + j * b) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]

    def holds(self, x, y):
        """Whether a point of the map, or each of an array of them, is in it."""
        return (abs(x - self.centre_m[0]) <= 0.5 * self.size_m[0]) & (abs(y - self.centre_m[1]) <= 0.5 * self.size_m[1])


@dataclass
class Doorway:
    """An opening in the wall between two rooms, with a leaf that slides along the wall. Metres."""

    name: str
    centre_m: tuple[float, float]
    # Along the wall, anticlockwise from the map's x.
    along_rad: float
    width_m: float
    wall_m: float
    between: tuple[str, str]
    shut: bool

    def holds(self, x, y):
        """Whether a point of the map, or each of an array of them, is in the opening."""
        c, s = math.cos(self.along_rad), math.sin(self.along_rad)
        dx, dy = x - self.centre_m[0], y - self.centre_m[1]
        return (abs(c * dx + s * dy) <= 0.5 * self.width_m) & (abs(c * dy - s * dx) <= 0.5 * self.wall_m + 0.01)


@dataclass
class Placed:
    """A thing, and where the middle of its foot stands in the map."""

    thing: Thing
    surface: str
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float


@dataclass
class Scene:
    """A room, its tables and what stands on them; z is up, the floor is z = 0."""

    name: str
    seed: int
    room_m: tuple[float, float]
    tables: list[Table]
    placed: list[Placed] = field(default_factory=list)
    floor_colour: tuple[float, float, float] = (0.5, 0.45, 0.4)
    wall_colour: tuple[float, float, float] = (0.85, 0.84, 0.8)
    # Where the base of a robot stands first: x, y, heading.
    start: tuple[float, float, float] = (-2.0, 0.0, 0.0)
    # What a person would look for here.
    target: str | None = None
    # Shares of the target that the view shows which hides it most, and the view that hides it least.
    target_from_start: tuple[float, float] = (0.0, 1.0)
    target_from_best: tuple[float, float] = (0.0, 1.0)
    # Rooms with names, and doors between them; none in a single room.
    rooms: list[Room] = field(default_factory=list)
    doors: list[Doorway] = field(default_factory=list)

    def without(self, kinds: list[str]) -> "Scene":
        """The same with all of some kinds taken away; the others stand where they stood."""
        return replace(self, placed=[p for p in self.placed if p.thing.kind not in kinds])

    def table(self, name: str) -> Table:
        return next(t for t in self.tables if t.name == name)


class Crowded(Exception):
    """A thing found no room."""


@dataclass
class Arranger:
    """Puts things on tables so that they do not touch."""

    scene: Scene
    rng: np.random.Generator

    def put(self, thing: Thing, table: Table, area_m: tuple[float, float], around_m=(0.0, 0.0), gap=GAP_M) -> Placed:
        """Somewhere in an area of the table's top, whose middle is `around_m` in the table's frame."""
        outline = thing.outline()
        for _ in range(PLACES):
            x, y = (around_m[k] + area_m[k] * (self.rng.random() - 0.5) for k in (0, 1))
            yaw = self.rng.uniform(0.0, 2.0 * math.pi)
            if self._on_top(outline, table, x, y, yaw) and self._free(outline, table, x, y, yaw, gap):
                at = table.to_map(x, y)
                placed = Placed(thing, table.name, *at, table.height_m, yaw + table.yaw_rad)
                self.scene.placed.append(placed)
                return placed
        raise Crowded(f"{thing.name} finds no room on {table.name}")

    def _on_top(self, outline: Outline, table: Table, x: float, y: float, yaw: float) -> bool:
        reach = [0.5 * s - GAP_M - outline.radius_m for s in table.size_m]
        return all(abs(p) <= reach[0] and abs(q) <= reach[1] for p, q in outline.corners(x, y, yaw))

    def _free(self, outline: Outline, table: Table, x: float, y: float, yaw: float, gap: float) -> bool:
        at = (*table.to_map(x, y), yaw + table.yaw_rad)
        others = (p for p in self.scene.placed if p.surface == table.name)
        return all(gap_m(outline, at, p.thing.outline(), (p.x_m, p.y_m, p.yaw_rad)) >= gap for p in others)


def wood(rng: np.random.Generator) -> tuple[float, float, float]:
    """Some colour between light and dark."""
    tone = rng.uniform(0.25, 0.9)
    return tone, tone * rng.uniform(0.7, 1.0), tone * rng.uniform(0.5, 1.0)


def _room(name: str, seed: int, rng: np.random.Generator, tables: list[Table]) -> Scene:
    room = (float(rng.uniform(5.4, 6.6)), float(rng.uniform(5.0, 6.0)))
    return Scene(name, seed, room, tables, floor_colour=wood(rng), wall_colour=wood(rng))


def _table(rng: np.random.Generator, **given) -> Table:
    usual = dict(
        name="table", size_m=(float(rng.uniform(1.3, 1.7)), float(rng.uniform(0.75, 0.95))), height_m=float(rng.uniform(0.70, 0.76)),
        yaw_rad=float(rng.uniform(-0.4, 0.4)), leg_m=float(rng.uniform(0.04, 0.07)), top_m=float(rng.uniform(0.02, 0.04)), colour=wood(rng),
    )
    return Table(**{**usual, **given})


def floor(seed: int, rng: np.random.Generator) -> Scene:
    """One table in a room; cup A and others on it."""
    scene = _room("floor", seed, rng, [_table(rng)])
    make, put = Maker(rng), Arranger(scene, rng)
    things = [make.cup_a(), make.mug(), make.white_cylinder()]
    things += [make.any_of("cup_b other_cup canister bottle bowl small_box tall_box") for _ in range(int(rng.integers(2, 5)))]
    for thing in sorted(things, key=lambda t: -t.radius_m):
        put.put(thing, scene.tables[0], (1.0, 0.7), gap=0.04)
    scene.target = "cup A"
    return scene


def two_tables(seed: int, rng: np.random.Generator) -> Scene:
    """Two tables of different heights side by side; cup A on one of them."""
    first = _table(rng, position_m=(0.0, -0.75), yaw_rad=float(rng.uniform(-0.15, 0.15)))
    low = rng.random() < 0.5
    second = _table(
        rng, name="sideboard", size_m=(float(rng.uniform(0.9, 1.3)), float(rng.uniform(0.45, 0.6))),
        height_m=float(rng.uniform(0.42, 0.55) if low else rng.uniform(0.85, 0.98)),
        position_m=(float(rng.uniform(-0.3, 0.3)), 0.8), yaw_rad=float(rng.uniform(-0.2, 0.2)), leg_m=0.0 if rng.random() < 0.5 else 0.05,
    )
    scene = _room("two-tables", seed, rng, [first, second])
    make, put = Maker(rng), Arranger(scene, rng)
    here, there = (first, second) if rng.random() < 0.5 else (second, first)
    put.put(make.cup_a(), here, (0.8, 0.3), gap=0.04)
    put.put(make.mug(), there, (0.8, 0.3), gap=0.04)
    for table in (first, second):
        for _ in range(int(rng.integers(2, 4))):
            put.put(make.any_of("cup_b other_cup canister bottle small_box white_cylinder"), table, (0.9, 0.4), gap=0.04)
    scene.target = "cup A"
    return scene


def _clutter(name: str, seed: int, rng: np.random.Generator, with_cup: bool, cartons: int = 2) -> Scene:
    scene = _room(name, seed, rng, [_table(rng)])
    make, put = Maker(rng), Arranger(scene, rng)
    table = scene.tables[0]
    around = (float(rng.uniform(-0.25, 0.25)), float(rng.uniform(-0.08, 0.08)))
    if with_cup:
        put.put(make.cup_a(), table, (0.08, 0.08), around)
    for carton in [make.tall_box() for _ in range(cartons)]:
        put.put(carton, table, (0.3, 0.3) if cartons > 2 else (0.4, 0.4), around)
    things = [make.any_of("bottle white_cylinder canister"), make.any_of("mug other_cup cup_b")]
    things += [make.any_of("mug other_cup cup_b small_box canister bowl bottle") for _ in range(int(rng.integers(2, 5)))]
    for thing in sorted(things, key=lambda t: -t.radius_m):
        put.put(thing, table, (0.6, 0.5), around)
    return scene


def absent(seed: int, rng: np.random.Generator) -> Scene:
    """Narrow clutter without cup A."""
    scene = _clutter("absent", seed, rng, with_cup=False)
    scene.target = "cup A"
    return scene


def present(seed: int, rng: np.random.Generator) -> Scene:
    """Narrow clutter that nearly hides cup A: no view shows it whole, some show part of it."""
    scene = _clutter("present", seed, rng, with_cup=True, cartons=4)
    scene.target = "cup A"
    scene.target_from_start, scene.target_from_best = (0.0, 0.15), (0.2, 0.7)
    return scene


def search(seed: int, rng: np.random.Generator) -> Scene:
    """A table with cups and boxes; cup A is hardly to be seen from the start."""
    scene = _clutter("search", seed, rng, with_cup=True)
    scene.target = "cup A"
    scene.target_from_start, scene.target_from_best = (0.0, 0.25), (0.5, 1.0)
    return scene


def four_cups(seed: int, rng: np.random.Generator) -> Scene:
    """Two of each known cup, a mug, a white cylinder and boxes that hide them, and one or two things of other shapes."""
    scene = _room("four-cups", seed, rng, [_table(rng, size_m=(1.6, 0.8), yaw_rad=0.0)])
    make, put = Maker(rng), Arranger(scene, rng)
    things = [make.cup_a(), make.cup_a(), make.cup_b(), make.cup_b(), make.white_cylinder(), make.mug(), make.tall_box(), make.small_box()]
    things += [make.any_of("bottle canister bowl") for _ in range(int(rng.integers(1, 3)))]
    for thing in sorted(things, key=lambda t: -t.radius_m):
        put.put(thing, scene.tables[0], (1.5, 0.7))
    return scene


def arrange(make: Callable[[int, np.random.Generator], Scene], seed: int, suits=lambda scene: True) -> Scene:
    """The first arrangement of a seed that has room for everything and `suits`."""
    for attempt in range(ROUNDS):
        rng = np.random.default_rng([seed, attempt, 1])
        try:
            scene = make(seed, rng)
        except Crowded:
            continue
        if suits(scene):
            return scene
    raise SystemExit(f"seed {seed}: none of {ROUNDS} arrangements suits; take another seed")


def ring(scene: Scene, count: int, rng: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray]]:
    """Poses all round the tables: where the camera is, and what it looks at. Metres, in the map."""
    middle = np.mean([t.centre_m() for t in scene.tables], axis=0)
    reach = max(np.linalg.norm(np.array(c) - middle[:2]) for t in scene.tables for c in t.outline_m())
    turn = rng.uniform(0.0, 2.0 * math.pi)
    views = []
    for k in range(count):
        angle = turn + 2.0 * math.pi * (k + rng.uniform(-0.15, 0.15)) / count
        # One table is seen from near its edge; several from where all of them are in view.
        away = reach + (rng.uniform(0.45, 0.75) if len(scene.tables) == 1 else rng.uniform(0.55, 0.9))
        wide = [0.5 * side - 0.3 for side in scene.room_m]
        eye = middle[:2] + away * np.array([math.cos(angle), math.sin(angle)])
        eye = np.clip(eye, [-wide[0], -wide[1]], wide)
        height = rng.uniform(1.25, 1.5)
        target = middle + np.array([*rng.uniform(-0.12, 0.12, 2), rng.uniform(-0.1, 0.05)])
        views.append((np.array([*eye, height]), target))
    return views
