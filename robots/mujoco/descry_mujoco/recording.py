"""A folder of frames as `descry --robot recorded:DIR` reads it, and beside the frames the truth, which descry never reads."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from .noise import DepthNoise
from .scenes import Scene
from .stage import Stage, arrange, ring_poses, small_stage, worst_first

DEPTH_SCALE = 1000.0
# A wheeled body errs on the floor; its neck is better known than its place, by these factors.
HEIGHT_SHARE, TILT_SHARE = 0.2, 0.25


@dataclass(frozen=True)
class Order:
    """What to record."""

    scene: str
    seed: int
    views: int
    holes: float = 0.002
    noise_scale: float = 1.0
    pose_sigma_m: float = 0.0
    pose_sigma_deg: float = 0.0


def record(order: Order, folder: Path) -> None:
    """Arranges the scene, looks at it from all round, writes everything."""
    scene = arrange(order.scene, order.seed, order.views)
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([order.seed, 3])
    how = DepthNoise(scale=order.noise_scale, holes=order.holes)
    truth = {"order": asdict(order), "target": scene.target, "views": []}
    with small_stage(scene) as counting:
        views = worst_first(counting, ring_poses(scene, order.views, order.seed))
        shares = [counting.visible_shares([p.thing.name for p in scene.placed], view) for view in views]
    with Stage(scene) as stage:
        for k, map_from_camera in enumerate(views):
            frame = stage.look(map_from_camera)
            depth_m = stage.measure(frame, how, (order.seed, 4, k))
            believed = stray(map_from_camera, order.pose_sigma_m, order.pose_sigma_deg, rng)
            stem = folder / f"frame-{k:06d}"
            Image.fromarray(millimetres(depth_m)).save(f"{stem}.depth.png", compress_level=3)
            Image.fromarray(frame.colour).save(f"{stem}.color.png", compress_level=3)
            np.savetxt(f"{stem}.pose.txt", believed, fmt="%.9f")
            truth["views"].append({"frame": stem.name, "map_from_camera": map_from_camera.tolist(), "visible_share": shares[k]})
        truth |= {"tables": [asdict(t) for t in scene.tables], "objects": objects(stage)}
        write_settings(folder, order, stage)
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


def millimetres(depth_m: np.ndarray) -> np.ndarray:
    """16 bits, 0 where nothing returned."""
    return np.nan_to_num(np.rint(depth_m * DEPTH_SCALE), nan=0.0).astype(np.uint16)


def stray(map_from_camera: np.ndarray, sigma_m: float, sigma_deg: float, rng: np.random.Generator) -> np.ndarray:
    """Where localisation says that the camera is: off on the floor and in heading by the stated amounts, a little in height and tilt."""
    moved = sigma_m * rng.standard_normal(3) * (1.0, 1.0, HEIGHT_SHARE)
    turned = math.radians(sigma_deg) * rng.standard_normal(3) * (TILT_SHARE, TILT_SHARE, 1.0)
    angle = float(np.linalg.norm(turned))
    x, y, z = turned
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) if angle == 0.0 else (
        np.eye(3) + math.sin(angle) / angle * cross + (1.0 - math.cos(angle)) / angle**2 * cross @ cross
    )
    out = map_from_camera.copy()
    out[:3, :3] = rotation @ out[:3, :3]
    out[:3, 3] += moved
    return out


def objects(stage: Stage) -> list[dict]:
    """Everything that stands there, as it is."""
    scene: Scene = stage.scene
    return [
        {
            "name": p.thing.name, "kind": p.thing.kind, "shape": p.thing.shape, "size_m": p.thing.size,
            "height_m": p.thing.height_m, "surface": p.surface, "shine": p.thing.shine,
            "map_from_object": stage.pose_of(p.thing.name).tolist(),
            "centre_m": (stage.pose_of(p.thing.name) @ [0.0, 0.0, 0.5 * p.thing.height_m, 1.0])[:3].tolist(),
        }
        for p in scene.placed
    ]


def write_settings(folder: Path, order: Order, stage: Stage) -> None:
    focal, (cx, cy) = stage.camera.focal_px, stage.camera.centre_px
    np.savetxt(folder / "camera-intrinsics.txt", [[focal, 0, cx], [0, focal, cy], [0, 0, 1]], fmt="%.9f")
    # Exact poses are stated as good as depth in millimetres lets them be.
    sigma_m, sigma_deg = max(order.pose_sigma_m, 0.002), max(order.pose_sigma_deg, 0.1)
    near, far = DepthNoise().range_m
    (folder / "recording.toml").write_text(
        f'name = "{order.scene} {order.seed}"\nup = [0.0, 0.0, 1.0]\nregistered = true\n'
        f"pose_sigma_m = {sigma_m}\npose_sigma_deg = {sigma_deg}\nrange_m = [{near}, {far}]\n"
    )
