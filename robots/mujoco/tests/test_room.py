"""What the room and its camera promise."""

import json
import tempfile
import unittest
from pathlib import Path

from installed import MISSING, needs_mujoco

if not MISSING:
    import numpy as np


@needs_mujoco
class Meshes(unittest.TestCase):
    def test_every_form_is_closed_and_looks_outwards(self):
        from descry_mujoco import meshes, things

        make = things.Maker(np.random.default_rng(1))
        for name in "cup_a cup_b white_cylinder mug other_cup canister bottle bowl small_box tall_box".split():
            thing = getattr(make, name)()
            for vertices, faces in thing.meshes():
                edges = {}
                for face in faces:
                    for a, b in zip(face, np.roll(face, -1)):
                        edges[(a, b)] = edges.get((a, b), 0) + 1
                self.assertTrue(all(edges.get((b, a)) == 1 and n == 1 for (a, b), n in edges.items()), f"{name} is not closed")
                self.assertGreater(meshes.volume((vertices, faces)), 0.0, name)
            top = max(v[:, 2].max() for v, _ in thing.meshes())
            self.assertAlmostEqual(top, thing.height_m, places=3, msg=name)

    def test_a_cup_has_the_size_of_its_model(self):
        from descry_mujoco import things

        (vertices, _), = things.Maker(np.random.default_rng(1)).cup_a().meshes()
        self.assertAlmostEqual(2 * np.hypot(vertices[:, 0], vertices[:, 1]).max(), 0.070, delta=0.001)


@needs_mujoco
class Household(unittest.TestCase):
    def test_parts_are_closed_and_stand_on_their_foot(self):
        from descry_mujoco import household, meshes

        for name in household.THINGS:
            thing = household.thing(name)
            self.assertEqual(len(thing.parts), len(thing.colours))
            low = min(part[0][:, 2].min() for part in thing.parts)
            self.assertAlmostEqual(low, 0.0, delta=1e-6, msg=name)
            for part in thing.parts:
                self.assertGreater(meshes.volume(part), 1e-7, name)

    def test_a_thing_comes_is_moved_and_goes_and_the_others_stay(self):
        from descry_mujoco import household, stage

        for seed in range(1, 9):
            scene = stage.arrange("household", seed)
            visits = [{p.thing.name: (p.x_m, p.y_m, p.surface) for p in household.of_visit(scene, n).placed} for n in range(1, 5)]
            first, second = household.coming(seed)
            self.assertEqual([sorted(v) for v in visits], [sorted([*household.ALWAYS, *more]) for more in ([], [first], [first, second], [second])])
            self.assertNotEqual(visits[1][first][2], visits[2][first][2])
            self.assertEqual(visits[2][second], visits[3][second])
            for name in household.ALWAYS:
                self.assertEqual(len({v[name] for v in visits}), 1)


@needs_mujoco
class Noise(unittest.TestCase):
    def test_disparity_errs_as_much_and_as_far_together_as_measured(self):
        from descry_mujoco import noise

        depth = np.full((480, 640), 1.5)
        how = noise.DepthNoise(holes=0.0, jitter_px=0.0, disparity_steps=1e6)
        seen = noise.observe(depth, np.zeros_like(depth), 570.0, how, (1,))
        error = 1.0 / seen - 1.0 / 1.5
        self.assertAlmostEqual(np.std(error), 0.0025, delta=0.0003)
        error = (error - error.mean()) / error.std()
        for distance, expected in ((1, 0.81), (4, 0.57), (8, 0.34), (16, 0.26)):
            found = float((error[:, distance:] * error[:, :-distance]).mean())
            self.assertAlmostEqual(found, expected, delta=0.08, msg=f"{distance} px")

    def test_the_shadow_is_left_of_what_stands_before(self):
        from descry_mujoco import noise

        depth = np.full((10, 200), 2.0)
        depth[:, 100:120] = 1.0
        lost = noise.shadow(depth, 570.0, 0.075)
        width = 570.0 * 0.075 * (1.0 / 1.0 - 1.0 / 2.0)
        self.assertAlmostEqual(lost[0].sum(), width, delta=2.0)
        self.assertTrue(lost[0, 99] and not lost[0, 121])

    def test_holes_are_as_many_as_asked_for(self):
        from descry_mujoco import noise

        depth = np.full((480, 640), 1.5)
        for share in (0.0, 0.05, 0.1):
            how = noise.DepthNoise(holes=share)
            lost = np.isnan(noise.observe(depth, np.zeros_like(depth), 570.0, how, (2,))).mean()
            self.assertAlmostEqual(lost, share, delta=0.004)


@needs_mujoco
class Pictures(unittest.TestCase):
    def test_depth_lies_on_the_floor_and_the_table(self):
        from descry_mujoco import scenes, stage, world

        scene = scenes.arrange(scenes.floor, 1)
        pose = world.looking(np.array([-1.6, -1.0, 1.4]), np.array([0.0, 0.0, 0.72]))
        with stage.Stage(scene) as here:
            depth = here.look(pose).depth_m
            focal, (cx, cy) = here.camera.focal_px, here.camera.centre_px
        v, u = np.indices(depth.shape)
        rays = np.stack([(u - cx) / focal, (v - cy) / focal, np.ones_like(depth)], axis=-1)
        z = (depth[..., None] * rays) @ pose[2, :3] + pose[2, 3]
        for height in (0.0, scene.tables[0].height_m):
            near = np.abs(z - height) < 0.01
            self.assertGreater(near.sum(), 5000)
            self.assertLess(np.median(np.abs(z[near] - height)), 5e-4)

    def test_a_recording_is_the_same_for_the_same_seed(self):
        from descry_mujoco import recording

        order = recording.Order("absent", 5, 2, 0.05, 1.0, 0.03, 1.2)
        with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
            for folder in (one, two):
                recording.record(order, Path(folder))
            names = sorted(p.name for p in Path(one).iterdir())
            self.assertEqual(len([n for n in names if n.endswith(".depth.png")]), 2)
            for name in names:
                self.assertEqual((Path(one) / name).read_bytes(), (Path(two) / name).read_bytes(), name)
            truth = json.loads((Path(one) / "truth.json").read_text())
            self.assertNotIn("cup A", [o["kind"] for o in truth["objects"]])


if __name__ == "__main__":
    unittest.main()
