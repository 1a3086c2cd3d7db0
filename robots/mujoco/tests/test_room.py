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

        for of in (household.OWN, household.SHARED):
            for name in of.names:
                thing = of.thing(name)
                self.assertEqual(len(thing.parts), len(thing.colours))
                low = min(part[0][:, 2].min() for part in thing.parts)
                self.assertAlmostEqual(low, 0.0, delta=1e-6, msg=name)
                for part in thing.parts:
                    self.assertGreater(meshes.volume(part), 1e-7, name)

    def test_what_is_cut_is_the_same_surface(self):
        from descry_mujoco import meshes

        box = meshes.box(0.2, 0.1, 0.05)
        vertices, faces = meshes.cut(box, 0.02)
        self.assertAlmostEqual(meshes.volume((vertices, faces)), 0.001, places=9)
        sides = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
        self.assertLessEqual(sides.max(), 0.02)

    def test_prints_are_those_of_descrys_own_simulator(self):
        from descry_mujoco import composed

        # As `Paint::at` of robots/src/sim/composed.rs says them.
        places = np.array([[0.0, 0.0, 0.0], [0.05, -0.12, 0.2], [-0.31, 0.07, 0.11]])
        said = 255.0 * composed._printed(np.array([120.0] * 3), {"size_m": 0.03, "spread": 100.0, "seed": 7}, places)
        np.testing.assert_array_equal(said.astype(int), [[152, 196, 184], [150, 178, 112], [107, 160, 65]])

    def test_each_face_shows_its_colour(self):
        from descry_mujoco import meshes, stage, things, world
        from descry_mujoco.scenes import Placed, Scene

        # Each side of a cube has its own mix of primary colours.
        cube = meshes.cut(meshes.box(0.2, 0.2, 0.2), 0.05)
        middles = cube[0][cube[1]].mean(axis=1) - [0.0, 0.0, 0.1]
        sides = np.abs(middles).argmax(axis=1)
        colours = np.eye(3)[sides] * np.where(np.take_along_axis(middles, sides[:, None], 1) > 0.0, 0.8, 0.4)
        painted = things.Thing("cube", "cube", "parts", {"x": 0.2, "y": 0.2, "z": 0.2}, parts=(cube,), colours=(colours,))
        scene = Scene("one", 1, (6.0, 6.0), [], [Placed(painted, "floor", 0.0, 0.0, 0.7, 0.0)])
        with stage.Stage(scene, 64, 48, 90.0) as staged:
            for eye, axis in (((1.0, 0.01, 0.8), 0), ((0.01, -1.0, 0.8), 1), ((0.01, 0.01, 1.8), 2)):
                frame = staged.look(world.looking(np.array(eye), np.array([0.0, 0.0, 0.8])))
                of_cube = frame.colour[frame.body > 0].astype(float)
                self.assertGreater(len(of_cube), 100)
                self.assertLess(np.delete(of_cube, axis, axis=1).mean(), 0.1 * of_cube[:, axis].mean(), f"axis {axis}")

    def test_a_thing_comes_is_moved_and_goes_and_the_others_stay(self):
        from descry_mujoco import household, stage

        for of, seed in ((of, seed) for of in (household.OWN, household.SHARED) for seed in range(1, 9)):
            scene = stage.arrange(of.scene, seed)
            visits = [{p.thing.name: (p.x_m, p.y_m, p.surface) for p in household.of_visit(scene, n).placed} for n in range(1, 5)]
            first, second = of.coming(seed)
            self.assertEqual([sorted(v) for v in visits], [sorted([*of.always, *more]) for more in ([], [first], [first, second], [second])])
            self.assertNotEqual(visits[1][first][2], visits[2][first][2])
            for name in of.always:
                self.assertEqual(len({v[name] for v in visits}), 1)

    def test_a_model_is_held_against_its_mesh(self):
        from descry_mujoco import household, stage, surface

        scene = household.of_visit(stage.arrange("household", 3), 2)
        name, _ = household.OWN.coming(3)
        placed = next(p for p in scene.placed if p.thing.name == name)
        points, _ = surface.in_map(placed, *surface.sampled(placed.thing, 6_000, np.random.default_rng(2)))
        eye = np.array([0.0, 0.0, 1.2])
        looks = [(eye, np.full(3, -10.0), np.full(3, 10.0))]
        # What one look shows of it, 2 cm from where it is, and a fifth that is none of it.
        half = points[surface.seen(scene, points, looks)] + [0.015, -0.01, 0.005]
        said = surface.judged(scene, name, np.concatenate([half, half[: len(half) // 4] + [0.0, 0.0, 0.4]]), looks)
        self.assertGreater(said["recall_of_shown"], 0.98)
        self.assertLess(said["recall"], 0.85)
        self.assertAlmostEqual(said["precision"], 0.8, delta=0.02)


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
