"""A scene as a MuJoCo model: what is seen are meshes, what collides are simple bodies inside them."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from .scenes import Doorway, Placed, Scene, Table
from .things import HANDLED

# Groups of geoms: what is drawn, and what only collides.
SEEN, FELT = 0, 3
# Planes between which depth is drawn, metres; beyond the far one nothing is seen.
NEAR_M, FAR_M = 0.1, 12.0
WALL_HEIGHT_M, WALL_M = 2.5, 0.1
# The leaf of a door: its height, its thickness, and how far it hangs from wall and floor, metres.
LEAF_M, LEAF_THICK_M, LEAF_GAP_M = 2.0, 0.04, 0.01
EYE = "eye"


def yaw_quat(yaw: float) -> list[float]:
    return [math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)]


def specification(scene: Scene, width: int, height: int, focal_px: float) -> mujoco.MjSpec:
    """Room, tables, things, and a camera `eye` on a body that can be put anywhere."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.004
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = width, height
    visual.quality.shadowsize = 0
    visual.headlight.ambient, visual.headlight.diffuse, visual.headlight.specular = [0.45] * 3, [0.45] * 3, [0.1] * 3
    # `znear` and `zfar` are shares of the extent.
    spec.stat.extent = 1.0
    spec.stat.center = [0.0, 0.0, 0.7]
    visual.map.znear, visual.map.zfar = NEAR_M, FAR_M
    world = spec.worldbody
    world.add_light(pos=[0.7, -1.2, 2.4], dir=[-0.3, 0.5, -0.9], diffuse=[0.4] * 3, castshadow=False)
    _add_room(world, scene)
    for door in scene.doors:
        _add_wall_with_door(spec, scene, door)
    for table in scene.tables:
        _add_table(world, table)
    for placed in scene.placed:
        _add_thing(spec, placed)
    eye = world.add_body(name=EYE, mocap=True)
    eye.add_camera(name=EYE, fovy=math.degrees(2.0 * math.atan(0.5 * height / focal_px)))
    return spec


def _add_room(world, scene: Scene) -> None:
    x, y = (0.5 * side for side in scene.room_m)
    box = mujoco.mjtGeom.mjGEOM_BOX
    # A box, not a plane: a plane without end would be drawn through the walls.
    world.add_geom(name="floor", type=box, size=[x, y, 0.05], pos=[0, 0, -0.05], rgba=[*scene.floor_colour, 1], group=SEEN)
    half = 0.5 * WALL_M
    walls = [([x + half, 0], [half, y]), ([-x - half, 0], [half, y]), ([0, y + half], [x, half]), ([0, -y - half], [x, half])]
    for k, (at, size) in enumerate(walls):
        world.add_geom(
            name=f"wall {k}", type=box, size=[*size, 0.5 * WALL_HEIGHT_M], pos=[*at, 0.5 * WALL_HEIGHT_M],
            rgba=[*scene.wall_colour, 1], group=SEEN,
        )


def _add_wall_with_door(spec: mujoco.MjSpec, scene: Scene, door: Doorway) -> None:
    """The wall from one side of the house to the other, what is above the opening, and the leaf that slides along the wall."""
    box, (x, y), half_wall, half_door = mujoco.mjtGeom.mjGEOM_BOX, door.centre_m, 0.5 * door.wall_m, 0.5 * door.width_m
    frame = spec.worldbody.add_body(name=f"wall of {door.name}", pos=[x, y, 0.0], quat=yaw_quat(door.along_rad))
    rgba = [*scene.wall_colour, 1]
    # Along the wall; it runs along y.
    ends = (-0.5 * scene.room_m[1] - y, 0.5 * scene.room_m[1] - y)
    for low, high in ((ends[0], -half_door), (half_door, ends[1])):
        size = [0.5 * (high - low), half_wall, 0.5 * WALL_HEIGHT_M]
        frame.add_geom(type=box, size=size, pos=[0.5 * (low + high), 0, 0.5 * WALL_HEIGHT_M], rgba=rgba, group=SEEN)
    above = 0.5 * (WALL_HEIGHT_M - LEAF_M)
    frame.add_geom(type=box, size=[half_door, half_wall, above], pos=[0, 0, WALL_HEIGHT_M - above], rgba=rgba, group=SEEN)
    aside = -(half_wall + LEAF_GAP_M + 0.5 * LEAF_THICK_M)
    leaf = frame.add_body(name=door.name, pos=[0.0, aside, LEAF_GAP_M])
    leaf.add_joint(name=door.name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0], damping=20.0)
    half = [half_door + 0.02, 0.5 * LEAF_THICK_M, 0.5 * LEAF_M]
    leaf.add_geom(type=box, size=half, pos=[0, 0, half[2]], mass=20.0, rgba=[*(0.8 * c for c in scene.wall_colour), 1], group=SEEN)
    gain = 2000.0
    spec.add_actuator(
        name=door.name, target=door.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, gainprm=padded(gain),
        biastype=mujoco.mjtBias.mjBIAS_AFFINE, biasprm=padded(0.0, -gain, -400.0),
    )


def padded(*numbers: float) -> list[float]:
    """The ten parameters of an actuator, zero from where they are not given."""
    return [*numbers, *[0.0] * (10 - len(numbers))]


def _add_table(world, table: Table) -> None:
    box = mujoco.mjtGeom.mjGEOM_BOX
    body = world.add_body(name=table.name, pos=[*table.position_m, 0.0], quat=yaw_quat(table.yaw_rad))
    a, b = (0.5 * side for side in table.size_m)
    rgba = [*table.colour, 1]
    below = table.height_m - table.top_m
    body.add_geom(name=f"{table.name} top", type=box, size=[a, b, 0.5 * table.top_m], pos=[0, 0, below + 0.5 * table.top_m], rgba=rgba, group=SEEN)
    if table.leg_m == 0.0:
        body.add_geom(type=box, size=[a - 0.02, b - 0.02, 0.5 * below], pos=[0, 0, 0.5 * below], rgba=rgba, group=SEEN)
        return
    half = 0.5 * table.leg_m
    for i in (-1, 1):
        for j in (-1, 1):
            at = [i * (a - half - 0.03), j * (b - half - 0.03), 0.5 * below]
            body.add_geom(type=box, size=[half, half, 0.5 * below], pos=at, rgba=rgba, group=SEEN)


def _add_thing(spec: mujoco.MjSpec, placed: Placed) -> None:
    thing = placed.thing
    body = spec.worldbody.add_body(name=thing.name, pos=[placed.x_m, placed.y_m, placed.z_m], quat=yaw_quat(placed.yaw_rad))
    body.add_freejoint(name=thing.name)
    for k, (vertices, faces) in enumerate(thing.meshes()):
        mesh = spec.add_mesh(name=f"{thing.name} {k}", uservert=vertices.ravel(), userface=faces.ravel().astype(int))
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        colour = thing.colour_of(k)
        looks = {"rgba": [*colour, 1]} if isinstance(colour, tuple) else {"material": _paint(spec, mesh, colour)}
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name, **looks, mass=0.0, contype=0, conaffinity=0, group=SEEN,
        )
    half = 0.5 * thing.height_m
    felt = dict(pos=[0, 0, half], group=FELT, friction=[0.6, 0.005, 0.0001], condim=4)
    if thing.is_box:
        size = [0.5 * thing.size["x"], 0.5 * thing.size["y"], half]
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, mass=thing.mass_kg, **felt)
        return
    radius = 0.5 * thing.size["base"] if thing.shape == "bowl" else thing.radius_m
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, half, 0], mass=thing.mass_kg, **felt)
    if thing.shape == HANDLED:
        s = thing.size
        middle = 0.5 * (s["low"] + s["high"]) * s["height"]
        half_grip = [0.5 * s["reach"], 0.7 * s["thickness"], 0.5 * (s["high"] - s["low"]) * s["height"]]
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=half_grip, mass=0.02,
            **{**felt, "pos": [0.25 * (s["diameter"] + s["base"]) + half_grip[0], 0, middle]},
        )


def _paint(spec: mujoco.MjSpec, mesh, colours: np.ndarray) -> str:
    """Gives each face of a mesh a colour of its own, as one pixel of a texture; the name of the material."""
    count, side = len(colours), math.ceil(math.sqrt(len(colours)))
    pixels = np.zeros((side * side, 3), np.uint8)
    pixels[:count] = np.rint(255.0 * colours)
    texture = spec.add_texture(name=mesh.name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=side, height=side, nchannel=3)
    texture.data = pixels.tobytes()
    row, column = np.divmod(np.arange(count), side)
    mesh.usertexcoord = ((np.stack([column, row], axis=1) + 0.5) / side).ravel()
    mesh.userfacetexcoord = np.repeat(np.arange(count), 3)
    material = spec.add_material(name=mesh.name)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = texture.name
    return material.name


def looking(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """`map_from_camera` (4x4, optical frame: x right, y down, z forward) of a level camera at `eye` that looks at `target`."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = eye
    return pose
