"""The things of descry's own simulator as meshes: what one body learned is looked for with another.

`robots/src/sim/household.toml` says of each thing its solids, where they are and what is printed on them.
"""

from __future__ import annotations

import functools
import math
import tomllib
from pathlib import Path

import numpy as np

from . import meshes
from .meshes import Mesh
from .things import Colour, Part

FILE = Path(__file__).resolve().parents[2] / "src/sim/household.toml"
# How finely what is printed on a solid is cut, as a share of the side of its larger patches; smaller ones have .4 of it.
FINE = 0.25
# What a print is made of, as `robots/src/sim/composed.rs` has it.
LARGER, SMALLER, SMALLER_SIDE = 0.7, 0.5, 0.4
# Latitudes of a ball, half of those of a rod's ends.
RINGS = 24


@functools.cache
def read() -> dict[str, list[dict]]:
    """The solids of each thing by its name."""
    return {name: thing["parts"] for name, thing in tomllib.loads(FILE.read_text()).items()}


def parts(name: str) -> list[Part]:
    """A thing's solids with their colours, the middle of the box around it above the origin, its lowest at z = 0."""
    made = [_piece(piece) for piece in read()[name]]
    vertices = np.concatenate([mesh[0] for mesh, _ in made])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    foot = np.array([*(0.5 * (low + high))[:2], low[2]])
    return [((vertices - foot, faces), colour) for (vertices, faces), colour in made]


def _piece(piece: dict) -> Part:
    (form, sizes), = piece["shape"].items()
    vertices, faces = FORMS[form](sizes)
    mesh = vertices @ _turn(piece.get("turn_deg", (0.0, 0.0, 0.0))).T + np.array(piece.get("at_m", (0.0, 0.0, 0.0))), faces
    colour = np.array(piece["colour"], dtype=float)
    if "pattern" not in piece:
        return mesh, tuple(colour / 255.0)
    vertices, faces = meshes.cut(mesh, FINE * piece["pattern"]["size_m"])
    return (vertices, faces), _printed(colour, piece["pattern"], vertices[faces].mean(axis=1))


def _turn(degrees) -> np.ndarray:
    """About x, then y, then z."""
    (a, b, c), (d, e, f) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x = np.array([[1, 0, 0], [0, a, -d], [0, d, a]])
    about_y = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    about_z = np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _printed(colour: np.ndarray, pattern: dict, places: np.ndarray) -> Colour:
    """The colours at places of the thing, a row each."""
    larger = _patch(places, pattern["size_m"], np.uint64(pattern["seed"]))
    smaller = _patch(places, SMALLER_SIDE * pattern["size_m"], ~np.uint64(pattern["seed"]))
    off = LARGER * larger + SMALLER * smaller[:, :1]
    return np.clip(colour + pattern["spread"] * off, 4.0, 250.0) / 255.0


def _patch(places: np.ndarray, size_m: float, seed: np.uint64) -> np.ndarray:
    """Three draws from -1 to 1 that belong to the cube around each place."""
    keys = np.full(len(places), _mixed(np.array([seed]))[0])
    for axis in range(3):
        keys = _mixed(keys ^ np.floor(places[:, axis] / size_m + 0.37).astype(np.int64).astype(np.uint64))
    draws = [_mixed(keys ^ np.uint64(k)) >> np.uint64(11) for k in (1, 2, 3)]
    return 2.0 * np.stack(draws, axis=1) / 2.0**53 - 1.0


def _mixed(z: np.ndarray) -> np.ndarray:
    """Bits that look random (SplitMix64)."""
    z = z + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _cylinder(s: dict) -> Mesh:
    base, top = 0.5 * s["diameter_m"], 0.5 * s.get("top_diameter_m", s["diameter_m"])
    return meshes.revolve([(0.0, 0.0), (base, 0.0), (top, s["height_m"]), (0.0, s["height_m"])])


def _ball(s: dict) -> Mesh:
    size = np.array(s["size_m"])
    vertices, faces = meshes.revolve([(math.sin(a), 1.0 - math.cos(a)) for a in np.linspace(0.0, math.pi, RINGS + 1)])
    return 0.5 * size * vertices, faces


def _rod(s: dict) -> Mesh:
    radius = 0.5 * s["diameter_m"]
    end = [(radius * math.cos(a), radius * math.sin(a)) for a in np.linspace(-0.5 * math.pi, 0.0, RINGS // 2 + 1)]
    low = [(r, radius + z) for r, z in end]
    return meshes.revolve(low + [(r, s["length_m"] - z) for r, z in reversed(low)])


def _bow(s: dict) -> Mesh:
    """Half a ring towards x."""
    thick, middle = 0.5 * s["thickness_m"], 0.5 * s["height_m"]
    angles = np.linspace(-0.5 * math.pi, 0.5 * math.pi, meshes.ARC_SEGMENTS + 1)
    path = np.stack([(middle - thick) * np.cos(angles), np.zeros_like(angles), middle + (middle - thick) * np.sin(angles)], axis=1)
    return meshes.tube(path, thick, thick)


FORMS = {
    "box": lambda s: meshes.box(*s["size_m"]),
    "cylinder": _cylinder,
    "ball": _ball,
    "rod": _rod,
    "bow": _bow,
    "cup": lambda s: meshes.vessel(s["diameter_m"], s["height_m"], s["base_diameter_m"], s["wall_m"]),
}
