"""Meshes of vessels: surfaces of revolution, and handles as bent tubes.

A mesh is `(vertices, faces)`: metres, rows of three; triangles counter-clockwise seen from outside. The origin is the middle of the
foot, z up.
"""

from __future__ import annotations

import math

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]

SEGMENTS = 72
ARC_SEGMENTS = 20
TUBE_SEGMENTS = 14


def revolve(profile: list[tuple[float, float]], segments: int = SEGMENTS) -> Mesh:
    """The surface that a profile of (radius, height) sweeps around z.

    The profile runs with the body on its left: from the axis at the foot outwards and up, and back to the axis.
    """
    angles = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    vertices: list[tuple[float, float, float]] = []
    rings: list[list[int]] = []
    for radius, height in profile:
        first = len(vertices)
        if radius < 1e-9:
            vertices.append((0.0, 0.0, height))
            rings.append([first] * segments)
        else:
            vertices.extend((radius * math.cos(a), radius * math.sin(a), height) for a in angles)
            rings.append(list(range(first, first + segments)))
    faces: list[tuple[int, int, int]] = []
    for low, high in zip(rings, rings[1:]):
        for i in range(segments):
            j = (i + 1) % segments
            for face in ((low[i], low[j], high[j]), (low[i], high[j], high[i])):
                if len(set(face)) == 3:
                    faces.append(face)
    return np.array(vertices), np.array(faces)


def rounded(profile: list[tuple[float, float]], radius: float, steps: int = 4) -> list[tuple[float, float]]:
    """The profile with its inner corners cut to arcs of about `radius`; its ends stay."""
    points = [np.array(p, dtype=float) for p in profile]
    out = [tuple(points[0])]
    for before, here, after in zip(points, points[1:], points[2:]):
        back, on = before - here, after - here
        cut = min(radius, 0.45 * np.linalg.norm(back), 0.45 * np.linalg.norm(on))
        start = here + back / np.linalg.norm(back) * cut
        end = here + on / np.linalg.norm(on) * cut
        for t in np.linspace(0.0, 1.0, steps + 1):
            out.append(tuple((1 - t) ** 2 * start + 2 * t * (1 - t) * here + t**2 * end))
    return out + [tuple(points[-1])]


def vessel(diameter: float, height: float, base: float, wall: float) -> Mesh:
    """Open at the top and hollow; `base` is its diameter at the foot. Foot and lip are rounded."""
    top, low = 0.5 * diameter, 0.5 * base
    outer = [(0.0, 0.0), (low, 0.0), (top, height)]
    inner = [(top - wall, height), (max(low - wall, 0.3 * low), wall), (0.0, wall)]
    return revolve(rounded(outer + inner, 0.004))


def bowl(diameter: float, height: float, foot: float, wall: float) -> Mesh:
    """Open and wide, with a curved side on a flat foot."""
    def side(radius: float, low: float) -> list[tuple[float, float]]:
        steps = np.linspace(0.0, 0.5 * math.pi, ARC_SEGMENTS)
        start = 0.5 * foot
        return [(start + (radius - start) * math.sin(t), low + (height - low) * (1 - math.cos(t))) for t in steps]

    outer = side(0.5 * diameter, 0.0)
    inner = side(0.5 * diameter - wall, wall)[::-1]
    return revolve([(0.0, 0.0)] + outer + inner + [(0.0, wall)])


def solid(profile: list[tuple[float, float]], rounding: float = 0.003) -> Mesh:
    """A closed body whose outline (radius, height) runs from foot to top, off the axis."""
    ends = [(0.0, profile[0][1])], [(0.0, profile[-1][1])]
    return revolve(rounded(ends[0] + profile + ends[1], rounding))


def canister(diameter: float, height: float, lid_diameter: float, lid_height: float) -> Mesh:
    """A closed cylinder under a lid of another diameter."""
    body, lid, seam = 0.5 * diameter, 0.5 * lid_diameter, height - lid_height
    return solid([(body, 0.0), (body, seam), (lid, seam + 1e-4), (lid, height)], 0.002)


def bottle(diameter: float, height: float, neck_diameter: float, shoulder: float) -> Mesh:
    """A body up to `shoulder` of its height, a curved shoulder, a neck with a cap."""
    body, neck = 0.5 * diameter, 0.5 * neck_diameter
    start, end = shoulder * height, (0.5 * shoulder + 0.45) * height
    curve = [
        (neck + (body - neck) * 0.5 * (1 + math.cos(math.pi * t)), start + (end - start) * t)
        for t in np.linspace(0.0, 1.0, ARC_SEGMENTS)
    ]
    cap = 0.92 * height
    return solid([(body, 0.0)] + curve + [(neck, cap), (1.15 * neck, cap + 1e-4), (1.15 * neck, height)], 0.002)


def box(x: float, y: float, z: float) -> Mesh:
    """Along the axes, with sharp edges."""
    corners = np.array([(i, j, k) for k in (0, 1) for j in (-0.5, 0.5) for i in (-0.5, 0.5)]) * (x, y, z)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return corners, np.array(faces)


def handle(radius: float, low: float, high: float, reach: float, thickness: float, squareness: float) -> Mesh:
    """A tube that leaves a wall of `radius` at height `low`, stands out by `reach` towards x, and is back at height `high`.

    `squareness` 0 bends it to half an ellipse, 1 nearly to a rectangle.
    """
    power = 2.0 / (2.0 + 3.0 * squareness)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    angles = np.linspace(-0.5 * math.pi, 0.5 * math.pi, ARC_SEGMENTS + 1)
    out = np.abs(np.cos(angles)) ** power * (reach - 0.5 * thickness)
    up = np.sign(np.sin(angles)) * np.abs(np.sin(angles)) ** power * (half - 0.5 * thickness)
    path = np.stack([radius + out, np.zeros_like(out), middle + up], axis=1)
    # Both ends stand in the wall.
    sunk = path[[0, -1]] - np.array([min(0.4 * radius, 0.6 * thickness), 0.0, 0.0])
    path = np.concatenate([sunk[:1], path, sunk[1:]])
    return tube(path, 0.5 * thickness, 0.7 * thickness)


def tube(path: np.ndarray, along: float, across: float) -> Mesh:
    """An elliptic tube around a path in the plane y = 0: half axes in that plane and along y. Its ends are closed."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.array([0.0, 1.0, 0.0])
    normals = np.cross(side, tangents)
    turns = np.linspace(0.0, 2.0 * math.pi, TUBE_SEGMENTS, endpoint=False)
    rings = (
        path[:, None, :]
        + along * np.cos(turns)[None, :, None] * normals[:, None, :]
        + across * np.sin(turns)[None, :, None] * side[None, None, :]
    )
    vertices = np.concatenate([rings.reshape(-1, 3), path[[0]], path[[-1]]])
    n, count = TUBE_SEGMENTS, len(path)
    faces = []
    for k in range(count - 1):
        for i in range(n):
            j = (i + 1) % n
            a, b, c, d = k * n + i, k * n + j, (k + 1) * n + j, (k + 1) * n + i
            faces += [(a, b, c), (a, c, d)]
    first, last = count * n, count * n + 1
    for i in range(n):
        j = (i + 1) % n
        faces += [(first, j, i), (last, (count - 1) * n + i, (count - 1) * n + j)]
    return outwards(vertices, np.array(faces))


def cut(mesh: Mesh, edge_m: float) -> Mesh:
    """The same surface in triangles without an edge longer than this: each longer one is halved."""
    vertices, faces = mesh
    while True:
        sides = np.linalg.norm(vertices[faces[:, [1, 2, 0]]] - vertices[faces], axis=2)
        longest, long = sides.argmax(axis=1), sides.max(axis=1) > edge_m
        if not long.any():
            return vertices, faces
        # a and b are the ends of the longest side.
        a, b, c = (faces[long, (longest[long] + k) % 3] for k in range(3))
        middle = len(vertices) + np.arange(len(a))
        vertices = np.concatenate([vertices, 0.5 * (vertices[a] + vertices[b])])
        faces = np.concatenate([faces[~long], np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def outwards(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """The mesh with its faces turned so that it holds a volume above zero."""
    return (vertices, faces) if volume((vertices, faces)) > 0.0 else (vertices, faces[:, ::-1])


def volume(mesh: Mesh) -> float:
    """What the mesh encloses, cubic metres; below zero if its faces look inwards."""
    vertices, faces = mesh
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)
