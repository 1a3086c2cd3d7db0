"""What an ideal camera sees: depth along z, which body each pixel shows, colours."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from .world import EYE, FAR_M, SEEN

# The camera of the recordings: a structured-light sensor of the first generation.
WIDTH, HEIGHT, FOCAL_PX = 640, 480, 570.0


@dataclass(frozen=True)
class Frame:
    """Depth along z (metres, NaN where nothing is), the number of each pixel's body (0 for the room), colours."""

    depth_m: np.ndarray
    body: np.ndarray
    colour: np.ndarray


class Camera:
    """A pinhole camera; its principal point is the middle of the image."""

    def __init__(self, model: mujoco.MjModel, width: int = WIDTH, height: int = HEIGHT, focal_px: float = FOCAL_PX):
        self.model, self.width, self.height, self.focal_px = model, width, height, focal_px
        self._renderer = mujoco.Renderer(model, height, width)
        self._options = mujoco.MjvOption()
        self._options.geomgroup[:] = 0
        self._options.geomgroup[SEEN] = 1

    def close(self) -> None:
        self._renderer.close()

    @property
    def centre_px(self) -> tuple[float, float]:
        return 0.5 * (self.width - 1), 0.5 * (self.height - 1)

    def _draw(self, data: mujoco.MjData, camera: str) -> np.ndarray:
        self._renderer.update_scene(data, camera, self._options)
        return self._renderer.render()

    def depth(self, data: mujoco.MjData, camera: str = EYE) -> np.ndarray:
        """Depth along z, metres; NaN where nothing is."""
        self._renderer.enable_depth_rendering()
        depth = self._draw(data, camera).astype(np.float32)
        self._renderer.disable_depth_rendering()
        return np.where(depth < 0.999 * FAR_M, depth, np.float32(np.nan))

    def bodies(self, data: mujoco.MjData, camera: str = EYE) -> np.ndarray:
        """The number of the body that each pixel shows; 0 for the room."""
        self._renderer.enable_segmentation_rendering()
        geoms = self._draw(data, camera)
        self._renderer.disable_segmentation_rendering()
        number = geoms[:, :, 0]
        return np.where(number >= 0, self.model.geom_bodyid[np.maximum(number, 0)], 0)

    def frame(self, data: mujoco.MjData, camera: str = EYE) -> Frame:
        return Frame(self.depth(data, camera), self.bodies(data, camera), self._draw(data, camera).copy())


def aim_eye(data: mujoco.MjData, map_from_camera: np.ndarray) -> None:
    """Puts the free camera there (optical frame: x right, y down, z forward)."""
    rotation = map_from_camera[:3, :3] * np.array([1.0, -1.0, -1.0])
    number = data.model.body(EYE).mocapid[0]
    data.mocap_pos[number] = map_from_camera[:3, 3]
    mujoco.mju_mat2Quat(data.mocap_quat[number], rotation.ravel())
