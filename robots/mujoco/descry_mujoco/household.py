"""Things of a household that come, go and are moved between visits: bodies of several parts and colours, on two tables."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Callable

import numpy as np

from . import composed, meshes
from .meshes import Mesh
from .scenes import Arranger, Scene, Table, wood
from .things import Part, Thing

# Between two things, metres: what stands apart is noticed apart.
APART_M = 0.08
VISITS = 4


def at(mesh: Mesh, x: float, y: float, z: float) -> Mesh:
    """The mesh moved by so much, metres."""
    vertices, faces = mesh
    return vertices + np.array([x, y, z]), faces


def lying(mesh: Mesh) -> Mesh:
    """The mesh with its axis along y instead of z."""
    vertices, faces = mesh
    return vertices[:, [0, 2, 1]] * np.array([1.0, -1.0, 1.0]), faces


def disc(radius: float, height: float) -> Mesh:
    return meshes.solid([(radius, 0.0), (radius, height)], 0.002)


def _cereal() -> list[Part]:
    front = at(meshes.box(0.13, 0.004, 0.16), 0.01, -0.033, 0.08)
    return [(meshes.box(0.19, 0.065, 0.28), (0.85, 0.7, 0.2)), (front, (0.7, 0.1, 0.15)), (at(meshes.box(0.06, 0.004, 0.03), -0.05, -0.033, 0.02), (0.1, 0.2, 0.6))]


def _milk() -> list[Part]:
    gable = at(meshes.box(0.095, 0.02, 0.045), 0, 0, 0.19)
    cap = at(disc(0.014, 0.02), 0.0, -0.03, 0.19)
    return [(meshes.box(0.095, 0.095, 0.19), (0.92, 0.93, 0.95)), (gable, (0.92, 0.93, 0.95)), (cap, (0.2, 0.3, 0.8)), (at(meshes.box(0.003, 0.06, 0.08), 0.048, 0, 0.05), (0.2, 0.5, 0.85))]


def _kettle() -> list[Part]:
    body = meshes.solid([(0.085, 0.0), (0.09, 0.06), (0.06, 0.17), (0.045, 0.185)], 0.006)
    grip = meshes.handle(0.07, 0.05, 0.17, 0.055, 0.018, 0.5)
    spout = at(meshes.box(0.05, 0.03, 0.035), -0.075, 0, 0.135)
    return [(body, (0.75, 0.76, 0.78)), (grip, (0.12, 0.12, 0.13)), (spout, (0.75, 0.76, 0.78)), (at(disc(0.02, 0.025), 0, 0, 0.183), (0.12, 0.12, 0.13))]


def _truck() -> list[Part]:
    wheels = [at(lying(disc(0.03, 0.02)), x, y, 0.03) for x in (-0.075, 0.07) for y in (-0.03, 0.055)]
    body = at(meshes.box(0.15, 0.085, 0.07), -0.035, 0, 0.035)
    cabin = at(meshes.box(0.07, 0.085, 0.1), 0.08, 0, 0.035)
    return [(body, (0.9, 0.75, 0.1)), (cabin, (0.8, 0.12, 0.1)), *[(wheel, (0.1, 0.1, 0.1)) for wheel in wheels]]


def _drill() -> list[Part]:
    battery = meshes.box(0.11, 0.075, 0.05)
    grip = at(meshes.box(0.045, 0.04, 0.1), 0.015, 0, 0.05)
    motor = at(meshes.box(0.18, 0.06, 0.065), -0.01, 0, 0.15)
    chuck = at(meshes.box(0.05, 0.035, 0.035), -0.12, 0, 0.165)
    return [(battery, (0.1, 0.1, 0.1)), (grip, (0.1, 0.35, 0.35)), (motor, (0.1, 0.45, 0.4)), (chuck, (0.3, 0.3, 0.3))]


def _lamp() -> list[Part]:
    shade = at(meshes.solid([(0.095, 0.0), (0.055, 0.11)], 0.002), 0, 0, 0.18)
    switch = at(meshes.box(0.03, 0.02, 0.02), 0.05, 0, 0.025)
    return [(disc(0.07, 0.025), (0.35, 0.25, 0.15)), (at(disc(0.018, 0.16), 0, 0, 0.02), (0.35, 0.25, 0.15)), (shade, (0.9, 0.85, 0.7)), (switch, (0.9, 0.9, 0.9))]


def _can() -> list[Part]:
    """For watering."""
    body = meshes.solid([(0.075, 0.0), (0.075, 0.13), (0.045, 0.15)], 0.004)
    grip = meshes.handle(0.07, 0.03, 0.13, 0.06, 0.014, 0.6)
    spout = [at(meshes.box(0.05, 0.022, 0.05), -0.085 - 0.033 * k, 0, 0.02 + 0.038 * k) for k in range(4)]
    return [(body, (0.15, 0.5, 0.25)), (grip, (0.15, 0.5, 0.25)), *[(part, (0.1, 0.4, 0.2)) for part in spout]]


def _iron() -> list[Part]:
    sole = [at(meshes.box(0.06, 0.11 - 0.022 * k, 0.035), 0.08 - 0.055 * k, 0, 0.0) for k in range(4)]
    back = at(meshes.box(0.12, 0.07, 0.05), 0.03, 0, 0.03)
    grip = at(meshes.box(0.16, 0.03, 0.03), 0.02, 0, 0.105)
    posts = [at(meshes.box(0.025, 0.03, 0.035), x, 0, 0.075) for x in (-0.03, 0.075)]
    return [*[(part, (0.7, 0.72, 0.75)) for part in sole], (back, (0.2, 0.3, 0.65)), (grip, (0.15, 0.15, 0.2)), *[(post, (0.2, 0.3, 0.65)) for post in posts]]


def _toaster() -> list[Part]:
    slots = [at(meshes.box(0.19, 0.025, 0.004), 0, y, 0.178) for y in (-0.035, 0.035)]
    lever = at(meshes.box(0.02, 0.03, 0.015), 0.14, 0, 0.11)
    return [(meshes.box(0.26, 0.15, 0.18), (0.8, 0.8, 0.82)), *[(slot, (0.08, 0.08, 0.08)) for slot in slots], (lever, (0.1, 0.1, 0.1))]


def _radio() -> list[Part]:
    knobs = [at(lying(disc(0.016, 0.012)), x, -0.035, 0.03) for x in (-0.08, 0.08)]
    front = at(meshes.box(0.15, 0.004, 0.08), 0, -0.036, 0.045)
    return [(meshes.box(0.23, 0.07, 0.14), (0.45, 0.25, 0.12)), (front, (0.85, 0.8, 0.65)), *[(knob, (0.1, 0.1, 0.1)) for knob in knobs]]


@dataclass(frozen=True)
class Household:
    """What comes, goes and is moved, in the order of seeds; and what always stands there, on either table."""

    scene: str
    parts: Callable[[str], list[Part]]
    names: list[str]
    always: tuple[str, str]
    # What comes at the third visit is so many further on than what comes at the second.
    further: int

    def thing(self, name: str, called: str | None = None) -> Thing:
        parts = self.parts(name)
        vertices = np.concatenate([mesh[0] for mesh, _ in parts])
        reach = 2.0 * np.abs(vertices[:, :2]).max(axis=0)
        size = {"x": float(reach[0]), "y": float(reach[1]), "z": float(vertices[:, 2].max())}
        solids, colours = zip(*parts)
        return Thing(called or name, name, "parts", size, mass_kg=0.5, parts=solids, colours=colours)

    def coming(self, seed: int) -> tuple[str, str]:
        """What comes at the second visit, and what at the third."""
        coming = [name for name in self.names if name not in self.always]
        return coming[seed % len(coming)], coming[(seed + self.further) % len(coming)]

    def __call__(self, seed: int, rng: np.random.Generator) -> Scene:
        """Two tables as `of_visit` knows them: everything of all visits, each where it will stand."""
        def table(name: str, x: float, y: float, height: float) -> Table:
            return Table(name, (1.2, 0.8), height + float(rng.uniform(-0.02, 0.02)), (x, y), 0.5 * math.pi, leg_m=0.05, colour=wood(rng))

        tables = [table("table", -1.7, 0.3, 0.72), table("desk", 1.7, -0.3, 0.76)]
        scene = Scene(self.scene, seed, (7.0, 6.0), tables, floor_colour=wood(rng), wall_colour=wood(rng))
        put = Arranger(scene, rng)
        for name, on in zip(self.always, tables):
            put.put(self.thing(name), on, (1.0, 0.6), gap=APART_M)
        first, second = self.coming(seed)
        here = int(rng.integers(2))
        # The first comes, and is moved to the other table when the second comes, which stays.
        for name, on in ((f"{first}@2", here), (f"{first}@3", 1 - here), (f"{second}@3,4", int(rng.integers(2)))):
            put.put(self.thing(name.split("@")[0], name), tables[on], (1.0, 0.6), gap=APART_M)
        return scene


FORMS = {
    "cereal": _cereal, "milk": _milk, "kettle": _kettle, "truck": _truck, "drill": _drill, "lamp": _lamp, "watering can": _can, "iron": _iron,
    "toaster": _toaster, "radio": _radio,
}
OWN = Household("household", lambda name: FORMS[name](), list(FORMS), ("toaster", "radio"), 3)
# The things of descry's own simulator, as its learning domain has them.
SHARED = Household("shared-household", composed.parts, list(composed.read()), ("tissues", "radio"), 5)


def of_visit(scene: Scene, visit: int) -> Scene:
    """What stands there at a visit, 1 to `VISITS`."""
    def stands(name: str) -> bool:
        return "@" not in name or str(visit) in name.split("@")[1].split(",")

    there = [p for p in scene.placed if stands(p.thing.name)]
    named = [replace(p, thing=replace(p.thing, name=p.thing.name.split("@")[0])) for p in there]
    return replace(scene, placed=named)
