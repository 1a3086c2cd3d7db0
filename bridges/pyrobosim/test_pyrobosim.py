"""Tests of the bridge to pyrobosim: `python3 -m unittest discover bridges/pyrobosim`. What needs pyrobosim or descry is skipped without."""

import importlib.util
import pathlib
import shutil
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
DESCRY = shutil.which("descry") or str(HERE.parents[1] / "target" / "release" / "descry")
PYROBOSIM = importlib.util.find_spec("pyrobosim")
needs_pyrobosim = unittest.skipUnless(PYROBOSIM and PYROBOSIM.origin, "pyrobosim is not installed")
needs_descry = unittest.skipUnless(pathlib.Path(DESCRY).exists(), "descry is not built")


class WithoutPyrobosim(unittest.TestCase):
    @needs_descry
    def test_the_domain_has_no_fault(self):
        checked = subprocess.run([DESCRY, "check", HERE / "domain"], capture_output=True, text=True)
        self.assertEqual((checked.returncode, "no finding" in checked.stdout + checked.stderr), (0, True), checked.stdout)

    def test_the_table_counts_what_was_reached(self):
        import run

        row = {"problem": 3, "policy": "descry", "metres": 8.0, "failed": 1, "replans": 2, "battery": 90.0, "seed": 1}
        rows = [dict(row, goal=True, seconds=10.0), dict(row, goal=True, seconds=20.0), dict(row, goal=False, seconds=99.0, battery=0.0)]
        self.assertIn("| 3 | descry | 3 | 2 | 15.0 | 8.0 | 1.0 | 2.0 | 1 |", run.table(rows))

    def test_steps_of_a_plan_are_read_with_and_without_times(self):
        import run

        self.assertEqual(run.parsed("0.500: (move a b) [3.2]"), ["move", "a", "b"])
        self.assertEqual(run.parsed("(put a)"), ["put", "a"])

    def test_a_goal_is_said_in_the_words_of_the_domain(self):
        import run

        facts = {"bring": (("bread0", "table"),), "close": ("fridge",)}
        self.assertEqual(run.goal_of(facts), "bring bread0 to the table and shut the fridge")


@needs_pyrobosim
class WithPyrobosim(unittest.TestCase):
    @needs_descry
    def test_the_body_conforms(self):
        body = f"program:{sys.executable} {HERE / 'body.py'} 1 --seed 3"
        checked = subprocess.run([DESCRY, "robot", "check", body], capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_a_seed_is_one_world_and_one_sequence_of_failures(self):
        from workshop import Failed, Workshop

        def tries(seed):
            w = Workshop(3, seed)
            w.robot.set_pose(w.stations["pantry front"])
            said = []
            for _ in range(20):
                try:
                    w.open()
                    said.append(True)
                except Failed:
                    said.append(False)
            return said, w.clock.now_s

        self.assertEqual(tries(7), tries(7))
        self.assertNotEqual(tries(7)[0], tries(8)[0])
        self.assertEqual(tries(7)[1], 40.0)

    def test_shut_hallways_block_and_empty_batteries_end(self):
        from workshop import Failed, Workshop

        w = Workshop(4, 1)
        here, there = w.robot.get_pose(), w.stations["dining trash hall side 2"]
        with self.assertRaises(Failed) as blocked:
            w.navigate([(here.x, here.y), (-1.1, 0.9), (there.x, there.y)], 0.0)
        self.assertEqual(blocked.exception.by, "dining trash hall")
        self.assertEqual(w.driven_m, 0.0)
        w.robot.set_pose(w.stations["pantry front"])
        w.robot.battery_level = 0.0
        with self.assertRaises(Failed):
            w.open()

    def test_nearest_first_solves_what_never_fails(self):
        import rivals
        from ways import Ways
        from workshop import Workshop

        for problem in (1, 2):
            w = Workshop(problem, 1)
            rivals.nearest_first(rivals.Hands(w, Ways(w)))
            self.assertTrue(w.goal_holds())

    def test_ways_lead_around_what_is_shut(self):
        from ways import Ways
        from workshop import Workshop

        w = Workshop(1, 1)
        ways, start, goal = Ways(w), (-1.1, 0.9), (-1.1, 1.8)
        self.assertAlmostEqual(ways.metres(start, goal, frozenset()), 0.9, places=2)
        self.assertGreater(ways.metres(start, goal, frozenset({"dining trash hall"})), 4.0)
        self.assertEqual(ways.metres(start, goal, frozenset(w.doors)), float("inf"))


if __name__ == "__main__":
    unittest.main()
