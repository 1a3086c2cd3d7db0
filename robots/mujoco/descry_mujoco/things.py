"""The things that stand about: what each is, its mesh, and its outline on a table."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from . import meshes

HANDLED = "mug"
# One for all of a part, or a row for each of its faces.
Colour = tuple[float, float, float] | np.ndarray
Part = tuple[meshes.Mesh, Colour]


@dataclass(frozen=True)
class Thing:
    """One object. Lengths in metres; `shape` names a form of `FORMS`, `size` its measures."""

    name: str
    kind: str
    shape: str
    size: dict[str, float]
    colour: Colour = (0.7, 0.7, 0.7)
    # 0 is matt; 1 loses most of its steep sides to the depth camera.
    shine: float = 0.0
    mass_kg: float = 0.15
    # Of a thing that is no form of `FORMS`: its closed parts, each with its colour.
    parts: tuple[meshes.Mesh, ...] = ()
    colours: tuple[Colour, ...] = ()

    @property
    def is_box(self) -> bool:
        """What collides is a box around it, and so is what it needs on a table."""
        return self.shape == "box" or bool(self.parts)

    @property
    def height_m(self) -> float:
        return self.size["z"] if self.is_box else self.size["height"]

    @property
    def radius_m(self) -> float:
        """Of the body without its handle, where it is widest; of a box, to its corners."""
        if self.is_box:
            return 0.5 * math.hypot(self.size["x"], self.size["y"])
        return 0.5 * max(v for k, v in self.size.items() if k in ("diameter", "base", "lid_diameter"))

    def meshes(self) -> list[meshes.Mesh]:
        """Closed surfaces that overlap at most where a handle stands in a wall."""
        return list(self.parts) or FORMS[self.shape](self.size)

    def colour_of(self, part: int) -> Colour:
        return self.colours[part] if self.colours else self.colour

    def outline(self) -> "Outline":
        """What it needs on a table."""
        if self.is_box:
            return Outline(half_m=(0.5 * self.size["x"], 0.5 * self.size["y"]))
        return Outline(radius_m=self.radius_m + (self.size["reach"] if self.shape == HANDLED else 0.0))


@dataclass(frozen=True)
class Outline:
    """A disc, or a rectangle along the thing's axes."""

    radius_m: float = 0.0
    half_m: tuple[float, float] | None = None

    def corners(self, x: float, y: float, yaw: float) -> list[tuple[float, float]]:
        """Where its corners are; the middle of a disc."""
        if self.half_m is None:
            return [(x, y)]
        c, s = math.cos(yaw), math.sin(yaw)
        a, b = self.half_m
        return [(x + c * i * a - s * j * b, y + s * i * a + c * j * b) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


def gap_m(a: Outline, at_a: tuple[float, float, float], b: Outline, at_b: tuple[float, float, float]) -> float:
    """Room between two outlines at (x, y, yaw), by separating axes: never more than there is."""
    pa, pb = np.array(a.corners(*at_a)), np.array(b.corners(*at_b))
    axes = [np.array([math.cos(yaw + t), math.sin(yaw + t)]) for yaw in (at_a[2], at_b[2]) for t in (0.0, 0.5 * math.pi)]
    between = np.array(at_b[:2]) - np.array(at_a[:2])
    distance = np.linalg.norm(between)
    if distance > 0.0:
        axes.append(between / distance)
    best = -math.inf
    for axis in axes:
        low_a, high_a = (pa @ axis).min() - a.radius_m, (pa @ axis).max() + a.radius_m
        low_b, high_b = (pb @ axis).min() - b.radius_m, (pb @ axis).max() + b.radius_m
        best = max(best, low_b - high_a, low_a - high_b)
    return best


def _vessel(s: dict[str, float]) -> list[meshes.Mesh]:
    return [meshes.vessel(s["diameter"], s["height"], s["base"], s["wall"])]


def _mug(s: dict[str, float]) -> list[meshes.Mesh]:
    radius = 0.25 * (s["diameter"] + s["base"])
    grip = meshes.handle(radius, s["low"] * s["height"], s["high"] * s["height"], s["reach"], s["thickness"], s["squareness"])
    return _vessel(s) + [grip]


FORMS = {
    "cup": _vessel,
    HANDLED: _mug,
    "bowl": lambda s: [meshes.bowl(s["diameter"], s["height"], s["base"], s["wall"])],
    "canister": lambda s: [meshes.canister(s["diameter"], s["height"], s["lid_diameter"], s["lid_height"])],
    "bottle": lambda s: [meshes.bottle(s["diameter"], s["height"], s["neck"], s["shoulder"])],
    "cylinder": lambda s: [meshes.solid([(0.5 * s["diameter"], 0.0), (0.5 * s["diameter"], s["height"])], 0.002)],
    "box": lambda s: [meshes.box(s["x"], s["y"], s["z"])],
}


@dataclass
class Maker:
    """Draws things. The known ones have the sizes that descry's tabletop domain states; the others are kept apart from those."""

    rng: np.random.Generator
    made: dict[str, int] = field(default_factory=dict)

    def _number(self, name: str) -> str:
        self.made[name] = self.made.get(name, 0) + 1
        return name if self.made[name] == 1 else f"{name} {self.made[name]}"

    def _between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def _colour(self) -> tuple[float, float, float]:
        return tuple(float(c) for c in self.rng.uniform(0.15, 0.95, 3))

    def _shine(self, share: float) -> float:
        return self._between(0.3, 1.0) if self.rng.random() < share else 0.0

    def cup_a(self) -> Thing:
        size = {"diameter": 0.070, "base": 0.067, "height": 0.104, "wall": 0.003}
        return Thing(self._number("cup A"), "cup A", "cup", size, (0.16, 0.55, 0.24), mass_kg=0.12)

    def cup_b(self) -> Thing:
        size = {"diameter": 0.088, "base": 0.083, "height": 0.155, "wall": 0.003}
        return Thing(self._number("cup B"), "cup B", "cup", size, (0.67, 0.16, 0.16), mass_kg=0.2)

    def white_cylinder(self) -> Thing:
        size = {"diameter": 0.106, "height": 0.277}
        return Thing(self._number("white cylinder"), "white cylinder", "cylinder", size, (0.88, 0.88, 0.86), mass_kg=0.6)

    def mug(self) -> Thing:
        diameter = self._between(0.074, 0.094)
        size = {
            "diameter": diameter, "base": diameter * self._between(0.88, 1.0), "height": self._between(0.084, 0.112),
            "wall": 0.004, "low": self._between(0.15, 0.25), "high": self._between(0.75, 0.9),
            "reach": self._between(0.027, 0.038), "thickness": self._between(0.008, 0.012), "squareness": self._between(0.0, 1.0),
        }
        return Thing(self._number("mug"), "mug", HANDLED, size, self._colour(), self._shine(0.3), 0.3)

    def other_cup(self) -> Thing:
        """Without a handle, and apart from cup A and cup B by more than a centimetre in height or width."""
        while True:
            diameter, height = self._between(0.063, 0.097), self._between(0.075, 0.137)
            apart = [max(abs(diameter - d), abs(height - h)) > 0.012 for d, h in ((0.070, 0.104), (0.088, 0.155))]
            if all(apart):
                break
        size = {"diameter": diameter, "base": diameter * self._between(0.8, 1.0), "height": height, "wall": 0.003}
        return Thing(self._number("other cup"), "other cup", "cup", size, self._colour(), self._shine(0.3), 0.15)

    def canister(self) -> Thing:
        diameter, height = self._between(0.075, 0.11), self._between(0.11, 0.19)
        size = {"diameter": diameter, "height": height, "lid_diameter": diameter * self._between(0.96, 1.06), "lid_height": self._between(0.012, 0.03)}
        return Thing(self._number("canister"), "canister", "canister", size, self._colour(), self._shine(0.5), 0.4)

    def bottle(self) -> Thing:
        size = {"diameter": self._between(0.06, 0.085), "height": self._between(0.2, 0.3), "neck": self._between(0.024, 0.034), "shoulder": self._between(0.5, 0.65)}
        return Thing(self._number("bottle"), "bottle", "bottle", size, self._colour(), self._shine(0.6), 0.5)

    def bowl(self) -> Thing:
        diameter = self._between(0.13, 0.19)
        size = {"diameter": diameter, "height": self._between(0.05, 0.08), "base": 0.45 * diameter, "wall": 0.004}
        return Thing(self._number("bowl"), "bowl", "bowl", size, self._colour(), self._shine(0.3), 0.3)

    def small_box(self) -> Thing:
        size = {"x": self._between(0.05, 0.09), "y": self._between(0.06, 0.12), "z": self._between(0.06, 0.16)}
        return Thing(self._number("packet"), "box", "box", size, self._colour(), self._shine(0.1), 0.25)

    def tall_box(self) -> Thing:
        size = {"x": self._between(0.06, 0.1), "y": self._between(0.15, 0.24), "z": self._between(0.2, 0.3)}
        return Thing(self._number("carton"), "box", "box", size, self._colour(), 0.0, 0.5)

    def any_of(self, names: str) -> Thing:
        """One of several, by their methods' names."""
        names = names.split()
        return getattr(self, names[int(self.rng.integers(len(names)))])()
