"""descry and a ROS 2 robot, each in a process of its own, over real rclpy and DDS.

    tests/venv.sh /tmp/ros && DESCRY=target/release/descry /tmp/ros/bin/python -m pytest robots/ros2/tests
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

import pytest

HERE = pathlib.Path(__file__).resolve().parent
DESCRY = os.environ.get("DESCRY") or shutil.which("descry")
rclpy = pytest.importorskip("rclpy")
if not DESCRY:
    pytest.skip("DESCRY names no descry", allow_module_level=True)

VENV = os.path.dirname(os.path.dirname(sys.executable))
ENVIRONMENT = {
    **os.environ,
    "AMENT_PREFIX_PATH": os.environ.get("AMENT_PREFIX_PATH", VENV),
    "LD_LIBRARY_PATH": f"{VENV}/lib:{os.environ.get('LD_LIBRARY_PATH', '')}",
    "PYTHONPATH": f"{HERE.parent}:{HERE.parents[1] / 'python'}",
}
BODY = f"program:AMENT_PREFIX_PATH={ENVIRONMENT['AMENT_PREFIX_PATH']} {sys.executable} -m descry_ros2"


class Robot:
    """The fake robot, for as long as a test asks it."""

    def __init__(self, fault):
        self.fault = fault

    def __enter__(self):
        command = [sys.executable, str(HERE / "fake_robot.py"), *([self.fault] if self.fault else [])]
        self.process = subprocess.Popen(command, env=ENVIRONMENT)
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def descry(*arguments, timeout=170):
    return subprocess.run([DESCRY, *arguments], env=ENVIRONMENT, capture_output=True, text=True, timeout=timeout)


def found(tmp_path, fault="", goal="cup A", more=""):
    settings = (HERE / "robot.toml").read_text().replace('name = "fake robot"', f'name = "fake robot"\n{more}')
    (tmp_path / "robot.toml").write_text(settings)
    with Robot(fault):
        said = descry("find", goal, "--run", str(tmp_path / "run"), "--json", "--robot", f"{BODY} {tmp_path / 'robot.toml'}")
    return json.loads(said.stdout), said


def test_it_keeps_the_promises_of_bodies():
    with Robot(""):
        said = descry("robot", "check", f"{BODY} {HERE / 'robot.toml'}")
    assert said.returncode == 0, said.stdout + said.stderr


@pytest.mark.parametrize("fault, verdict", [("", "achieved"), ("empty", "not_found")])
def test_what_is_there_is_found_and_what_is_not_is_not(tmp_path, fault, verdict):
    result, said = found(tmp_path, fault)
    assert result["verdict"] == verdict, said.stderr
    if verdict == "achieved":
        x, y, _ = result["position_m"]
        assert abs(x - 0.1) < 0.02 and abs(y + 0.05) < 0.02, result


@pytest.mark.parametrize(
    "fault, more, because",
    [
        ("short", "", "says it has arrived, by tf it is 1.50 m"),
        ("lagging", "", "transform"),
        ("dead", "", "nothing new on camera/depth"),
        ("paused", "simulated = true", "clock has stood still"),
    ],
)
def test_what_fails_is_told_and_nothing_is_made_up(tmp_path, fault, more, because):
    result, said = found(tmp_path, fault, "cup A within 20 seconds" if fault == "dead" else "cup A", more)
    assert because in said.stderr + str(result), said.stderr
    # Where navigation alone is wrong the robot still gets to see the cup; where nothing can be seen, nothing is said of it.
    assert result["verdict"] == "achieved" if fault == "short" else result["verdict"] in ("cannot_tell", "failed"), said.stderr


def test_a_wrong_file_is_told_with_what_was_expected(tmp_path):
    wrong = tmp_path / "robot.toml"
    wrong.write_text((HERE / "robot.toml").read_text().replace("[head]", "[haed]"))
    said = subprocess.run([sys.executable, "-m", "descry_ros2", str(wrong)], env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
    assert said.returncode != 0 and "there is no key `haed`" in said.stderr, said.stderr


def test_others_have_it_pursue_goals_and_cancel_them(tmp_path):
    from descry_msgs.action import Pursue
    from rclpy.action import ActionClient

    command = [sys.executable, "-m", "descry_ros2", "pursue", DESCRY, "--", "--seed", "1", "--robot", f"{BODY} {HERE / 'robot.toml'}"]
    rclpy.init()
    node = rclpy.create_node("asker")

    def wait(future, seconds):
        rclpy.spin_until_future_complete(node, future, timeout_sec=seconds)
        assert future.done(), f"nothing within {seconds} s"
        return future.result()

    steps = []
    with Robot(""), subprocess.Popen(command, env=ENVIRONMENT, cwd=tmp_path) as server:
        try:
            client = ActionClient(node, Pursue, "pursue")
            assert client.wait_for_server(timeout_sec=30)
            goal = wait(client.send_goal_async(Pursue.Goal(goal="find cup A"), feedback_callback=lambda m: steps.append(m.feedback.step)), 10)
            result = wait(goal.get_result_async(), 60).result
            assert (result.verdict, result.found) == ("achieved", True), result
            assert abs(result.place.pose.position.x - 0.1) < 0.02 and result.place.header.frame_id == "map"
            assert os.path.isdir(os.path.join(tmp_path, result.evidence)) and any("observe" in step for step in steps), steps
            goal = wait(client.send_goal_async(Pursue.Goal(goal="identify all objects on the table")), 10)
            time.sleep(1.0)
            wait(goal.cancel_goal_async(), 10)
            assert wait(goal.get_result_async(), 30).status == 5  # cancelled
        finally:
            server.terminate()
            node.destroy_node()
            rclpy.try_shutdown()
