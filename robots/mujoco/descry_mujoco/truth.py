"""How everything really stands, as `robots/PROTOCOL.md` says it under "Truth": for reports; no answer of the body holds it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import mujoco
import numpy as np

from .scenes import Placed, Scene
from .stage import Stage

# What stands this near to the height of a surface stands on it, metres.
ON_M = 0.03


def tell(file: Path, stage: Stage, now_ns: int, base: tuple[float, float, float], held: str | None) -> None:
    """Writes the file anew, whole at any time."""
    scene = stage.scene
    truth = {
        "stamp_ns": now_ns,
        "base": dict(zip(("x_m", "y_m", "yaw_rad"), base)),
        "objects": [_thing(stage, p, held) for p in scene.placed],
        "doors": [{"name": d.name, "shut": is_shut(stage, d.name)} for d in scene.doors],
        "target": scene.target,
        "target_visible_from_start": None,
        "events": [],
    }
    beside = file.with_name(f"{file.name}.new")
    beside.write_text(json.dumps(truth) + "\n")
    os.replace(beside, file)


def _thing(stage: Stage, placed: Placed, held: str | None) -> dict:
    thing, pose = placed.thing, stage.pose_of(placed.thing.name)
    x, y, z = pose[:3, 3]
    in_hand = thing.name == held
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, pose[:3, :3].ravel())
    side = 2.0 * thing.radius_m
    return {
        "name": thing.name, "kind": thing.kind, "in_hand": in_hand, "present": True,
        "surface": None if in_hand else _surface(stage.scene, x, y, z),
        "room": next((r.name for r in stage.scene.rooms if r.holds(x, y)), None),
        "map_from_object": {"translation": [x, y, z], "rotation": [*quaternion[1:], quaternion[0]]},
        "centre_m": (pose @ [0.0, 0.0, 0.5 * thing.height_m, 1.0])[:3].tolist(),
        "size_m": [thing.size.get("x", side), thing.size.get("y", side), thing.height_m],
    }


def _surface(scene: Scene, x: float, y: float, z: float) -> str | None:
    """What a foot stands on; none on the floor."""
    return next((t.name for t in scene.tables if abs(z - t.height_m) <= ON_M and t.has_below(x, y)), None)


def is_shut(stage: Stage, door: str) -> bool:
    """A door that leaves no room for the base."""
    width_m = next(d.width_m for d in stage.scene.doors if d.name == door)
    return float(stage.data.joint(door).qpos[0]) < 0.5 * width_m
