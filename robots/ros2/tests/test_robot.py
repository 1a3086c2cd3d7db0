"""descry and a ROS 2 robot, each in a process of its own, over real rclpy and DDS.

    tests/venv.sh /tmp/ros && DESCRY=target/release/descry /tmp/ros/bin/python -m pytest robots/ros2/tests
"""

import os
import subprocess
import sys
import time

import pytest
from conftest import BODY, DESCRY, ENVIRONMENT, HERE, Robot, descry, pursued

rclpy = pytest.importorskip("rclpy")
if not DESCRY:
    pytest.skip("DESCRY names no descry", allow_module_level=True)


def found(tmp_path, fault="", goal="cup A", more=""):
    settings = (HERE / "robot.toml").read_text().replace('name = "fake robot"', f'name = "fake robot"\n{more}')
    (tmp_path / "robot.toml").write_text(settings)
    with Robot(fault):
        return pursued(f"find {goal}", tmp_path / "run", f"{BODY} {tmp_path / 'robot.toml'}")


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
            assert os.path.isdir(os.path.join(tmp_path, result.evidence)) and any("looking at" in step for step in steps), steps
            goal = wait(client.send_goal_async(Pursue.Goal(goal="identify all objects on the table")), 10)
            time.sleep(1.0)
            wait(goal.cancel_goal_async(), 10)
            assert wait(goal.get_result_async(), 30).status == 5  # cancelled
        finally:
            server.terminate()
            node.destroy_node()
            rclpy.try_shutdown()
