"""The template robot with the camera of a Kinect, whose frames are always the same: what the protocol costs, and nothing else."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "python"))
import descry_robot as descry  # noqa: E402
from template import Template  # noqa: E402

WIDTH, HEIGHT = 640, 480
FRAME = (1500).to_bytes(2, "little") * (WIDTH * HEIGHT)


class Frames(Template):
    def hello(self):
        hello, cells = super().hello()
        hello["camera"].update(width=WIDTH, height=HEIGHT, fx=570, fy=570, cx=319.5, cy=239.5)
        return hello, cells

    def depths_mm(self):
        return ()

    def sense(self, request):
        chain, _ = super().sense(request)
        return chain, FRAME


descry.serve(Frames(), *sys.argv[1:])
