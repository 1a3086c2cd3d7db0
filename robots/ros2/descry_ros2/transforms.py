"""Transforms over time: what tf2 does, in a hundred lines, so that a frame counts only with the transforms of its own stamp.

A transform is (translation, quaternion x y z w), named `parent_from_child`.
"""

import bisect
import collections
import math
import threading

KEPT_NS = 30_000_000_000
IDENTITY = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


class Missing(Exception):
    """No transform between two frames at a stamp, and why."""


def times(a, b):
    """The product of two quaternions."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def turn(q, v):
    """A vector turned by a quaternion."""
    x, y, z, w = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx)


def chain(a, b):
    """a_from_c of a_from_b and b_from_c."""
    moved = turn(a[1], b[0])
    return tuple(p + q for p, q in zip(a[0], moved)), times(a[1], b[1])


def inverse(a):
    x, y, z, w = a[1]
    back = (-x, -y, -z, w)
    return tuple(-p for p in turn(back, a[0])), back


def between(a, b, share):
    """A transform between two, straight and by the shorter turn."""
    p = tuple(u + share * (v - u) for u, v in zip(a[0], b[0]))
    cosine = sum(u * v for u, v in zip(a[1], b[1]))
    other = b[1] if cosine >= 0 else tuple(-v for v in b[1])
    q = tuple(u + share * (v - u) for u, v in zip(a[1], other))
    length = math.sqrt(sum(v * v for v in q)) or 1.0
    return p, tuple(v / length for v in q)


def yaw(transform):
    x, y, z, w = transform[1]
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def said(transform):
    """As the protocol writes it."""
    return {"translation": list(transform[0]), "rotation": list(transform[1])}


class Transforms:
    """What was published of frames; it may be asked and told from any thread."""

    def __init__(self):
        self.fixed, self.moving, self.told = {}, {}, threading.Condition()

    def tell(self, parent, child, stamp_ns, transform, is_fixed):
        parent, child = parent.lstrip("/"), child.lstrip("/")
        with self.told:
            if is_fixed:
                self.fixed[child] = (parent, transform)
            else:
                line = self.moving.setdefault(child, collections.deque())
                if line and stamp_ns < line[-1][0] - KEPT_NS:  # the clock began again
                    line.clear()
                if not line or stamp_ns > line[-1][0]:
                    line.append((stamp_ns, parent, transform))
                while line[0][0] < stamp_ns - KEPT_NS:
                    line.popleft()
            self.told.notify_all()

    def at(self, parent, child, stamp_ns):
        """parent_from_child at a stamp; `Missing` if it is not known, or not yet."""
        with self.told:
            up, down = self._edges(parent, child)
            return chain(inverse(self._along(down, stamp_ns)), self._along(up, stamp_ns))

    def _edges(self, parent, child):
        """The frames below the nearest one that is above both: from the child, and from the parent."""
        up, down = self._above(child), self._above(parent)
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            raise Missing(f"nothing joins the frames {parent} and {child}")
        return up[: up.index(common)], down[: down.index(common)]

    def _above(self, frame):
        frames = [frame]
        while len(frames) < 100 and (frames[-1] in self.fixed or frames[-1] in self.moving):
            last = frames[-1]
            frames.append(self.fixed[last][0] if last in self.fixed else self.moving[last][-1][1])
        return frames

    def _along(self, frames, stamp_ns):
        here = IDENTITY
        for frame in frames:
            step = self.fixed[frame][1] if frame in self.fixed else self._moving_at(frame, stamp_ns)
            here = chain(step, here)
        return here

    def _moving_at(self, frame, stamp_ns):
        line = self.moving[frame]
        stamps = [stamp for stamp, _, _ in line]
        n = bisect.bisect_left(stamps, stamp_ns)
        if n == len(line):
            raise Missing(f"the newest transform of {frame} is {(stamp_ns - stamps[-1]) * 1e-9:.3f} s older than what was asked for")
        if stamps[n] == stamp_ns:
            return line[n][2]
        if n == 0:
            raise Missing(f"the oldest transform of {frame} is {(stamps[0] - stamp_ns) * 1e-9:.3f} s newer than what was asked for")
        (before, _, a), (after, _, b) = line[n - 1], line[n]
        return between(a, b, (stamp_ns - before) / (after - before))

    def wait(self, parent, child, stamp_ns, wall_s, clock):
        """`at`, as soon as it is known, within a time on the wall's clock."""
        until = clock() + wall_s
        while True:
            try:
                return self.at(parent, child, stamp_ns)
            except Missing:
                left = until - clock()
                if left <= 0:
                    raise
            with self.told:
                self.told.wait(min(left, 0.05))

    def newest(self, parent, child):
        """The newest parent_from_child, and its stamp."""
        with self.told:
            up, down = self._edges(parent, child)
            stamp = min((self.moving[f][-1][0] for f in up + down if f not in self.fixed), default=0)
        return self.at(parent, child, stamp), stamp
