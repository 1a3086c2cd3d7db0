"""A scene that can be photographed: the model, its state, a camera."""

from __future__ import annotations

import mujoco
import numpy as np

from . import home, household, machine, noise, scenes, world
from .camera import FOCAL_PX, HEIGHT, WIDTH, Camera, Frame, aim_eye
from .scenes import Scene

SCENES = {
    "floor": scenes.floor, "two-tables": scenes.two_tables, "absent": scenes.absent, "present": scenes.present,
    "search": scenes.search, "four-cups": scenes.four_cups, "home": home.home,
    household.OWN.scene: household.OWN, household.SHARED.scene: household.SHARED,
}
# Visibility is measured on small images.
SHARE_SCALE = 4
RING_VIEWS = 12
# From the tables' corners to where a base starts, and from there to the walls, metres.
START_GAP_M, WALL_GAP_M = 0.4, 0.4


class Stage:
    """The scene as a model with its camera; what stands in it may have moved since it was arranged."""

    def __init__(self, scene: Scene, width: int = WIDTH, height: int = HEIGHT, focal_px: float = FOCAL_PX, robot: bool = False):
        self.scene = scene
        spec = world.specification(scene, width, height, focal_px)
        if robot:
            machine.add(spec, scene, width, height, focal_px)
        self.model = spec.compile()
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

    def frame(self, camera: str) -> Frame:
        """The ideal frame of a camera of the model."""
        return self.camera.frame(self.data, camera)

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

    def visible_shares(self, names: list[str], map_from_camera: np.ndarray) -> dict[str, float]:
        """Share of each thing's pixels that nothing hides; 0 if it is not in the image."""
        self._aim(map_from_camera)
        seen = self.camera.bodies(self.data)
        colours, shares = self.model.geom_rgba.copy(), {}
        for name in names:
            number = self.model.body(name).id
            self.model.geom_rgba[self.model.geom_bodyid != number, 3] = 0.0
            alone = int((self.camera.bodies(self.data) == number).sum())
            self.model.geom_rgba[:] = colours
            shares[name] = int((seen == number).sum()) / alone if alone else 0.0
        return shares


def small_stage(scene: Scene) -> Stage:
    """The same with small images, for what is only counted."""
    return Stage(scene, WIDTH // SHARE_SCALE, HEIGHT // SHARE_SCALE, FOCAL_PX / SHARE_SCALE)


def target_shares(stage: Stage, views: list[np.ndarray]) -> list[float]:
    """How much of the target each view shows; nothing if it does not stand there."""
    target = stage.scene.target
    if not any(p.thing.name == target for p in stage.scene.placed):
        return []
    return [stage.visible_shares([target], view)[target] for view in views]


def hides_its_target(scene: Scene, views: list[np.ndarray]) -> bool:
    """Whether some view hides the target as far as asked for, and the best one shows as much of it as asked for."""
    (low, high), (least, most) = scene.target_from_start, scene.target_from_best
    if (low, high) == (least, most) == (0.0, 1.0):
        return True
    with small_stage(scene) as stage:
        shares = target_shares(stage, views)
    if not shares:
        return True
    return low <= min(shares) <= high and least <= max(shares) <= most


def worst_first(stage: Stage, views: list[np.ndarray]) -> list[np.ndarray]:
    """The views in their order round the tables, from the one on that shows least of the target."""
    shares = target_shares(stage, views)
    first = int(np.argmin(shares)) if shares else 0
    return views[first:] + views[:first]


def ring_poses(scene: Scene, count: int, seed: int) -> list[np.ndarray]:
    """`map_from_camera` of views all round."""
    rng = np.random.default_rng([seed, 2])
    return [world.looking(eye, target) for eye, target in scenes.ring(scene, count, rng)]


def arrange(name: str, seed: int, views: int = RING_VIEWS) -> Scene:
    """The scene of a seed, its target hidden as it asks for from views all round."""
    return scenes.arrange(SCENES[name], seed, lambda scene: hides_its_target(scene, ring_poses(scene, views, seed)))


def start_pose(scene: Scene) -> tuple[float, float, float]:
    """Where the base starts among rooms; in one room where it may stand and sees least of the target: on a ring round the tables."""
    if scene.rooms:
        return scene.start
    middle = np.mean([t.centre_m() for t in scene.tables], axis=0)
    reach = max(float(np.linalg.norm(np.array(c) - middle[:2])) for t in scene.tables for c in t.outline_m()) + START_GAP_M
    poses, views = [], []
    for angle in np.linspace(0.0, 2.0 * np.pi, RING_VIEWS, endpoint=False):
        at = middle[:2] + reach * np.array([np.cos(angle), np.sin(angle)])
        if all(abs(p) < 0.5 * side - WALL_GAP_M for p, side in zip(at, scene.room_m)):
            poses.append((float(at[0]), float(at[1]), float(angle - np.pi)))
            views.append(world.looking(np.array([*at, machine.HEAD_HEIGHT_M]), middle))
    with small_stage(scene) as stage:
        first = worst_first(stage, views)[0]
    return poses[next(k for k, view in enumerate(views) if view is first)]
