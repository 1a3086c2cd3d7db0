"""The template robot, but for one thing that a program must not do: `python3 rogue.py WHAT [SOCKET]`."""

import array
import json
import os
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "python"))
import descry_robot as descry  # noqa: E402
from template import Template  # noqa: E402

WHAT = sys.argv[1]


def raw(data):
    view = memoryview(data)
    while view:
        view = view[os.write(OUT, view) :]


def wired(wire, read_fd, write_fd, plain=descry.Wire.__init__):
    global OUT
    OUT = write_fd
    plain(wire, read_fd, write_fd)


descry.Wire.__init__ = wired


def last_words(text, code):
    print(text, file=sys.stderr, flush=True)
    os._exit(code)


class Rogue(Template):
    def hello(self):
        hello, cells = super().hello()
        if WHAT == "no map":
            del hello["map"]
            return hello
        if WHAT == "short map":
            cells = cells[1:]
        if WHAT == "unknown part":
            hello["camra"] = {}
        if WHAT == "no focal length":
            hello["camera"]["fx"] = 0
        if WHAT in ("bare", "two cameras"):
            hello["camera"]["base_from_camera"] = descry.base_from_camera(hello["head"], 0.1, 0.4)
        if WHAT == "bare":
            del hello["head"], hello["laser"]
        if WHAT in ("no camera", "only a head"):
            del hello["camera"]
        if WHAT == "no camera":
            del hello["head"]
        if WHAT in ("bolted down", "nowhere"):
            del hello["base"]
        if WHAT == "bolted down":
            hello["stations"] = [{"name": "its place", "map_from_base": descry.planar(*self.at)}]
        if WHAT in ("reads labels", "reads tomorrow"):
            hello["senses"] = [{"name": "label reader", "about": "the text of a label, or null"}]
        if WHAT == "laser beyond a turn":
            hello["laser"] = dict(hello["laser"], readings=1000)
        if WHAT == "hardly drives":
            hello["base"]["linear_m_s"] = 1e-9
        if WHAT == "hardly turns":
            hello["base"]["angular_rad_s"] = 1e-300
        if WHAT == "keeps away from everything":
            hello["base"]["clearance_m"] = 1e300
        if WHAT == "a map of dust":
            hello["map"]["resolution_m"] = 1e-300
        if WHAT == "two tables of one name":
            hello["surfaces"] *= 2
        if WHAT == "a table in millimetres":
            corners = hello["surfaces"][0]["outline_m"]
            hello["surfaces"][0]["outline_m"] = [[1000 * x, 1000 * y] for x, y in corners]
        corners = [[-2.5, -2.5], [2.5, -2.5], [2.5, 2.5], [-2.5, 2.5]]
        hall = {"name": "hall", "outline_m": corners}
        door = {"name": "way", "centre_m": [0, 2.5], "along_rad": 0, "width_m": 0.9, "between": ["hall", "yard"]}
        if WHAT == "a door in millimetres":
            hello["rooms"], hello["doors"] = [hall, dict(hall, name="yard")], [dict(door, width_m=900)]
        if WHAT == "a door to nowhere":
            hello["rooms"], hello["doors"] = [hall], [door]
        if WHAT == "a table nowhere":
            hello["surfaces"][0]["room"] = "hal"
        if WHAT == "a heading in degrees":
            hello["pose_sigma_rad"] = 2.0
        if WHAT == "a head in millimetres":
            hello["head"] = dict(hello["head"], base_from_head=[0, 0, 1400])
        return hello, cells

    def drive_to(self, request, to, route_m):
        said = {"id": request.id, "now_ns": self.now_ns()}
        if WHAT == "hangs":
            time.sleep(1000)
        if WHAT == "silent":
            while True:
                request.check()
                time.sleep(0.01)
        if WHAT == "goes on":
            while True:
                raw(json.dumps({**said, "feedback": {"fraction": 0.5}}).encode() + b"\n")
                time.sleep(0.01)
        if WHAT == "dies":
            last_words("the motors are gone", 7)
        if WHAT == "leaves a child":
            child = subprocess.Popen(["sleep", "1000"])
            last_words(f"child {child.pid}", 1)
        if WHAT == "endless line":
            while True:
                raw(b"x" * 65536)
        if WHAT == "endless feedback":
            while True:
                raw((json.dumps({**said, "feedback": {"fraction": 0.5}}).encode() + b"\n") * 1000)
        if WHAT == "huge frame":
            raw(json.dumps({**said, "done": {}, "bytes": 1 << 40}).encode() + b"\n")
        if WHAT == "stops by itself":
            raise descry.Failure("cancelled", "the emergency stop was pressed")
        if WHAT == "late":
            self.clock_s += 1000.0
            return {"distance_m": 1.0, "map_from_base": descry.planar(*self.at)}
        if WHAT == "past its end":
            raw(json.dumps({**said, "feedback": {"fraction": 1.5}}).encode() + b"\n")
        if WHAT == "clock goes back":
            self.clock_s -= 100.0
        if WHAT == "eats memory":
            hold = bytearray(1 << 31)
            raise descry.Failure("unable", f"holds {len(hold)} bytes")
        return super().drive_to(request, to, route_m)

    def look_at(self, request, point_m):
        if WHAT == "bare":
            last_words("nobody may ask a head that is not there", 9)
        return super().look_at(request, point_m)

    def pose(self, request):
        if WHAT == "bolted down":
            return {"map_from_base": descry.planar(*self.at), "station": "its place"}
        if WHAT == "another request":
            raw(json.dumps({"id": request.id + 5, "now_ns": self.now_ns(), "done": {}}).encode() + b"\n")
        if WHAT == "answers twice" and request.id > 1:
            raw(json.dumps({"id": request.id - 1, "now_ns": self.now_ns(), "done": super().pose(request)}).encode() + b"\n")
        if WHAT == "no pose":
            return {}
        if WHAT == "no number":
            raw(b'{"id": 1, "now_ns": 0, "done": {"map_from_base": {"translation": [NaN, 0, 0], "rotation": [0, 0, 0, 1]}}}\n')
        if WHAT == "no rotation":
            return {"map_from_base": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 2]}}
        if WHAT == "talks on standard error":
            for _ in range(2000):
                print("x" * 10000, file=sys.stderr)
        if WHAT == "looks for secrets" and "CARGO_MANIFEST_DIR" in os.environ:
            raise descry.Failure("lost", "the environment is here")
        return super().pose(request)

    def sense(self, request):
        if WHAT == "bare":
            self.gaze = 0.1, 0.4
        chain, depths = super().sense(request)
        if WHAT == "short frame":
            return chain, depths[2:]
        if WHAT == "frame of tomorrow":
            return dict(chain, stamp_ns=self.now_ns() + 1), depths
        if WHAT == "depth reads long":
            return chain, array.array("H", (round(1.06 * depth) for depth in array.array("H", depths))).tobytes()
        return chain, depths

    def read(self, request, sense):
        if WHAT == "reads tomorrow":
            return {"said": None, "stamp_ns": self.now_ns() + 1}
        self.clock_s += 0.2
        return {"said": {"by": sense, "text": "TEA"}}

    def scan(self, request):
        chain, ranges = super().scan(request)
        if WHAT == "short sweep":
            return chain, ranges[4:]
        if WHAT == "sweep of yesterday":
            return dict(chain, stamp_ns=-1), ranges
        return chain, ranges


if WHAT == "no hello":
    time.sleep(1000)
if WHAT == "dies at once":
    last_words("no camera was found", 3)
if WHAT == "chatters":
    print("my robot 1.0", flush=True)
if WHAT == "another version":
    descry.PROTOCOL = 2
descry.serve(Rogue(), *sys.argv[2:])
