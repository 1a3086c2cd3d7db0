"""A robot of a room behind real ROS 2 topics, tf and actions, in a process of its own: a table with a cup on it, a camera on a pan-tilt
head, a laser, and a navigation that drives straight.

`fake_robot.py [FAULT]`: `short` (navigation calls goals reached that are 1.5 m off), `lagging` (tf stops half a minute in), `dead` (the
camera falls silent after the first drive), `paused` (the clock stands still after the first drive), `empty` (there is no cup).
"""

import math
import pathlib
import sys
import threading
import time

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[2] / "python")]
import descry_robot as geometry
import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory

ROOM, CELL, TABLE, TOP, CUP = 2.5, 0.05, (0.6, 0.4), 0.72, (0.1, -0.05)
RADIUS, HEIGHT, WALL = 0.035, 0.104, 0.003  # of the cup
HEAD = {"base_from_head": [0.0, 0.0, 1.3], "pan_limit_rad": 2.6, "tilt_down_rad": 1.2, "tilt_up_rad": 0.8}
WIDE, HIGH, FOCAL, SPEED = 640, 480, 570.0, 3.0
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def nearest(candidates):
    """The smallest positive of several distances, pixel by pixel."""
    return np.min([np.where(np.isfinite(t) & (t > 0.05) & ok, t, np.inf) for t, ok in candidates], axis=0)


def depths(at, pan, tilt, has_cup, noise):
    """Metres along the optical axis, inf where nothing returns."""
    x, y, yaw = at
    c, s = math.cos(yaw), math.sin(yaw)
    axes = np.array(geometry.camera_axes(pan, tilt)) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    u, v = np.meshgrid(np.arange(WIDE), np.arange(HIGH))
    d = ((u - WIDE / 2 + 0.5) / FOCAL)[..., None] * axes[0] + ((v - HIGH / 2 + 0.5) / FOCAL)[..., None] * axes[1] + axes[2]
    o = np.array([x, y, HEAD["base_from_head"][2]])
    with np.errstate(divide="ignore", invalid="ignore"):
        level = lambda z: (z - o[2]) / d[..., 2]
        on = lambda t: (o[0] + t * d[..., 0], o[1] + t * d[..., 1])
        top = level(TOP)
        px, py = on(top)
        hits = [(level(0.0), True), (top, (abs(px) < TABLE[0]) & (abs(py) < TABLE[1]))]
        hits += [((math.copysign(ROOM, 1) * k - o[i]) / d[..., i], True) for i in (0, 1) for k in (-1, 1)]
        for radius, turn in ((RADIUS, -1), (RADIUS - WALL, 1)) if has_cup else ():  # outside, from outside; inside, from within
            ex, ey = o[0] - CUP[0], o[1] - CUP[1]
            a = d[..., 0] ** 2 + d[..., 1] ** 2
            b = ex * d[..., 0] + ey * d[..., 1]
            t = (-b + turn * np.sqrt(b * b - a * (ex * ex + ey * ey - radius * radius))) / a
            z = o[2] + t * d[..., 2]
            hits += [(t, (z > TOP) & (z < TOP + HEIGHT))]
        if has_cup:
            for z, inner, outer in ((TOP + HEIGHT, RADIUS - WALL, RADIUS), (TOP + WALL, 0.0, RADIUS - WALL)):
                t = level(z)
                px, py = on(t)
                r = np.hypot(px - CUP[0], py - CUP[1])
                hits += [(t, (r <= outer) & (r >= inner))]
        z = nearest(hits)
    return z + noise.normal(0.0, 0.001, z.shape) * z * z


class Robot:
    def __init__(self, fault):
        self.fault, self.at, self.gaze, self.drives = fault, (-1.8, 0.0, 0.0), (0.0, 0.3), 0
        self.began, self.noise = time.monotonic(), np.random.default_rng(1)
        rclpy.init(args=["--ros-args", "-p", f"use_sim_time:={str(fault == 'paused').lower()}"])
        self.node = n = rclpy.create_node("fake_robot")
        self.depth, self.info = n.create_publisher(Image, "camera/depth", SENSOR), n.create_publisher(CameraInfo, "camera/info", SENSOR)
        self.laser, self.clock = n.create_publisher(LaserScan, "scan", SENSOR), n.create_publisher(Clock, "/clock", 10)
        self.tf, self.fixed = n.create_publisher(TFMessage, "/tf", 100), n.create_publisher(TFMessage, "/tf_static", LATCHED)
        self.map = n.create_publisher(OccupancyGrid, "map", LATCHED)
        group = ReentrantCallbackGroup()
        n.create_subscription(JointTrajectory, "head/trajectory", self.look, 10, callback_group=group)
        ActionServer(n, NavigateToPose, "navigate_to_pose", self.drive, callback_group=group, cancel_callback=lambda _: CancelResponse.ACCEPT)
        self.publish_map()
        self.fixed.publish(TFMessage(transforms=[self.transform("base_link", "laser", geometry.planar(0, 0, 0))]))
        threading.Thread(target=self.every, args=(0.02, self.publish_tf), daemon=True).start()
        threading.Thread(target=self.every, args=(0.1, self.publish_sensors), daemon=True).start()

    def is_on(self, fault):
        return self.fault == fault and self.drives > 0

    def every(self, seconds, call):
        while rclpy.ok():
            call()
            time.sleep(seconds)

    def stamp(self):
        now = self.node.get_clock().now()
        return now.to_msg()

    def transform(self, parent, child, pose):
        t = TransformStamped(child_frame_id=child)
        t.header.frame_id, t.header.stamp = parent, self.stamp()
        p, q = t.transform.translation, t.transform.rotation
        (p.x, p.y, p.z), (q.x, q.y, q.z, q.w) = map(float, pose["translation"]), map(float, pose["rotation"])
        return t

    def publish_tf(self):
        if self.fault == "paused":
            if not self.is_on("paused"):
                ns = round((time.monotonic() - self.began) * 1e9) + 10**9
                message = Clock()
                message.clock.sec, message.clock.nanosec = divmod(ns, 10**9)
                self.clock.publish(message)
        if self.is_on("lagging"):
            return
        frames = [("map", "odom", geometry.planar(0, 0, 0)), ("odom", "base_link", geometry.planar(*self.at))]
        frames += [("base_link", "camera", geometry.base_from_camera(HEAD, *self.gaze))]
        self.tf.publish(TFMessage(transforms=[self.transform(*frame) for frame in frames]))

    def publish_sensors(self):
        if self.is_on("dead"):
            return
        stamp, at, gaze = self.stamp(), self.at, self.gaze
        z = depths(at, *gaze, self.fault != "empty", self.noise)
        if (at, gaze) != (self.at, self.gaze):  # blurred
            return
        mm = np.where((z > 0.4) & (z < 6.0), np.rint(z * 1000), 0).astype("<u2")
        image = Image(height=HIGH, width=WIDE, encoding="16UC1", step=2 * WIDE, data=mm.tobytes())
        info = CameraInfo(height=HIGH, width=WIDE, k=[FOCAL, 0.0, WIDE / 2 - 0.5, 0.0, FOCAL, HIGH / 2 - 0.5, 0.0, 0.0, 1.0])
        scan = LaserScan(angle_min=-1.5, angle_increment=0.02, range_min=0.1, range_max=8.0, ranges=[2.0] * 150)
        for message, frame in ((image, "camera"), (info, "camera"), (scan, "laser")):
            message.header.frame_id, message.header.stamp = frame, stamp
        self.info.publish(info)
        self.depth.publish(image)
        self.laser.publish(scan)

    def publish_map(self):
        n = round(2 * ROOM / CELL)
        grid = OccupancyGrid(data=[100 if abs(x) < TABLE[0] and abs(y) < TABLE[1] else 0 for y in self.middles(n) for x in self.middles(n)])
        grid.info.resolution, grid.info.width, grid.info.height = CELL, n, n
        grid.info.origin.position.x = grid.info.origin.position.y = -ROOM
        grid.info.origin.orientation.w = 1.0
        self.map.publish(grid)

    @staticmethod
    def middles(n):
        return [-ROOM + (k + 0.5) * CELL for k in range(n)]

    def look(self, message):
        self.gaze = tuple(message.points[-1].positions)

    def drive(self, handle):
        p, q = handle.request.pose.pose.position, handle.request.pose.pose.orientation
        goal, begin = (p.x, p.y, 2 * math.atan2(q.z, q.w)), self.at
        length = math.dist(begin[:2], goal[:2])
        stop = max(length - 1.5, 0.0) if self.fault == "short" else length
        steps = max(math.ceil(stop / SPEED / 0.02), 1)
        for k in range(1, steps + 1):
            if handle.is_cancel_requested:
                handle.canceled()
                return NavigateToPose.Result()
            share = k / steps * (stop / length if length > 0 else 1.0)
            self.at = (begin[0] + share * (goal[0] - begin[0]), begin[1] + share * (goal[1] - begin[1]), goal[2])
            handle.publish_feedback(NavigateToPose.Feedback(distance_remaining=length * (1 - share)))
            time.sleep(0.02)
        self.drives += 1
        time.sleep(0.1)
        handle.succeed()
        return NavigateToPose.Result()


if __name__ == "__main__":
    robot = Robot(sys.argv[1] if len(sys.argv) > 1 else "")
    executor = rclpy.executors.MultiThreadedExecutor()
    executor.add_node(robot.node)
    try:
        executor.spin()
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
