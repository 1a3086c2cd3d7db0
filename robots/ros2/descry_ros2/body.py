"""The body protocol over topics, tf and actions."""

import math
import os
import sys
import threading
import time

import descry_robot as descry
import numpy as np
import rclpy
from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, LaserScan
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from . import transforms as tf

SENSOR = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LATCHED_TF = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TF = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
# Cells of an occupancy grid from this on are taken for occupied; unknown ones are, too.
OCCUPIED = 50
# Seconds on the wall's clock without a tick of the robot's clock after which that stands still.
STANDSTILL_S = 3.0
# Seconds by which a stamp may be ahead of the robot's clock: more is another clock.
AHEAD_S = 1.0
POLL_S = 0.05


class Silent(Exception):
    """Something that the robot must publish was not heard."""


def stamp_ns(header):
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


class Body(descry.Robot):
    def __init__(self, settings):
        self.settings, self.latest, self.heard = settings, {}, threading.Condition()
        self.transforms, self.goal, self.last_ns = tf.Transforms(), None, 0
        rclpy.init(args=["--ros-args", *(["-p", "use_sim_time:=true"] if settings["simulated"] else [])])
        self.node = rclpy.create_node("descry_body")
        topics = settings["topics"]
        depth_type = CompressedImage if topics["depth"].endswith("compressedDepth") else Image
        self._hear("depth", depth_type, SENSOR)
        self._hear("camera_info", CameraInfo, SENSOR)
        self._hear("colour", Image, SENSOR)
        self._hear("scan", LaserScan, SENSOR)
        self._hear("map", OccupancyGrid, LATCHED)
        self._hear("localisation", PoseWithCovarianceStamped, TF)
        for topic, qos, is_fixed in (("/tf", TF, False), ("/tf_static", LATCHED_TF, True)):
            self.node.create_subscription(TFMessage, topic, lambda m, fixed=is_fixed: self._told(m, fixed), qos)
        self.navigation = ActionClient(self.node, NavigateToPose, settings["navigation"]["action"])
        self.hand_of(settings["hand"])
        head = settings["head"]
        self.neck = self.node.create_publisher(JointTrajectory, head["trajectory"], TF) if head else None
        self.executor = rclpy.executors.SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.spinning = threading.Thread(target=self._spin, daemon=True)
        self.spinning.start()

    def _spin(self):
        try:
            self.executor.spin()
        except rclpy.executors.ExternalShutdownException:
            pass

    def close(self):
        self.executor.shutdown()
        rclpy.try_shutdown()
        self.spinning.join(2.0)

    # What is heard.

    def _hear(self, name, kind, qos, topic=None):
        topic = topic or self.settings["topics"][name]
        if topic:
            self.node.create_subscription(kind, topic, lambda message: self._keep(name, message), qos)

    def _keep(self, name, message):
        with self.heard:
            self.latest[name] = message
            self.heard.notify_all()

    def _told(self, message, is_fixed):
        for t in message.transforms:
            p, q = t.transform.translation, t.transform.rotation
            transform = ((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))
            self.transforms.tell(t.header.frame_id, t.child_frame_id, stamp_ns(t.header), transform, is_fixed)

    def _first(self, name):
        """The newest message of a topic, waited for as long as a start may take."""
        wait_s = self.settings["waits"]["start_s"]
        with self.heard:
            if not self.heard.wait_for(lambda: name in self.latest, wait_s):
                raise Silent(f"nothing was published on {self.settings['topics'][name]} ({name}) within {wait_s:g} s")
            return self.latest[name]

    def _after(self, name, since_ns, request):
        """The first message that was stamped after a time."""
        wait_s, began = self.settings["waits"]["frame_s"], time.monotonic()
        while True:
            with self.heard:
                self.heard.wait(POLL_S)
                message = self.latest.get(name)
            if message is not None and stamp_ns(message.header) >= since_ns:
                ahead_s = (stamp_ns(message.header) - self.now_ns()) * 1e-9
                if ahead_s > AHEAD_S:
                    topic = self.settings["topics"][name]
                    raise descry.Failure("broken", f"{topic} is stamped {ahead_s:.1f} s ahead of the robot's clock: does `simulated` say which clock it is?")
                return message
            request.check()
            if time.monotonic() - began > wait_s:
                self._is_ticking()
                raise descry.Failure("sensor_dropped", f"nothing new on {self.settings['topics'][name]} for {wait_s:g} s", stamp_ns=since_ns)

    def _is_ticking(self):
        """`Failure` if the clock stands still."""
        before, until = self.node.get_clock().now().nanoseconds, time.monotonic() + STANDSTILL_S
        while self.node.get_clock().now().nanoseconds == before:
            if time.monotonic() > until:
                raise descry.Failure("broken", f"the robot's clock has stood still for {STANDSTILL_S:g} s")
            time.sleep(POLL_S)

    def now_ns(self):
        self.last_ns = max(self.last_ns, self.node.get_clock().now().nanoseconds)
        return self.last_ns

    # What the robot is.

    def hello(self):
        try:
            return self._hello()
        except (Silent, tf.Missing) as why:
            print(why, file=sys.stderr)
            self.close()
            os._exit(1)

    def _hello(self):
        s = self.settings
        frames, wait_s = s["frames"], s["waits"]["start_s"]
        info, first = self._first("camera_info"), self._first("depth")
        fx, fy, cx, cy = info.k[0], info.k[4], info.k[2], info.k[5]
        until = time.monotonic() + wait_s
        while True:
            try:
                camera, _ = self.transforms.newest(frames["base"], frames["camera"])
                self.transforms.newest(frames["map"], frames["base"])
                laser = self._laser(self._first("scan")) if s["topics"]["scan"] else None
                break
            except tf.Missing as why:
                if time.monotonic() > until:
                    raise Silent(f"{why}, within {wait_s:g} s") from None
                time.sleep(POLL_S)
        base = s["base"]
        round_ = base["radius_m"] is not None
        footprint = {"disc": {"radius_m": base["radius_m"]}} if round_ else {"polygon": {"corners_m": base["footprint_m"]}}
        hello = {
            "name": s["name"], "simulated": s["simulated"], "up": [0, 0, 1],
            "pose_sigma_m": s["localisation"]["sigma_m"], "pose_sigma_rad": s["localisation"]["sigma_rad"],
            "base": {"footprint": footprint, **{key: base[key] for key in ("linear_m_s", "angular_rad_s", "clearance_m")}},
            "camera": {"width": info.width, "height": info.height, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "frame": frames["camera"],
                       "range_m": s["camera"]["range_m"], "unit_m": self._unit_m(first), "colour": bool(s["topics"]["colour"])},
            "frames": {"map": frames["map"], "base": frames["base"]},
            "surfaces": s["surface"], "rooms": s["room"], "doors": s["door"],
        }
        if s["head"]:
            hello["head"] = {k: s["head"][k] for k in ("base_from_head", "pan_limit_rad", "tilt_down_rad", "tilt_up_rad")}
        else:
            hello["camera"]["base_from_camera"] = tf.said(camera)
        if s["hand"]:
            hello["arm"] = {"reach_m": s["hand"]["reach_m"], "hand_opening_m": s["hand"]["opening_m"]}
        if laser:
            hello["laser"] = laser
        grid = self._first("map")
        hello["map"], cells = self._map(grid)
        return hello, cells

    def _map(self, grid):
        info = grid.info
        turned = 2 * math.atan2(info.origin.orientation.z, info.origin.orientation.w)
        if abs(turned) > 1e-6:
            raise Silent(f"the map is turned by {turned:.3f} rad; one whose rows lie along x was expected")
        cells = np.asarray(grid.data, dtype=np.int16)
        occupied = ((cells < 0) | (cells >= OCCUPIED)).astype(np.uint8)
        origin = [info.origin.position.x, info.origin.position.y]
        return {"resolution_m": round(info.resolution, 6), "origin_m": origin, "width": info.width, "height": info.height}, occupied.tobytes()

    def _laser(self, scan):
        frame = self.settings["frames"]["laser"] or scan.header.frame_id
        at, _ = self.transforms.newest(self.settings["frames"]["base"], frame)
        first, step = (scan.angle_min, scan.angle_increment) if scan.angle_increment > 0 else (scan.angle_max, -scan.angle_increment)
        return {"base_from_laser": tf.said(at), "first_rad": first, "step_rad": step, "readings": len(scan.ranges), "reach_m": scan.range_max, "frame": frame}

    # What it is asked.

    def _base_at(self, at_ns=None):
        """Where the base is now, or was at a stamp; what is late is waited for as long again."""
        frames, waits = self.settings["frames"], self.settings["waits"]
        try:
            if at_ns is not None:
                return self.transforms.wait(frames["map"], frames["base"], at_ns, waits["transform_s"], time.monotonic)
            until = time.monotonic() + waits["late_s"]
            while True:
                here, stamp = self.transforms.newest(frames["map"], frames["base"])
                late_s = (self.now_ns() - stamp) * 1e-9
                if late_s <= waits["late_s"]:
                    return here
                if time.monotonic() > until:
                    raise tf.Missing(f"the newest transform from {frames['map']} to {frames['base']} is {late_s:.1f} s old")
                time.sleep(POLL_S)
        except tf.Missing as why:
            raise descry.Failure("lost", str(why)) from None

    def pose(self, request):
        answer = {"map_from_base": tf.said(self._base_at())}
        told = self.latest.get("localisation")
        if told is not None:
            c = np.asarray(told.pose.covariance).reshape(6, 6)
            worst = float(np.linalg.eigvalsh(c[:2, :2])[-1])
            answer.update(sigma_m=math.sqrt(max(worst, 0.0)), sigma_rad=math.sqrt(max(float(c[5, 5]), 0.0)))
        return answer

    def drive_to(self, request, to, route_m):
        wanted, navigation = to["pose"], self.settings["navigation"]
        self._is_ticking()
        goal = NavigateToPose.Goal()
        goal.pose.header.frame_id = self.settings["frames"]["map"]
        goal.pose.header.stamp = self.node.get_clock().now().to_msg()
        goal.pose.pose.position.x, goal.pose.pose.position.y = wanted["x_m"], wanted["y_m"]
        goal.pose.pose.orientation.z, goal.pose.pose.orientation.w = math.sin(wanted["yaw_rad"] / 2), math.cos(wanted["yaw_rad"] / 2)
        track = Track(self._base_at(), wanted)
        result = self._carried_out(self.navigation, navigation["action"], goal, request, lambda: track.on(self._base_at()))
        here = self._base_at(self.now_ns())
        track.on(here)
        off_m, off_rad = track.off(here)
        if result.status == GoalStatus.STATUS_CANCELED:
            raise descry.Failure("cancelled", f"somebody else cancelled the goal {off_m:.2f} m before it")
        if result.status != GoalStatus.STATUS_SUCCEEDED:
            why = getattr(result.result, "error_msg", "") or f"error {getattr(result.result, 'error_code', 'unknown')}"
            raise descry.Failure("blocked", f"{navigation['action']} gave up {off_m:.2f} m before the goal: {why}")
        if off_m > navigation["arrived_m"] or off_rad > navigation["arrived_rad"]:
            raise descry.Failure("blocked", f"{navigation['action']} says it has arrived, by tf it is {off_m:.2f} m and {off_rad:.2f} rad off")
        return {"distance_m": track.driven_m, "map_from_base": tf.said(here)}

    def _carried_out(self, client, name, goal, request, progress=None):
        """The result of an action's goal, stopped when the request is stopped."""
        if not client.wait_for_server(timeout_sec=2.0):
            raise descry.Failure("broken", f"nobody answers the action {name}")
        handle = self._until(client.send_goal_async(goal), request, None)
        if not handle.accepted:
            raise descry.Failure("blocked", f"{name} refused the goal")
        self.goal = handle
        result = self._until(handle.get_result_async(), request, progress)
        self.goal = None
        return result

    def _until(self, future, request, progress):
        """What comes of a future; says how far it is, and stops when the request is stopped or the clock stands still."""
        done, ticked, before = threading.Event(), time.monotonic(), self.now_ns()
        future.add_done_callback(lambda _: done.set())
        while not done.wait(POLL_S):
            if progress:
                request.feedback(*progress())
            else:
                request.check()
            if self.now_ns() != before:
                ticked, before = time.monotonic(), self.now_ns()
            elif time.monotonic() - ticked > STANDSTILL_S:
                raise descry.Failure("broken", f"the robot's clock has stood still for {STANDSTILL_S:g} s")
        return future.result()

    def stop(self):
        if self.goal is not None and rclpy.ok():
            cancelled = threading.Event()
            self.goal.cancel_goal_async().add_done_callback(lambda _: cancelled.set())
            cancelled.wait(0.4)
            self.goal = None

    def look_at(self, request, point_m):
        head, frames = self.settings["head"], self.settings["frames"]
        self._is_ticking()
        base = self._base_at()
        point = tf.chain(tf.inverse(base), (tuple(point_m), (0, 0, 0, 1)))[0]
        pan, tilt, _ = descry.aim(head, point)
        message = JointTrajectory(joint_names=[head["pan"], head["tilt"]])
        message.points = [JointTrajectoryPoint(positions=[pan, tilt], time_from_start=Duration(sec=1))]
        self.neck.publish(message)
        forward = descry.camera_axes(pan, tilt)[2]
        until = time.monotonic() + self.settings["waits"]["head_s"]
        while True:
            camera, _ = self.transforms.newest(frames["base"], frames["camera"])
            now = tf.turn(camera[1], (0, 0, 1))
            if angle(now, forward) < 0.02:
                break
            request.check()
            if time.monotonic() > until:
                raise descry.Failure("timed_out", f"the head is {angle(now, forward):.2f} rad from where it was told to look, by tf")
            time.sleep(POLL_S)
        line = [p - c for p, c in zip(point, camera[0])]
        return {"miss_rad": angle(now, line)}

    def sense(self, request):
        frames = self.settings["frames"]
        image = self._after("depth", request.began_ns, request)
        at_ns = stamp_ns(image.header)
        base = self._base_at(at_ns)
        try:
            camera = self.transforms.wait(frames["base"], frames["camera"], at_ns, self.settings["waits"]["transform_s"], time.monotonic)
        except tf.Missing as why:
            raise descry.Failure("lost", str(why)) from None
        data = self._depths(image).tobytes()
        if self.settings["topics"]["colour"]:
            data += rgb(self._after("colour", request.began_ns, request)).tobytes()
        return {"map_from_base": tf.said(base), "base_from_camera": tf.said(camera), "stamp_ns": at_ns}, data

    # The hand.

    def hand_of(self, hand):
        """Hears what the hand holds, and knows its actions; the package `descry_msgs` is needed with a hand alone."""
        if hand is None:
            return
        from descry_msgs.action import Grasp, Place
        from std_msgs.msg import Bool

        self.hand_actions = {kind: (action, ActionClient(self.node, action, hand[kind])) for kind, action in (("grasp", Grasp), ("place", Place))}
        self._hear("holding", Bool, LATCHED, hand["holding"])

    def _by_hand(self, kind, point, request, **more):
        """The result of one of the hand's actions at a point of the map."""
        action, client = self.hand_actions[kind]
        goal = action.Goal(**more)
        stamped = goal.object if kind == "grasp" else goal.foot
        stamped.header.frame_id, stamped.header.stamp = self.settings["frames"]["map"], self.node.get_clock().now().to_msg()
        stamped.point.x, stamped.point.y, stamped.point.z = (float(x) for x in point)
        self._is_ticking()
        done = self._carried_out(client, self.settings["hand"][kind], goal, request)
        if done.status == GoalStatus.STATUS_SUCCEEDED:
            return done.result
        result = done.result
        why = result.why or f"{self.settings['hand'][kind]} ended with status {done.status}"
        kinds = {result.UNREACHABLE: "unreachable", result.SLIPPED: "slipped", result.BLOCKED: "blocked", result.UNABLE: "unable"}
        failure = "cancelled" if done.status == GoalStatus.STATUS_CANCELED else kinds.get(result.failure, "blocked")
        raise descry.Failure(failure, why, **({"moved_m": 0.0} if failure == "slipped" else {}))

    def grasp(self, request, object, width_m):
        width_m = self._by_hand("grasp", object, request, width_m=float(width_m)).width_m
        if not self._holds(True):
            raise descry.Failure("slipped", f"{self.settings['hand']['grasp']} says that it has it, the hand holds nothing", moved_m=0.0)
        return {"width_m": width_m}

    def place(self, request, foot):
        self._by_hand("place", foot, request)
        return {}

    def hand(self, request):
        """Whether it holds something, as the robot publishes it."""
        holds = self._holds()
        if holds is None:
            topic = self.settings["hand"]["holding"]
            raise descry.Failure("sensor_dropped", f"nothing was published on {topic}", stamp_ns=self.now_ns())
        return {"holds": holds}

    def _holds(self, wanted=None):
        """What the hand is said to hold; what is wanted is waited for, since it may come after the end of an action."""
        told = lambda: "holding" in self.latest and wanted in (None, self.latest["holding"].data)
        with self.heard:
            self.heard.wait_for(told, self.settings["waits"]["frame_s"])
            return self.latest["holding"].data if "holding" in self.latest else None

    def _unit_m(self, image):
        """Metres of a step of depth: what the encoding says, if the file does not."""
        own = self.settings["camera"]["metres_per_unit"]
        return own if own else 0.001

    def _depths(self, image):
        """Depths as 16 bits in the unit of the hello; 0 where nothing returned."""
        if isinstance(image, CompressedImage):
            return compressed(image)
        encoding, order = image.encoding, ">" if image.is_bigendian else "<"
        kind = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}.get(encoding)
        if kind is None:
            raise descry.Failure("broken", f"depth is encoded as {encoding}; 16UC1 or 32FC1 was expected")
        width = np.dtype(kind).itemsize
        rows = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.step)[:, : image.width * width]
        values = np.ascontiguousarray(rows).view(np.dtype(order + kind))
        if kind == "f4":
            steps = np.nan_to_num(values / self._unit_m(image), nan=0.0, posinf=0.0, neginf=0.0)
            return np.where((steps > 0) & (steps < 65535), np.rint(steps), 0).astype("<u2")
        return values.astype("<u2")

    def scan(self, request):
        scan = self._after("scan", request.began_ns, request)
        base = self._base_at(stamp_ns(scan.header))
        ranges = np.asarray(scan.ranges, dtype="<f4")
        if scan.angle_increment < 0:
            ranges = ranges[::-1]
        ranges = np.where(np.isnan(ranges) | (ranges < scan.range_min), 0, np.where(ranges > scan.range_max, np.inf, ranges))
        return {"map_from_base": tf.said(base), "stamp_ns": stamp_ns(scan.header)}, ranges.astype("<f4").tobytes()


def angle(a, b):
    length = math.dist(a, (0, 0, 0)) * math.dist(b, (0, 0, 0))
    return math.acos(min(max(sum(p * q for p, q in zip(a, b)) / length, -1.0), 1.0)) if length > 0 else 0.0


def rgb(image):
    """Red, green, blue of a pixel, row by row."""
    channels = {"rgb8": (3, [0, 1, 2]), "bgr8": (3, [2, 1, 0]), "rgba8": (4, [0, 1, 2]), "bgra8": (4, [2, 1, 0])}.get(image.encoding)
    if channels is None:
        raise descry.Failure("broken", f"colour is encoded as {image.encoding}; rgb8 or bgr8 was expected")
    count, order = channels
    rows = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.step)[:, : image.width * count]
    return np.ascontiguousarray(rows.reshape(image.height, image.width, count)[:, :, order])


def compressed(image):
    """Depths of a compressedDepth message: 12 bytes of header, then a PNG of 16 bits, in millimetres."""
    if not image.format.startswith("16UC1"):
        raise descry.Failure("broken", f"depth is compressed as \"{image.format}\"; 16UC1 with PNG was expected")
    import cv2

    return cv2.imdecode(np.frombuffer(bytes(image.data)[12:], np.uint8), cv2.IMREAD_UNCHANGED).astype("<u2")


class Track:
    """How far a drive has got."""

    def __init__(self, began, wanted):
        self.last, self.wanted, self.driven_m, self.share = began, wanted, 0.0, 0.0
        self.whole_m = max(self.off(began)[0], 1e-3)

    def off(self, here):
        turned = (tf.yaw(here) - self.wanted["yaw_rad"] + math.pi) % (2 * math.pi) - math.pi
        return math.hypot(here[0][0] - self.wanted["x_m"], here[0][1] - self.wanted["y_m"]), abs(turned)

    def on(self, here):
        """The greatest share of the way that was behind, and the metres."""
        self.driven_m += math.dist(here[0][:2], self.last[0][:2])
        self.last, self.share = here, max(self.share, 1.0 - min(self.off(here)[0] / self.whole_m, 1.0))
        return self.share, self.driven_m
