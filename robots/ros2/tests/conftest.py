"""What the tests share: the environment of ROS, descry, and the fake robot for as long as a test asks it."""

import json
import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
DESCRY = os.environ.get("DESCRY") or shutil.which("descry")
# Tests that go on at the same time hear nothing of each other, nor of a robot in the house.
os.environ.update(ROS_DOMAIN_ID=str(1 + os.getpid() % 100), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
VENV = os.path.dirname(os.path.dirname(sys.executable))
ENVIRONMENT = {
    **os.environ,
    "AMENT_PREFIX_PATH": os.environ.get("AMENT_PREFIX_PATH", VENV),
    "LD_LIBRARY_PATH": f"{VENV}/lib:{os.environ.get('LD_LIBRARY_PATH', '')}",
    "PYTHONPATH": f"{HERE.parent}:{HERE.parents[1] / 'python'}",
}
# A program of descry gets little of the environment.
SOURCED = " ".join(f"{key}={ENVIRONMENT[key]}" for key in ("AMENT_PREFIX_PATH", "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE"))
BODY = f"program:{SOURCED} {sys.executable} -m descry_ros2"


class Robot:
    """The fake robot, with a fault or the seed of its world."""

    def __init__(self, word):
        self.word = word

    def __enter__(self):
        command = [sys.executable, str(HERE / "fake_robot.py"), *([self.word] if self.word else [])]
        self.process = subprocess.Popen(command, env=ENVIRONMENT)
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def descry(*arguments, timeout=170):
    return subprocess.run([DESCRY, *arguments], env=ENVIRONMENT, capture_output=True, text=True, timeout=timeout)


def pursued(goal, run, robot, *options):
    """The report of a goal, and all that was said."""
    said = descry("do", goal, "--run", str(run), "--json", "--robot", robot, *options)
    assert said.stdout, said.stderr
    return json.loads(said.stdout), said
