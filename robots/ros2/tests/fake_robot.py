"""The world of `world.py` behind real ROS 2 topics, tf and actions, in a process of its own: camera on a pan-tilt head, laser,
navigation and hand.

`fake_robot.py [SEED | FAULT]`: the seed of the world; or `short` (navigation calls goals reached that are 1.5 m off), `lagging` (tf stops
after the first drive), `dead` (the camera falls silent after it), `paused` (the clock stands still after it), `empty` (there is no cup).
"""

import math
import sys
import threading
import time

import rclpy
from descry_msgs.action import Grasp, Place
from geometry_msgs.msg import TransformStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from world import CELL, FOCAL, HEAD, HIGH, ROOM, WIDE, World
from world import descry as geometry

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


class Robot:
    def __init__(self, word):
        fault = "" if word.isdigit() else word
        self.world = World(int(word)) if word.isdigit() else World(has_cup=fault != "empty")
        self.fault, self.drives, self.began, self.stamping = fault, 0, time.monotonic(), threading.Lock()
        rclpy.init(args=["--ros-args", "-p", f"use_sim_time:={str(fault == 'paused').lower()}"])
        self.node = n = rclpy.create_node("fake_robot")
        self.depth, self.info = n.create_publisher(Image, "camera/depth", SENSOR), n.create_publisher(CameraInfo, "camera/info", SENSOR)
        self.laser, self.clock = n.create_publisher(LaserScan, "scan", SENSOR), n.create_publisher(Clock, "/clock", 10)
        self.tf, self.fixed = n.create_publisher(TFMessage, "/tf", 100), n.create_publisher(TFMessage, "/tf_static", LATCHED)
        self.map = n.create_publisher(OccupancyGrid, "map", LATCHED)
        group = ReentrantCallbackGroup()
        n.create_subscription(JointTrajectory, "head/trajectory", self.look, 10, callback_group=group)
        ActionServer(n, NavigateToPose, "navigate_to_pose", self.drive, callback_group=group, cancel_callback=lambda _: CancelResponse.ACCEPT)
        ActionServer(n, Grasp, "hand/grasp", self.grasp, callback_group=group)
        ActionServer(n, Place, "hand/place", self.place, callback_group=group)
        self.holding = n.create_publisher(Bool, "hand/holding", LATCHED)
        self.holding.publish(Bool(data=False))
        self.publish_map()
        self.fixed.publish(TFMessage(transforms=[self.transform("base_link", "laser", geometry.planar(0, 0, 0), self.stamp())]))
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

    def transform(self, parent, child, pose, stamp):
        t = TransformStamped(child_frame_id=child)
        t.header.frame_id, t.header.stamp = parent, stamp
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
        with self.stamping:
            self.publish_frames(self.world.at, self.world.gaze, self.stamp())

    def publish_frames(self, at, gaze, stamp):
        if self.is_on("lagging"):
            return
        frames = [("map", "odom", geometry.planar(0, 0, 0)), ("odom", "base_link", geometry.planar(*at))]
        frames += [("base_link", "camera", geometry.base_from_camera(HEAD, *gaze))]
        self.tf.publish(TFMessage(transforms=[self.transform(*frame, stamp) for frame in frames]))

    def publish_sensors(self):
        if self.is_on("dead"):
            return
        frame = self.world.frame()
        if frame is None:  # blurred
            return
        at, gaze, millimetres = frame
        image = Image(height=HIGH, width=WIDE, encoding="16UC1", step=2 * WIDE, data=millimetres.tobytes())
        info = CameraInfo(height=HIGH, width=WIDE, k=[FOCAL, 0.0, WIDE / 2 - 0.5, 0.0, FOCAL, HIGH / 2 - 0.5, 0.0, 0.0, 1.0])
        scan = LaserScan(angle_min=-1.5, angle_increment=0.02, range_min=0.1, range_max=8.0, ranges=[2.0] * 150)
        with self.stamping:
            stamp = self.stamp()
            if (at, gaze) != (self.world.at, self.world.gaze):
                return
            self.publish_frames(at, gaze, stamp)
        for message, frame in ((image, "camera"), (info, "camera"), (scan, "laser")):
            message.header.frame_id, message.header.stamp = frame, stamp
        self.info.publish(info)
        self.depth.publish(image)
        self.laser.publish(scan)

    def publish_map(self):
        n = round(2 * ROOM / CELL)
        grid = OccupancyGrid(data=[100 * cell for cell in self.world.occupied()])
        grid.info.resolution, grid.info.width, grid.info.height = CELL, n, n
        grid.info.origin.position.x = grid.info.origin.position.y = -ROOM
        grid.info.origin.orientation.w = 1.0
        self.map.publish(grid)

    def look(self, message):
        self.world.gaze = tuple(message.points[-1].positions)

    def drive(self, handle):
        p, q = handle.request.pose.pose.position, handle.request.pose.pose.orientation
        goal = (p.x, p.y, 2 * math.atan2(q.z, q.w))
        length = math.dist(self.world.at[:2], goal[:2])
        upto = max(length - 1.5, 0.0) / length if self.fault == "short" and length > 0 else 1.0
        for share, _ in self.world.drive(goal, upto, lambda: handle.is_cancel_requested):
            handle.publish_feedback(NavigateToPose.Feedback(distance_remaining=length * (1 - share)))
        if handle.is_cancel_requested:
            handle.canceled()
            return NavigateToPose.Result()
        self.drives += 1
        time.sleep(0.1)
        handle.succeed()
        return NavigateToPose.Result()

    def grasp(self, handle):
        p = handle.request.object.point
        if not self.world.reaches((p.x, p.y)):
            handle.abort()
            return Grasp.Result(failure=Grasp.Result.UNREACHABLE, why="it is out of reach")
        width_m = self.world.grasp((p.x, p.y, p.z))
        if width_m is None:
            handle.abort()
            return Grasp.Result(failure=Grasp.Result.SLIPPED, why="the hand closed on nothing")
        self.holding.publish(Bool(data=True))
        handle.succeed()
        return Grasp.Result(width_m=width_m)

    def place(self, handle):
        p = handle.request.foot.point
        if not self.world.reaches((p.x, p.y)):
            handle.abort()
            return Place.Result(failure=Place.Result.UNREACHABLE, why="it is out of reach")
        self.world.place((p.x, p.y, p.z))
        self.holding.publish(Bool(data=False))
        handle.succeed()
        return Place.Result()


if __name__ == "__main__":
    robot = Robot(sys.argv[1] if len(sys.argv) > 1 else "")
    executor = rclpy.executors.MultiThreadedExecutor()
    executor.add_node(robot.node)
    try:
        executor.spin()
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
