"""The robot's parts in the model: a base on slides, a pan-tilt head with the camera, a hand that goes where it is put."""

from __future__ import annotations

import mujoco
import numpy as np

from .scenes import Scene
from .world import FELT, padded, yaw_quat

RADIUS_M, HEAD_HEIGHT_M = 0.25, 1.4
HEAD_CAMERA, HAND, BASE = "head camera", "hand", "base"
# The hand waits here when it has nothing to do: above the room, out of the way of everything.
PARKED_M = (0.0, 0.0, 6.0)
# Half sizes of the pad that pushes: thin, wide, low.
PAD_M = (0.008, 0.035, 0.025)


def add(spec: mujoco.MjSpec, scene: Scene, width: int, height: int, focal_px: float) -> None:
    """Puts the robot at the scene's start. Nothing of it is drawn: its camera looks past it."""
    x, y, yaw = scene.start
    base = spec.worldbody.add_body(name=BASE, pos=[0, 0, 0])
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    cylinder = mujoco.mjtGeom.mjGEOM_CYLINDER
    for name, kind, axis, at in (("x", slide, [1, 0, 0], x), ("y", slide, [0, 1, 0], y), ("yaw", hinge, [0, 0, 1], yaw)):
        base.add_joint(name=name, type=kind, axis=axis, ref=0.0, damping=1.0)
        gain = 4000.0 if kind == slide else 400.0
        spec.add_actuator(
            name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, gainprm=padded(gain), biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=padded(0.0, 0.0, -gain), forcelimited=True, forcerange=[-600.0, 600.0],
        )
    # A little above the floor, so that it does not rub.
    base.add_geom(type=cylinder, size=[RADIUS_M, 0.15, 0], pos=[0, 0, 0.17], mass=40.0, group=FELT, rgba=[0.2, 0.2, 0.25, 1])
    base.add_geom(type=cylinder, size=[0.03, 0.5, 0], pos=[0, 0, 0.82], mass=3.0, group=FELT, contype=0, conaffinity=0)
    pan = base.add_body(name="pan", pos=[0, 0, HEAD_HEIGHT_M])
    tilt = pan.add_body(name="tilt")
    for body, name, axis in ((pan, "pan", [0, 0, 1]), (tilt, "tilt", [0, 1, 0])):
        body.add_joint(name=name, type=hinge, axis=axis, damping=6.0)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], mass=0.5, group=FELT, contype=0, conaffinity=0)
        spec.add_actuator(
            name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, gainprm=padded(60.0), biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=padded(0.0, -60.0, -1.0),
        )
    # A camera looks along its -z with y up: along the base's x when the head is level.
    tilt.add_camera(name=HEAD_CAMERA, fovy=float(np.degrees(2.0 * np.arctan(0.5 * height / focal_px))), quat=[0.5, 0.5, -0.5, -0.5])
    hand = spec.worldbody.add_body(name=HAND, mocap=True, pos=list(PARKED_M))
    hand.add_geom(name=HAND, type=mujoco.mjtGeom.mjGEOM_BOX, size=list(PAD_M), group=FELT, friction=[0.4, 0.005, 0.0001])
    for placed in scene.placed:
        weld = spec.add_equality(
            name=placed.thing.name, type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY,
            name1=HAND, name2=placed.thing.name, active=False,
        )
        weld.solref = [0.01, 1.0]


def place(model: mujoco.MjModel, data: mujoco.MjData, pose: tuple[float, float, float]) -> None:
    """Puts the base there."""
    for name, value in zip(("x", "y", "yaw"), pose):
        data.qpos[model.joint(name).qposadr[0]] = value


def put_hand(data: mujoco.MjData, at: np.ndarray, yaw: float) -> None:
    """Where the hand is to be, its pad across the heading `yaw`."""
    number = data.model.body(HAND).mocapid[0]
    data.mocap_pos[number] = at
    data.mocap_quat[number] = yaw_quat(yaw)
