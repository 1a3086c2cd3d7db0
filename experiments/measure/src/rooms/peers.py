#!/usr/bin/env python3
"""Open3D and small_gicp (both from PyPI) on the drive that `rooms SEED DIR` wrote, one thread.

  peers.py DIR/drive

Prints, with processor seconds, errors of single steps, what is left where the drive came back before and after Open3D's pose graph (multiway registration), the walls that
Open3D's planar patches and repeated RANSAC planes give at true poses, times and the ratio to ours, and memory. Ours, read from the drive, are measured
in the same way.
"""
import glob, os, resource, sys, time
os.environ.update(OMP_NUM_THREADS='1')
import numpy as np, open3d as o3d, small_gicp

drive = sys.argv[1]
clouds = [o3d.io.read_point_cloud(f) for f in sorted(glob.glob(f'{drive}/*.pcd'))]
table = np.loadtxt(f'{drive}/poses.txt').reshape(len(clouds), 4, 3)
walls = np.loadtxt(f'{drive}/walls.txt')
steps_s, closed_s, walls_s, ours_mb = np.loadtxt(f'{drive}/took.txt')
memory_mb = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
had_mb = memory_mb()

def pose(x, y, a):
    m = np.eye(4); m[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]; m[:2, 3] = x, y
    return m

odometry, truth, chain, closed = ([pose(*p) for p in table[:, k]] for k in range(4))
step = lambda p, i: np.linalg.inv(p[i - 1]) @ p[i]
way = lambda m: np.linalg.norm(m[:2, 3])
turn = lambda m: np.degrees(abs(np.arctan2(m[1, 0], m[0, 0])))
steps = range(1, len(clouds))

told = lambda seconds, ours_s: f'{seconds:6.2f} s, {seconds / max(ours_s, .01):5.1f} times ours' if seconds else ''

def of_steps(name, found, seconds):
    off = [np.linalg.inv(step(truth, i)) @ found[i - 1] for i in steps]
    t, w = sorted(map(turn, off)), sorted(map(way, off))
    q = int(.95 * len(off))
    print(f'{name:34} turn off {np.mean(t):5.2f} {t[q]:5.2f} deg, way off {100 * np.mean(w):5.1f} {100 * w[q]:5.1f} cm, {told(seconds, steps_s)}')

def of_poses(name, poses, seconds):
    first = np.linalg.inv(poses[0]); true = np.linalg.inv(truth[0])
    off = [np.linalg.inv(true @ t) @ (first @ p) for p, t in zip(poses, truth)]
    print(f'{name:34} at the end {way(off[-1]):5.2f} m {turn(off[-1]):5.2f} deg, farthest {max(map(way, off)):5.2f}, mean {np.mean([way(o) for o in off]):5.2f} m, {told(seconds, steps_s + closed_s)}')

def chained(found):
    poses = [np.eye(4)]
    for f in found: poses.append(poses[-1] @ f)
    return poses

of_steps('odometry', [step(odometry, i) for i in steps], 0)
of_steps('ours (ICP-EM)', [step(chain, i) for i in steps], steps_s)

# Between floor and ceiling, as ours.
def body(c):
    p = np.asarray(c.points); return c.select_by_index(np.flatnonzero((p[:, 2] > .2) & (p[:, 2] < 2.2) & (p[:, 0] < 8)))
seconds = time.process_time()
small = [body(c).voxel_down_sample(.05) for c in clouds]
for c in small: c.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(.3, 30))
prepared_s = time.process_time() - seconds
reg = o3d.pipelines.registration
def icp(source, target, start, within):
    for w in within: start = reg.registration_icp(source, target, w, start, reg.TransformationEstimationPointToPlane()).transformation
    return start, reg.get_information_matrix_from_point_clouds(source, target, within[-1], start)

seconds = time.process_time()
pairs = [icp(small[i], small[i - 1], step(odometry, i), (.5, .15)) for i in steps]
open3d_s = time.process_time() - seconds + prepared_s
of_steps('Open3D, point to plane', [p[0] for p in pairs], open3d_s)
for kind in ('ICP', 'PLANE_ICP', 'GICP'):
    seconds = time.process_time(); found = []
    points = [np.asarray(body(c).points) for c in clouds]
    for i in steps:
        found.append(small_gicp.align(points[i - 1], points[i], init_T_target_source=step(odometry, i), registration_type=kind, downsampling_resolution=.05, max_correspondence_distance=.5, num_threads=1).T_target_source)
    gicp_s = time.process_time() - seconds
    of_steps(f'small_gicp, {kind}', found, gicp_s)
    of_poses('  chained', chained(found), 0)

print()
of_poses('odometry', odometry, 0); of_poses('ours, chained', chain, 0); of_poses('ours, closed', closed, steps_s + closed_s)
of_poses('Open3D, chained', chained([p[0] for p in pairs]), open3d_s)
# The pose graph on the better steps, those of the last of small_gicp's.
seconds = time.process_time()
poses = chained(found)
graph = reg.PoseGraph()
for p in poses: graph.nodes.append(reg.PoseGraphNode(p))
for i, f in zip(steps, found):
    information = reg.get_information_matrix_from_point_clouds(small[i], small[i - 1], .15, f)
    graph.edges.append(reg.PoseGraphEdge(i, i - 1, f, information, uncertain=False))
ways = np.cumsum([0] + [way(step(truth, i)) for i in steps])
loops = 0
for to in range(len(clouds)):
    # As far off as the chain may have drifted.
    between = {f: np.linalg.inv(poses[f]) @ poses[to] for f in range(to) if ways[to] - ways[f] > 15}
    near = sorted((f for f, m in between.items() if way(m) < max(3.3, .08 * (ways[to] - ways[f])) and turn(m) < 30), key=lambda f: way(between[f]))
    for f in near[:3]:
        again, information = icp(small[to], small[f], between[f], (8., 2., .5, .15))
        graph.edges.append(reg.PoseGraphEdge(to, f, again, information, uncertain=True)); loops += 1
reg.global_optimization(graph, reg.GlobalOptimizationLevenbergMarquardt(), reg.GlobalOptimizationConvergenceCriteria(),
                        reg.GlobalOptimizationOption(max_correspondence_distance=.15, edge_prune_threshold=.25, reference_node=0))
of_poses(f'Open3D graph on them, {loops} loop edges', [n.pose for n in graph.nodes], time.process_time() - seconds + gicp_s)

# Walls at true poses: upright planes held to the true walls, 15 cm.
print()
whole = o3d.geometry.PointCloud()
for c, p in zip(clouds, truth):
    near = c.select_by_index(np.flatnonzero(np.asarray(c.points)[:, 0] < 5)); whole += near.transform(p)
def held(name, planes, seconds):
    """planes: (normal, a point, the points' ends along it)."""
    right = total = angle = offset = 0; found = []
    for n, at, low, high in planes:
        u = np.array([-n[1], n[0]]) / np.hypot(n[0], n[1]); xs = np.arange(low + .05, high, .1)
        found.append((u, n, at, low, high))
        for x in xs:
            q = at[:2] + u * x; total += 1; best = None
            for w in walls:
                v = w[2:] - w[:2]; l = np.linalg.norm(v); v = v / l
                if abs(u[0] * v[1] - u[1] * v[0]) > np.sin(.3): continue
                d = q - w[:2]; t = np.clip(d @ v, 0, l); off = np.linalg.norm(d - t * v)
                if off < .15 and (best is None or off < best[0]): best = (off, np.degrees(np.arcsin(min(1, abs(u[0] * v[1] - u[1] * v[0])))))
            if best: right += 1; offset += best[0]; angle += best[1]
    hit = everything = 0
    for w in walls:
        v = w[2:] - w[:2]; l = np.linalg.norm(v); v = v / l
        for t in np.arange(.05, l, .1):
            q = w[:2] + v * t; everything += 1
            hit += any(abs(u[0] * v[1] - u[1] * v[0]) < np.sin(.3) and abs((q - at[:2]) @ (n[:2] / np.hypot(*n[:2]))) < .15 and low - .15 < (q - at[:2]) @ u < high + .15 for u, n, at, low, high in found)
    print(f'{name:34} {len(planes):3} walls, precision {100 * right / max(total, 1):5.1f}, recall {100 * hit / everything:5.1f} %, angle {angle / max(right, 1):.2f} deg, offset {100 * offset / max(right, 1):.1f} cm, {told(seconds, walls_s)}')
def extent(points, n):
    at = points.mean(0); u = np.array([-n[1], n[0]]) / np.hypot(n[0], n[1]); x = (points[:, :2] - at[:2]) @ u
    return n, at, x.min(), x.max()
def of_feet(x, y, u, v):
    along = np.array([u - x, v - y]); half = np.linalg.norm(along) / 2
    return np.array([-along[1], along[0], 0]) / (2 * half), np.array([(x + u) / 2, (y + v) / 2, 0]), -half, half
held('ours', [of_feet(*feet) for feet in np.loadtxt(f'{drive}/ours.txt') if np.hypot(*(feet[2:] - feet[:2])) > 0], walls_s)
seconds = time.process_time()
thin = whole.voxel_down_sample(.05); thin.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(.3, 50))
boxes = thin.detect_planar_patches(normal_variance_threshold_deg=60, coplanarity_deg=75, outlier_ratio=.75, min_plane_edge_length=.5, min_num_points=50, search_param=o3d.geometry.KDTreeSearchParamKNN(30))
seconds = time.process_time() - seconds
upright = []
for b in boxes:
    n = b.R[:, 2]
    if abs(n[2]) < .3 and np.ptp(np.asarray(b.get_box_points())[:, 2]) > 1: upright.append(extent(np.asarray(b.get_box_points()), n))
held('Open3D, planar patches', upright, seconds)
seconds = time.process_time(); rest = whole.voxel_down_sample(.05); p = np.asarray(rest.points); rest = rest.select_by_index(np.flatnonzero((p[:, 2] > .2) & (p[:, 2] < 2.2))); upright = []
o3d.utility.random.seed(1)
for _ in range(25):
    if len(rest.points) < 500: break
    (a, b, c, d), inside = rest.segment_plane(.05, 3, 1000); n = np.array([a, b, c]); points = np.asarray(rest.points)[inside]
    if abs(c) < .3 and np.ptp(points[:, 2]) > 1: upright.append(extent(points, n))
    rest = rest.select_by_index(inside, invert=True)
held('Open3D, RANSAC one after another', upright, time.process_time() - seconds)
print(f'\nmost memory beyond the clouds: {memory_mb() - had_mb:.0f} MB, ours {ours_mb:.0f} MB')
