"""Where the base believes to be: off by an error that drifts to another one with every drive, and stays while it stands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

Pose = tuple[float, float, float]


def compose(a: Pose, b: Pose) -> Pose:
    """`a_from_c` of `a_from_b` and `b_from_c`; poses are (x, y, yaw)."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]


def inverse(a: Pose) -> Pose:
    c, s = math.cos(a[2]), math.sin(a[2])
    return -c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2]


def apply(a: Pose, point: np.ndarray) -> np.ndarray:
    """The point of b in a; its height stays."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return np.array([a[0] + c * point[0] - s * point[1], a[1] + s * point[0] + c * point[1], point[2]])


def turn(a: float, b: float) -> float:
    """From one heading to another, -pi to pi."""
    return (b - a + math.pi) % (2.0 * math.pi) - math.pi


@dataclass
class Localisation:
    """`truth_from_base = compose(believed, error)`: the error is in the base's own frame."""

    sigma_m: float
    sigma_rad: float
    rng: np.random.Generator

    def __post_init__(self) -> None:
        self._old = self._new = self.draw()
        self.share = 0.0

    def draw(self) -> Pose:
        x, y, yaw = self.rng.standard_normal(3)
        return self.sigma_m * x, self.sigma_m * y, self.sigma_rad * yaw

    def depart(self) -> None:
        """The error that a drive ends with is another than the one it begins with."""
        self._old, self._new, self.share = self.error(), self.draw(), 0.0

    def error(self) -> Pose:
        return tuple(a + self.share * (b - a) for a, b in zip(self._old, self._new))

    def believed(self, truth: Pose) -> Pose:
        return compose(truth, inverse(self.error()))

    def truth_from_map(self, truth: Pose) -> Pose:
        """Takes what the body believes about the map to where it really is."""
        return compose(truth, inverse(self.believed(truth)))
