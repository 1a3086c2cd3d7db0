"""What the body does in its room."""

import json
import math
import tempfile
import unittest
from pathlib import Path

from installed import MISSING, needs_mujoco

if not MISSING:
    import descry_robot as descry
    import numpy as np
    from descry_mujoco import body, stage


class Asked:
    """A request that nobody stops."""

    def __init__(self):
        self.fractions = []

    def feedback(self, fraction, distance_m=0.0):
        self.fractions.append(fraction)

    def check(self):
        pass

    def check_time(self):
        pass


def body_in(scene_name, seed, start=(1.5, 0.5, math.pi), **settings):
    scene = stage.arrange(scene_name, seed)
    scene.start = start
    return body.Body(scene, body.Settings(seed, **settings))


EXACT = dict(sigma_m=0.0, sigma_rad=0.0)


def body_in_home(shut, start_at=None, **settings):
    """Before the door, or within reach of a thing."""
    scene = stage.arrange("home", 1)
    scene.doors[0].shut = shut
    x, y = scene.doors[0].centre_m
    scene.start = (x - 0.8, y, 0.0)
    if start_at:
        thing = next(p for p in scene.placed if p.thing.name == start_at)
        scene.start = (thing.x_m + 1.0, thing.y_m, math.pi)
    return body.Body(scene, body.Settings(1, **EXACT, **settings))


@needs_mujoco
class Body(unittest.TestCase):
    def test_a_drive_arrives_and_takes_as_long_as_was_said(self):
        here = body_in("floor", 1)
        x, y, yaw = here.believed()
        goal = (x + 0.3, y + 1.2, 1.0)
        before, asked = here.now_ns(), Asked()
        here.drive_to(asked, {"pose": dict(zip(("x_m", "y_m", "yaw_rad"), goal))}, [[x, y], [x, y + 1.2], list(goal[:2])])
        legs = [(1.2, 0.5 * math.pi), (0.3, 0.0)]
        headings = [yaw] + [heading for _, heading in legs] + [goal[2]]
        turned = sum(abs(math.remainder(b - a, 2 * math.pi)) for a, b in zip(headings, headings[1:]))
        said_s = sum(length for length, _ in legs) / body.LINEAR_M_S + turned / body.ANGULAR_RAD_S
        self.assertAlmostEqual((here.now_ns() - before) * 1e-9, said_s, delta=0.05 * said_s)
        self.assertTrue(all(abs(a - b) < 0.02 for a, b in zip(here.believed(), goal)), f"{here.believed()} is not {goal}")
        self.assertEqual(asked.fractions, sorted(asked.fractions))
        off = math.dist(here.believed()[:2], here.truth()[:2])
        self.assertTrue(0.001 < off < 0.15, f"localisation is off by {off} m")

    def test_who_drives_against_a_wall_is_blocked(self):
        here = body_in("floor", 1, **EXACT)
        x, y, _ = here.believed()
        with self.assertRaises(descry.Failure) as failed:
            here.drive_to(Asked(), {"pose": {"x_m": 9.0, "y_m": y, "yaw_rad": 0.0}}, [[x, y], [9.0, y]])
        self.assertIn("blocked", failed.exception.said)

    def test_a_push_moves_a_thing_by_physics(self):
        here = body_in("search", 2, **EXACT)
        at = here.stage.pose_of("cup A")[:3, 3].copy()
        moved = here.push_aside(Asked(), [at[0], at[1], at[2] + 0.05], [0.0, 1.0], 0.1)["moved_m"]
        self.assertAlmostEqual(moved, 0.1, delta=0.01)
        self.assertAlmostEqual(here.stage.pose_of("cup A")[1, 3] - at[1], 0.1, delta=0.02)
        with self.assertRaises(descry.Failure) as failed:
            here.push_aside(Asked(), [at[0], at[1] + 0.6, 1.6], [1.0, 0.0], 0.1)
        self.assertIn("slipped", failed.exception.said)

    def test_what_is_grasped_goes_along_and_is_put_down(self):
        here = body_in("floor", 5, **EXACT)
        at = here.stage.pose_of("cup A")[:3, 3].copy()
        self.assertAlmostEqual(here.grasp(Asked(), [at[0], at[1], at[2] + 0.05], 0.08)["width_m"], 0.07, places=3)
        self.assertTrue(here.hand(Asked())["holds"])
        x, y, _ = here.believed()
        here.drive_to(Asked(), {"pose": {"x_m": x, "y_m": y + 0.4, "yaw_rad": 3.0}}, [[x, y], [x, y + 0.4]])
        self.assertGreater(np.linalg.norm(here.stage.pose_of("cup A")[:3, 3] - at), 0.3)
        here.place(Asked(), list(at))
        self.assertFalse(here.hand(Asked())["holds"])
        self.assertLess(np.linalg.norm(here.stage.pose_of("cup A")[:3, 3] - at), 0.01)

    def test_the_hand_finds_what_localisation_misses_and_nothing_farther_off(self):
        here = body_in("floor", 5, **EXACT)
        at = here.stage.pose_of("cup A")[:3, 3] + [0.0, 0.0, 0.05]
        with self.assertRaises(descry.Failure) as failed:
            here.grasp(Asked(), list(at + [0.0, 0.0, 0.3]), 0.08)
        self.assertIn("slipped", failed.exception.said)
        here.grasp(Asked(), list(at + [0.03, -0.04, 0.0]), 0.08)
        self.assertEqual(here.arm.held, "cup A")

    def test_what_is_put_down_on_something_is_blocked(self):
        here = body_in("floor", 5, start=(0.0, 1.0, 0.0), **EXACT)
        at = here.stage.pose_of("cup A")[:3, 3].copy()
        other = next(p for p in here.scene.placed if p.thing.kind == "white cylinder")
        here.grasp(Asked(), [at[0], at[1], at[2] + 0.05], 0.08)
        with self.assertRaises(descry.Failure) as failed:
            here.place(Asked(), [other.x_m, other.y_m, other.z_m])
        self.assertIn("blocked", failed.exception.said)
        self.assertTrue(here.hand(Asked())["holds"])

    def test_a_shut_door_blocks_and_is_opened(self):
        here = body_in_home(shut=True)
        (door,) = here.scene.doors
        x, y = door.centre_m
        through = dict(to={"pose": {"x_m": x + 0.8, "y_m": y, "yaw_rad": 0.0}}, route_m=[[x - 0.8, y], [x + 0.8, y]])
        with self.assertRaises(descry.Failure) as failed:
            here.drive_to(Asked(), **through)
        self.assertEqual(failed.exception.said["blocked"]["by"], door.name)
        here.stop()
        with self.assertRaises(descry.Failure) as failed:
            here.open_door(Asked(), "another door")
        self.assertIn("unreachable", failed.exception.said)
        here.open_door(Asked(), door.name)
        here.drive_to(Asked(), **through)
        self.assertLess(abs(here.truth()[0] - x - 0.8), 0.02)

    def test_the_truth_says_what_stands_where_and_is_kept_from_answers(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "truth.json"
            here = body_in_home(shut=False, truth=file, start_at="cup A")
            cup = lambda: next(o for o in json.loads(file.read_text())["objects"] if o["kind"] == "cup A")
            before = cup()
            self.assertEqual(before["surface"], next(p.surface for p in here.scene.placed if p.thing.kind == "cup A"))
            here.grasp(Asked(), before["centre_m"], 0.08)
            self.assertTrue(cup()["in_hand"] and cup()["surface"] is None)
            self.assertNotIn("cup A", json.dumps(here.hello()[0]))
            self.assertFalse(json.loads(file.read_text())["doors"][0]["shut"])

    def test_what_is_left_out_is_gone_and_all_else_stands_where_it_stood(self):
        whole = stage.arrange("home", 3)
        without = whole.without(["cup A", "cup B"])
        self.assertEqual([p for p in whole.placed if p.thing.kind not in ("cup A", "cup B")], without.placed)
        self.assertEqual(len(whole.placed) - len(without.placed), 2)

    def test_the_same_seed_gives_the_same_frames(self):
        frames = []
        for _ in range(2):
            here = body_in("search", 3)
            here.look_at(Asked(), [0.0, 0.0, 0.7])
            frames.append(here.sense(Asked())[1])
        self.assertEqual(frames[0], frames[1])


if __name__ == "__main__":
    unittest.main()
