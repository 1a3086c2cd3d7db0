"""How good a learned model is against the mesh that it was learned from: for reports, as Fäulhammer et al. measure it (section VII)."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from . import world
from .camera import FOCAL_PX, HEIGHT, WIDTH
from .scenes import Placed, Scene
from .things import Thing

# A true point is explained by a learned one within this, and a learned one by a true one, metres.
EXPLAINED_M = 0.02
# Points of the mesh, some 2 mm apart; of them as many are asked for recall, and of the model for precision and distance.
SAMPLES, ASKED = 30_000, 4_000
# The outer surface is what is seen from some of these: turns around the thing, heights above its foot (degrees), and how far off, metres.
TURNS, HEIGHTS_DEG, AWAY_M = 16, (2.0, 20.0, 40.0, 60.0, 85.0), 1.5
# A straight line from an eye that ends this near to a point has reached it; nothing is learned from a look farther away, metres.
REACHED_M, LOOKED_M = 0.003, 2.5
# Alignment: points used of the model and of the mesh, what is matched at most, beyond what a match counts for less, metres, and how often.
ALIGNED, ONTO, WITHIN_M, ROBUST_M, ROUNDS = 1_000, 10_000, 0.03, 0.005, 30
PLY_TYPES = {"float": "<f4", "uchar": "u1", "uint": "<u4"}

Looks = list[tuple[np.ndarray, np.ndarray, np.ndarray]]


def read_ply(file: Path) -> np.ndarray:
    """The points of a binary PLY file that descry wrote."""
    head, _, body = file.read_bytes().partition(b"end_header\n")
    words = [line.split() for line in head.decode().splitlines()]
    row = np.dtype([(w[2], PLY_TYPES[w[1]]) for w in words if w[0] == "property"])
    points = np.frombuffer(body, row)
    return np.stack([points[axis].astype(float) for axis in "xyz"], axis=1)


def judged(scene: Scene, name: str, learned: np.ndarray, looks: Looks) -> dict:
    """Points of a model (map, metres, as the robot believes) held against the thing of that name. Of a look: where the camera stood, and the
    lower and upper corner of what it showed."""
    placed = next(p for p in scene.placed if p.thing.name == name)
    rng = np.random.default_rng(1)
    surface, normals = in_map(placed, *sampled(placed.thing, SAMPLES, rng))
    outer = seen(replace(scene, placed=[placed], tables=[]), surface, [(eye, -np.inf, np.inf) for eye in _around(placed)])
    surface, normals = surface[outer], normals[outer]
    learned = aligned(learned, surface, normals, rng)
    off_m = _nearest(_some(learned, ASKED, rng), surface)[1]
    asked = _some(surface, ASKED, rng)
    explained = _nearest(asked, learned)[1] < EXPLAINED_M
    shown = seen(scene, asked, looks)
    shares = {
        "recall": explained, "shown": shown, "recall_of_shown": explained[shown], "precision": off_m < EXPLAINED_M, "distance_m": off_m,
    }
    return {"points": len(learned), **{name: round(float(values.mean()), 4) for name, values in shares.items()}}


def sampled(thing: Thing, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points of all parts of a thing, as many on each area of the same size, and which way the surface looks there."""
    corners = np.concatenate([vertices[faces] for vertices, faces in thing.meshes()])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    of = rng.choice(len(areas), count, p=areas / areas.sum())
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))
    a, b, c = corners[of].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), normals[of] / areas[of, None]


def in_map(placed: Placed, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    c, s = math.cos(placed.yaw_rad), math.sin(placed.yaw_rad)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return points @ turn.T + [placed.x_m, placed.y_m, placed.z_m], normals @ turn.T


def _around(placed: Placed) -> list[np.ndarray]:
    foot, turns = np.array([placed.x_m, placed.y_m, placed.z_m]), np.linspace(0.0, 2.0 * math.pi, TURNS, endpoint=False)
    return [
        foot + AWAY_M * np.array([math.cos(h) * math.cos(t), math.cos(h) * math.sin(t), math.sin(h)])
        for h in np.radians(HEIGHTS_DEG) for t in turns
    ]


def seen(scene: Scene, points: np.ndarray, looks: Looks) -> np.ndarray:
    """Which points a straight line from some look reaches."""
    model = world.specification(scene, WIDTH, HEIGHT, FOCAL_PX).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    groups = (np.arange(6) == world.SEEN).astype(np.uint8)
    geom = np.zeros(1, np.int32)
    reached = np.zeros(len(points), bool)
    for eye, low, high in looks:
        for k in np.flatnonzero(~reached & np.all((points >= low) & (points <= high), axis=1)):
            way = points[k] - eye
            far = np.linalg.norm(way)
            reached[k] = far < LOOKED_M and mujoco.mj_ray(model, data, eye, way / far, groups, True, -1, geom) > far - REACHED_M
    return reached


def aligned(points: np.ndarray, surface: np.ndarray, normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The points moved rigidly onto the surface: from point to plane, robustly."""
    some, onto = _some(points, ALIGNED, rng), _some(np.arange(len(surface)), ONTO, rng)
    surface, normals = surface[onto], normals[onto]
    middle = surface.mean(axis=0)
    size_m = np.linalg.norm(surface - middle, axis=1).mean()
    for _ in range(ROUNDS):
        index, off_m = _nearest(some, surface)
        normal = normals[index]
        gap_m = np.einsum("ij,ij->i", surface[index] - some, normal)
        weight = np.where(off_m < WITHIN_M, 1.0 / (1.0 + (gap_m / ROBUST_M) ** 2), 0.0)
        rows = np.concatenate([np.cross((some - middle) / size_m, normal), normal], axis=1)
        # What no point says, as how far something round is turned, stays.
        step = np.linalg.solve((weight * rows.T) @ rows + 1e-3 * weight.sum() * np.eye(6), (weight * rows.T) @ gap_m)
        turn = np.zeros(9)
        angle = np.linalg.norm(step[:3]) / size_m
        quaternion = np.zeros(4)
        mujoco.mju_axisAngle2Quat(quaternion, step[:3] / max(np.linalg.norm(step[:3]), 1e-12), angle)
        mujoco.mju_quat2Mat(turn, quaternion)
        some, points = ((p - middle) @ turn.reshape(3, 3).T + middle + step[3:] for p in (some, points))
    return points


def _some(points: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    return points if len(points) <= count else points[rng.choice(len(points), count, replace=False)]


def _nearest(points: np.ndarray, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each point which of the others is nearest, and how far off it is, metres."""
    middle = of.mean(axis=0)
    others = of - middle
    squares = np.einsum("ij,ij->i", others, others)
    parts = np.array_split(points - middle, max(1, len(points) // 250))
    index = np.concatenate([(squares - 2.0 * part @ others.T).argmin(axis=1) for part in parts])
    return index, np.linalg.norm(points - of[index], axis=1)
