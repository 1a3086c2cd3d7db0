"""Shortest ways between points of a world, past the hallways that are shut: exact, by the corners of the free floor."""

import heapq
import math

import numpy as np
import shapely

SIMPLE_M = 0.01  # the rounds of circles need no more corners than this error asks for


class Ways:
    def __init__(self, workshop):
        self.workshop, self.graphs, self.found = workshop, {}, {}
        floor = shapely.union_all([e.internal_collision_polygon for e in workshop.world.rooms + workshop.world.hallways])
        self.floor = floor.buffer(-0.001).simplify(SIMPLE_M)

    def way(self, start, goal, shut):
        """Points of the shortest way and its length in metres; None and infinity where there is none."""
        key = (start, goal, shut)
        if key not in self.found:
            self.found[key] = self._search(start, goal, shut)
        return self.found[key]

    def metres(self, start, goal, shut):
        return self.way(start, goal, shut)[1]

    def _search(self, start, goal, shut):
        free, corners, links = self._graph(shut)
        points = [*corners, start, goal]
        ends = {k: _seen(free, points, k) for k in (len(corners), len(corners) + 1)}
        to_goal = {a: d for a, d in ends[len(corners) + 1]}
        best, queue, done = {len(corners): (0.0, None)}, [(0.0, len(corners))], set()
        while queue:
            far, here = heapq.heappop(queue)
            if here in done:
                continue
            done.add(here)
            if here == len(corners) + 1:
                break
            near = list(ends[here] if here in ends else links[here])
            if here in to_goal:
                near.append((len(corners) + 1, to_goal[here]))
            for there, step in near:
                if there not in best or far + step < best[there][0]:
                    best[there] = (far + step, here)
                    heapq.heappush(queue, (far + step, there))
        last = len(corners) + 1
        if last not in best:
            return None, math.inf
        way, here = [], last
        while here is not None:
            way.append(points[here])
            here = best[here][1]
        return way[::-1], best[last][0]

    def _graph(self, shut):
        if shut not in self.graphs:
            halls = [self.workshop.doors[name].inflated_closed_polygon.buffer(0.001) for name in sorted(shut)]
            free = self.floor.difference(shapely.union_all(halls)) if halls else self.floor
            pieces = list(free.geoms) if hasattr(free, "geoms") else [free]
            rings = [ring for piece in pieces for ring in (piece.exterior, *piece.interiors)]
            corners = list({(round(x, 6), round(y, 6)) for ring in rings for x, y in ring.coords})
            free = free.buffer(1e-6)
            shapely.prepare(free)
            self.graphs[shut] = free, corners, [_seen(free, corners, k) for k in range(len(corners))]
        return self.graphs[shut]


def _seen(free, points, k):
    """The points that a straight line from point `k` reaches, with its length."""
    ends = np.array(points)
    lines = shapely.linestrings(np.stack([np.repeat(ends[k : k + 1], len(ends), axis=0), ends], axis=1))
    inside = shapely.covers(free, lines)
    return [(j, math.dist(points[k], points[j])) for j in np.flatnonzero(inside) if j != k]
