"""A robot for descry in Python: subclass `Robot`, call `serve`. Python 3.8 or newer, nothing else.

    python3 my_robot.py              # serve(robot): over standard input and output, --robot "program:python3 my_robot.py"
                                     # serve(robot, "/tmp/robot"): over a socket, --robot socket:/tmp/robot

The protocol is `robots/PROTOCOL.md`. Frames: map (the room, z up), base (x forward), camera (optical: x right, y down, z forward).
A transform is `{"translation": [x, y, z], "rotation": [x, y, z, w]}`; its name says `parent_from_child`.
"""

import json
import math
import os
import select
import socket
import struct
import sys

PROTOCOL = 1


class Failure(Exception):
    """A request that did not work, by kind: unreachable, blocked, timed_out, cancelled, sensor_dropped, lost, slipped, unable, broken.

    More of it than the reason comes by name: `Failure("slipped", "the cup rolled away", moved_m=0.02)`.
    """

    def __init__(self, kind, because, **more):
        super().__init__(f"{kind}: {because}")
        self.said = {kind: {"because": because, **more}}


class Robot:
    """A body. Every method may raise `Failure`; those that take time call `request.feedback` as they go."""

    def hello(self):
        """What the body is: the fields of the hello without `protocol`; and the cells of the map, one byte each, if it has one."""
        raise NotImplementedError

    def now_ns(self):
        """The body's clock. It may not go back; it moves while the body does, and a frame takes time."""
        raise NotImplementedError

    def pose(self, request):
        """`{"map_from_base": transform}`, and `"station": name` if the body has stations."""
        raise NotImplementedError

    def drive_to(self, request, to, route_m):
        """To `{"pose": {x_m, y_m, yaw_rad}}` or `{"station": name}`; `route_m` is a way on the map, empty without one.

        `{"distance_m": driven, "map_from_base": transform}`.
        """
        raise NotImplementedError

    def look_at(self, request, point_m):
        """Turns the head towards a point in the map: `{"miss_rad": angle}`."""
        raise NotImplementedError

    def sense(self, request):
        """`{"map_from_base": transform, "base_from_camera": transform}` and the bytes of the frame."""
        raise NotImplementedError

    def scan(self, request):
        """`{"map_from_base": transform}` and the bytes of the ranges: `ranges(metres)`."""
        raise Failure("unable", "there is no laser")

    def read(self, request, sense):
        """`{"said": anything that JSON can say}`: what the sense of that name says now."""
        raise Failure("unable", f"there is no sense {sense}")

    def push_aside(self, request, object, direction, distance_m):
        """`{"moved_m": distance}`."""
        raise Failure("unable", "there is no arm")

    def open_door(self, request, door):
        """`{}`."""
        raise Failure("unable", "doors are beyond it")

    def grasp(self, request, object, width_m):
        """`{"width_m": how wide the hand is closed}`."""
        raise Failure("unable", "there is no hand")

    def place(self, request, foot):
        """`{}`."""
        raise Failure("unable", "there is no hand")

    def pour(self, request, over):
        """`{"litres": how much went over}`: all that the held vessel holds."""
        raise Failure("unable", "pouring is beyond it")

    def hand(self, request):
        """`{"holds": true or false}`."""
        raise Failure("unable", "there is no hand")

    def stop(self):
        """Comes to a halt at once: called when a request was stopped and when nobody is left to ask."""


REQUESTS = ("pose", "drive_to", "look_at", "sense", "scan", "read", "push_aside", "open_door", "grasp", "place", "pour", "hand")


class Request:
    """A request that is being carried out."""

    def __init__(self, wire, robot, id, time_limit_s):
        self._wire, self._robot, self.id, self.time_limit_s = wire, robot, id, time_limit_s
        self.began_ns = robot.now_ns()

    def elapsed_s(self):
        """On the body's clock."""
        return (self._robot.now_ns() - self.began_ns) * 1e-9

    def feedback(self, fraction, distance_m=0.0):
        """Says how far it has got (0 to 1), and raises `Failure` if it must stop now."""
        said = {"fraction": min(max(fraction, 0.0), 1.0), "distance_m": distance_m}
        self._wire.say({"id": self.id, "now_ns": self._robot.now_ns(), "feedback": said})
        self.check()

    def check(self):
        """Raises `Failure` if somebody stopped the request or its time is up."""
        while self._wire.waiting():
            message = self._wire.hear()
            if message is None:
                raise Failure("cancelled", "nobody is left to ask")
            if message.get("cancel") == self.id:
                raise Failure("cancelled", f"stopped after {self.elapsed_s():.1f} s")
        self.check_time()

    def check_time(self):
        """Raises `Failure` if its time is up."""
        if self.elapsed_s() > self.time_limit_s:
            raise Failure("timed_out", f"not done within {self.time_limit_s:g} s")


class Wire:
    """One JSON line a message, and raw bytes after it where it says so."""

    def __init__(self, read_fd, write_fd):
        self._in, self._out, self._rest, self._closed = read_fd, write_fd, b"", False

    def waiting(self):
        """Whether something can be heard at once."""
        return self._closed or b"\n" in self._rest or bool(select.select([self._in], [], [], 0.0)[0])

    def hear(self):
        """The next message; None at the end."""
        while b"\n" not in self._rest:
            chunk = b"" if self._closed else os.read(self._in, 1 << 16)
            if not chunk:
                self._closed = True
                return None
            self._rest += chunk
        line, self._rest = self._rest.split(b"\n", 1)
        return json.loads(line)

    def say(self, message, data=b""):
        if data:
            message = dict(message, bytes=len(data))
        view = memoryview(json.dumps(message, allow_nan=False).encode() + b"\n")
        for part in (view, memoryview(data)):
            while part:
                part = part[os.write(self._out, part) :]


def serve(robot, listen=None):
    """Answers until nobody asks any more: over standard input and output, or to whoever connects to `listen`, one after the other.

    `listen` is "HOST:PORT", or the path of a Unix socket; both ends trust each other, so take one that others cannot reach.
    """
    if not listen:
        return _answer(robot, Wire(*_standard()))
    server = _listen(listen)
    while True:
        connection, _ = server.accept()
        answer(robot, connection)


def answer(robot, connection):
    """Answers over a connected socket until the other end closes it."""
    if connection.family != socket.AF_UNIX:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # a request is a line that is waited for
    try:
        _answer(robot, Wire(connection.fileno(), connection.fileno()))
    except OSError as error:  # who asked is gone; the next one may come
        print(f"the connection broke: {error}", file=sys.stderr)
    connection.close()


def _answer(robot, wire):
    hello = robot.hello()
    hello, cells = hello if isinstance(hello, tuple) else (hello, b"")
    wire.say({"hello": dict(hello, protocol=PROTOCOL, now_ns=robot.now_ns())}, bytes(cells))
    try:
        while True:
            message = wire.hear()
            if message is None:
                return
            if "request" in message:
                _carry_out(wire, robot, message)
    finally:
        robot.stop()


def _carry_out(wire, robot, message):
    request = Request(wire, robot, message["id"], message["time_limit_s"])
    wire.say({"id": request.id, "now_ns": robot.now_ns(), "accepted": {}})
    data = b""
    try:
        name = message["request"]
        if name not in REQUESTS:
            raise Failure("unable", f"{name} is not known here")
        done = getattr(robot, name)(request, **message["with"])
        done, data = done if isinstance(done, tuple) else (done, b"")
        answer = {"done": done}
    except Failure as failure:
        robot.stop()
        answer = {"failed": failure.said}
    wire.say(dict(answer, id=request.id, now_ns=robot.now_ns()), data)


def _standard():
    """Standard input and output; what a library prints goes to standard error from now on."""
    out = os.dup(1)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    return 0, out


def _listen(listen):
    host, _, port = listen.rpartition(":")
    if port.isdigit() and "/" not in listen:
        return socket.create_server((host or "127.0.0.1", int(port)))
    server = socket.socket(socket.AF_UNIX)
    try:
        server.bind(listen)
    except OSError:  # what an earlier robot left behind, if nobody answers there
        if socket.socket(socket.AF_UNIX).connect_ex(listen) == 0:
            raise
        os.unlink(listen)
        server.bind(listen)
    server.listen()
    return server


def ranges(metres):
    """The bytes of a sweep: a float each, `inf` where nothing is within reach, 0 where there is no reading."""
    return struct.pack(f"<{len(metres)}f", *metres)


# Geometry in a few lines: poses on the floor and the pan-tilt head as descry reckons with it.


def planar(x_m, y_m, yaw_rad):
    """The transform of a pose on the floor."""
    return {"translation": [x_m, y_m, 0.0], "rotation": [0.0, 0.0, math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad)]}


def into_base(pose, point):
    """A point of the map in the frame of a base at (x, y, yaw)."""
    dx, dy = point[0] - pose[0], point[1] - pose[1]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return [c * dx + s * dy, c * dy - s * dx, point[2]]


def aim(head, point):
    """Pan and tilt (down) towards a point in the base frame within the head's limits, and by what angle they miss it."""
    line = [p - h for p, h in zip(point, head["base_from_head"])]
    length = math.sqrt(sum(x * x for x in line))
    if length < 1e-9:
        return 0.0, 0.0, 0.0
    wanted = math.atan2(line[1], line[0]), math.atan2(-line[2], math.hypot(line[0], line[1]))
    pan = min(max(wanted[0], -head["pan_limit_rad"]), head["pan_limit_rad"])
    tilt = min(max(wanted[1], -head["tilt_up_rad"]), head["tilt_down_rad"])
    if (pan, tilt) == wanted:
        return pan, tilt, 0.0
    along = [math.cos(tilt) * math.cos(pan), math.cos(tilt) * math.sin(pan), -math.sin(tilt)]
    cosine = sum(a * b for a, b in zip(along, line)) / length
    return pan, tilt, math.acos(min(max(cosine, -1.0), 1.0))


def camera_axes(pan, tilt):
    """Right, down and forward of the camera, in the base frame."""
    forward = [math.cos(tilt) * math.cos(pan), math.cos(tilt) * math.sin(pan), -math.sin(tilt)]
    right = [math.sin(pan), -math.cos(pan), 0.0]
    down = [-math.sin(tilt) * math.cos(pan), -math.sin(tilt) * math.sin(pan), -math.cos(tilt)]
    return right, down, forward


def base_from_camera(head, pan, tilt):
    """The transform of the camera's optical frame in the base frame."""
    # First the optical axes of a camera that looks along x, then tilt about y, then pan about z.
    level = (-0.5, 0.5, -0.5, 0.5)
    tilted = _times((0.0, math.sin(0.5 * tilt), 0.0, math.cos(0.5 * tilt)), level)
    turned = _times((0.0, 0.0, math.sin(0.5 * pan), math.cos(0.5 * pan)), tilted)
    return {"translation": list(head["base_from_head"]), "rotation": list(turned)}


def _times(a, b):
    """The product of two quaternions (x, y, z, w)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
