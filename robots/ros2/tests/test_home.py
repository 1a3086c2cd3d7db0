"""The same home with and without ROS 2 between: the same verdicts.

A few worlds are a test; `python test_home.py 20` goes through twenty and prints them.
"""

import pathlib
import sys
import tempfile
import time

import pytest
from conftest import BODY, DESCRY, HERE, Robot, pursued

rclpy = pytest.importorskip("rclpy")
if not DESCRY:
    pytest.skip("DESCRY names no descry", allow_module_level=True)

GOALS = ("find cup A", "bring cup A to the desk", "is cup A on the table")


def both(seed, folder):
    """Goal, verdict without ROS, verdict with it, and what was said with it."""
    goal, home = GOALS[seed % len(GOALS)], ("--domain", "home", "--seed", "1")
    plain, _ = pursued(goal, folder / "plain", f"program:{sys.executable} {HERE / 'world.py'} {seed}", *home)
    with Robot(str(seed)):
        ros, said = pursued(goal, folder / "ros", f"{BODY} {HERE / 'home.toml'}", *home)
    return goal, plain, ros, said


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_verdicts_are_those_without_ros(tmp_path, seed):
    goal, plain, ros, said = both(seed, tmp_path)
    assert ros["verdict"] == plain["verdict"], f"{goal}: {plain}\n{ros}\n{said.stderr}"


def main(count):
    same = 0
    print("seed  goal                      without ROS    with ROS       seconds")
    for seed in range(1, count + 1):
        with tempfile.TemporaryDirectory() as folder:
            began = time.monotonic()
            goal, plain, ros, _ = both(seed, pathlib.Path(folder))
        same += plain["verdict"] == ros["verdict"]
        print(f"{seed:4}  {goal:24}  {plain['verdict']:13}  {ros['verdict']:13}  {time.monotonic() - began:7.1f}", flush=True)
    print(f"{same} of {count} verdicts are the same")
    return same == count


if __name__ == "__main__":
    sys.exit(0 if main(int(sys.argv[1])) else 1)
