"""A scene that can be photographed: the model, its state, a camera."""

from __future__ import annotations

import mujoco
import numpy as np

from . import noise, scenes, world
from .camera import FOCAL_PX, HEIGHT, WIDTH, Camera, Frame, aim_eye
from .scenes import Scene

# Visibility is measured on small images.
SHARE_SCALE = 4
RING_VIEWS = 12


class Stage:
    """The scene as a model with its camera; what stands in it may have moved since it was arranged."""

    def __init__(self, scene: Scene, width: int = WIDTH, height: int = HEIGHT, focal_px: float = FOCAL_PX):
        self.scene = scene
        self.model = world.specification(scene, width, height, focal_px).compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.camera = Camera(self.model, width, height, focal_px)
        self._shine = np.zeros(self.model.nbody)
        for placed in scene.placed:
            self._shine[self.model.body(placed.thing.name).id] = placed.thing.shine

    def __enter__(self) -> "Stage":
        return self

    def __exit__(self, *_) -> None:
        self.camera.close()

    def look(self, map_from_camera: np.ndarray) -> Frame:
        """The ideal frame from a pose (optical frame)."""
        self._aim(map_from_camera)
        return self.camera.frame(self.data)

    def _aim(self, map_from_camera: np.ndarray) -> None:
        aim_eye(self.data, map_from_camera)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def measure(self, frame: Frame, how: noise.DepthNoise, seed: tuple[int, ...]) -> np.ndarray:
        """What the depth camera makes of a frame."""
        return noise.observe(frame.depth_m, self._shine[frame.body], self.camera.focal_px, how, seed)

    def pose_of(self, name: str) -> np.ndarray:
        """`map_from_object` (4x4): the middle of the foot, z up."""
        body = self.data.body(name)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = body.xmat.reshape(3, 3), body.xpos
        return pose

    def visible_share(self, name: str, map_from_camera: np.ndarray) -> float:
        """Share of a thing's pixels that nothing hides; 0 if it is not in the image."""
        self._aim(map_from_camera)
        number = self.model.body(name).id
        seen = int((self.camera.bodies(self.data) == number).sum())
        colours = self.model.geom_rgba.copy()
        self.model.geom_rgba[self.model.geom_bodyid != number, 3] = 0.0
        alone = int((self.camera.bodies(self.data) == number).sum())
        self.model.geom_rgba[:] = colours
        return seen / alone if alone else 0.0


def hides_its_target(scene: Scene, views: list[np.ndarray]) -> bool:
    """Whether some view hides the target as far as asked for, and the best one shows as much of it as asked for."""
    if not any(p.thing.name == scene.target for p in scene.placed):
        return True
    small = (WIDTH // SHARE_SCALE, HEIGHT // SHARE_SCALE, FOCAL_PX / SHARE_SCALE)
    with Stage(scene, *small) as stage:
        shares = [stage.visible_share(scene.target, view) for view in views]
    (low, high), (least, most) = scene.target_from_start, scene.target_from_best
    return low <= min(shares) <= high and least <= max(shares) <= most


def worst_first(stage: Stage, views: list[np.ndarray]) -> list[np.ndarray]:
    """The views in their order round the tables, from the one on that shows least of the target."""
    if not any(p.thing.name == stage.scene.target for p in stage.scene.placed):
        return views
    shares = [stage.visible_share(stage.scene.target, view) for view in views]
    first = int(np.argmin(shares))
    return views[first:] + views[:first]


def ring_poses(scene: Scene, count: int, seed: int) -> list[np.ndarray]:
    """`map_from_camera` of views all round."""
    rng = np.random.default_rng([seed, 2])
    return [world.looking(eye, target) for eye, target in scenes.ring(scene, count, rng)]


def arrange(name: str, seed: int, views: int = RING_VIEWS) -> Scene:
    """The scene of a seed, its target hidden as it asks for from views all round."""
    return scenes.arrange(name, seed, lambda scene: hides_its_target(scene, ring_poses(scene, views, seed)))
