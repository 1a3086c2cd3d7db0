"""Things of a household learned and found again, over seeds: what the learning domain promises, counted.

    cargo build --release && cargo build --release -p descry-robots --example arrangement
    python3 tests/learning.py 101 112 [household|chairs|mujoco|across] [FOLDER]

For each seed one of the things of a household comes before the second visit and another before the third, by the scene of the domain with their names
in it. In separate processes: a first visit; a second, that learns; a search for what was learned where it has been moved to, beside the other;
and one where it is gone and the other stands. A line of JSON a seed, and the counts. `mujoco` is the same on the body of robots/mujoco, whose
things, camera and physics are its own, with the model held against the mesh of the thing; `across` learns in our simulator and searches on the
other body, which has the same things as meshes. For both the environment of robots/mujoco/README.md is active.
"""

import argparse
import json
import math
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
THINGS = re.findall(r"^\[([\w-]+)\]", (ROOT / "robots/src/sim/household.toml").read_text(), re.M)
# What stands on the tables from the beginning is not learned.
THINGS = [name for name in THINGS if name not in ("tissues", "radio")]
DESCRY = os.environ.get("DESCRY", str(ROOT / "target/release/descry"))
NEAR_M = 0.1


def run(*arguments):
    done = subprocess.run(arguments, capture_output=True, text=True)
    return done.stdout, done.stderr


def descry(*arguments):
    out, err = run(DESCRY, *arguments, "--json")
    return json.loads(out) if out.strip() else {"verdict": "error", "why": err[-300:]}


def off_m(a, b):
    return math.dist(a[:2], b[:2])


class Simulated:
    """Our simulator: the scene of the domain with the names of other things in it."""

    def __init__(self, seed, scene_name, folder, _):
        self.seed = seed
        self.thing, self.other = THINGS[seed % len(THINGS)], THINGS[(seed + 5) % len(THINGS)]
        text = (ROOT / f"domains/learning/scenes/{scene_name}.toml").read_text()
        text = text.replace('"kettle"', '"THING"').replace('"teddy"', f'"{self.other}"').replace('"THING"', f'"{self.thing}"')
        self.of_visit = {}
        for visit in (1, 2, 3, 4):
            self.of_visit[visit] = folder / f"scene-{seed}-{visit}.toml"
            self.of_visit[visit].write_text(f"visit = {visit}\n{text}")

    def body(self, visit):
        return "--scene", str(self.of_visit[visit]), "--seed", str(self.seed)

    def truth(self, visit):
        out, _ = run(str(ROOT / "target/release/examples/arrangement"), str(self.of_visit[visit]), str(self.seed))
        return {o["name"]: o for o in map(json.loads, out.splitlines())}


class Mujoco:
    """A body that shares nothing with our simulator but, in the shared household, its things."""

    def __init__(self, seed, scene_name, folder, pose_error):
        self.seed, self.scene_name, self.folder, self.pose_error = seed, scene_name, folder, pose_error
        sys.path.append(str(ROOT / "robots/mujoco"))
        from descry_mujoco import stage

        self.thing, self.other = stage.SCENES[scene_name].coming(seed)

    def told(self, visit):
        return self.folder / f"truth-{self.seed}-{visit}.json"

    def body(self, visit):
        serve = f"serve --scene {self.scene_name} --visit {visit} --seed {self.seed} --pose-error {self.pose_error} --truth '{self.told(visit)}'"
        return "--robot", f"program:PYTHONPATH='{ROOT}/robots/mujoco' python3 -m descry_mujoco {serve}"

    def truth(self, visit):
        return {o["name"]: o for o in json.loads(self.told(visit).read_text())["objects"]}

    def judged(self, visit, store, learned, run_folder):
        """What was learned at a visit against the mesh of the thing."""
        from descry_mujoco import household, stage, surface

        points = self.folder / f"points-{self.seed}.ply"
        run(DESCRY, "name", str(store), learned["name"], "--points", str(points))
        out, _ = run(DESCRY, "memory", "query", str(run_folder), "--kind", "cloud", "--json")
        looks = [(r["seen_from_m"], r["covers_m"]["min_m"], r["covers_m"]["max_m"]) for r in json.loads(out)["records"]]
        scene = household.of_visit(stage.arrange(self.scene_name, self.seed), visit)
        return surface.judged(scene, self.thing, surface.read_ply(points) + learned["seen"]["position_m"], looks)


class Across:
    """The first two visits in our simulator, the others on MuJoCo."""

    def __init__(self, seed, _, folder, pose_error):
        self.bodies = Simulated(seed, "household", folder, None), Mujoco(seed, "shared-household", folder, pose_error)
        self.thing, self.other = self.bodies[0].thing, self.bodies[0].other

    def body(self, visit):
        return self.bodies[visit > 2].body(visit)

    def truth(self, visit):
        return self.bodies[visit > 2].truth(visit)


PLACES = {
    "household": (Simulated, "household"), "chairs": (Simulated, "chairs"), "mujoco": (Mujoco, "household"), "across": (Across, "household"),
}


def seed_of(seed, place, folder, visits):
    thing, other = place.thing, place.other
    store = folder / f"store-{seed}"

    def run_of(goal, visit):
        return str(folder / f"run-{seed}-{visit}-{goal[:5]}")

    def pursue(goal, visit):
        return descry("do", goal, "--domain", "learning", *place.body(visit), "--run", run_of(goal, visit), "--remember", str(store))

    row = {"seed": seed, "thing": thing, "other": other}
    first = pursue("learn what is new", 1)
    second = pursue("learn what is new", 2)
    row["first"], row["second"], row["why"] = first["verdict"], second["verdict"], second["why"][:400]
    row["looks"], row["seconds"], row["wall_s"] = second.get("views"), second.get("sim_time_s"), second.get("wall_s")
    there = place.truth(2)[thing]["centre_m"]
    learned, _ = run(DESCRY, "name", str(store), "--json")
    learned = json.loads(learned)["things"] if learned.strip() else []
    right = [t for t in learned if off_m(t["seen"]["position_m"], there) < NEAR_M]
    row["learned"], row["false"] = len(right), len(learned) - len(right)
    if not right:
        return row
    row["sides"] = right[0]["sides"]
    if isinstance(place, Mujoco):
        row["model"] = place.judged(2, store, right[0], run_of("learn what is new", 2))
    run(DESCRY, "name", str(store), right[0]["name"], thing)
    for visit, key in ((3, "moved"), (4, "gone"))[: visits - 2]:
        found = pursue(f"find {thing}", visit)
        row[key] = {"verdict": found["verdict"], "confidence": found.get("confidence"), "views": found.get("views")}
        true = place.truth(visit)
        if found["verdict"] == "achieved":
            at = found["position_m"]
            row[key]["off_m"] = off_m(at, true[thing]["centre_m"]) if thing in true else None
        else:
            row[key]["why"] = found["why"][:300]
    return row


def main():
    parser = argparse.ArgumentParser(description="Things of a household learned and found again, over seeds.")
    parser.add_argument("low", type=int)
    parser.add_argument("high", type=int)
    parser.add_argument("scene", nargs="?", default="household", choices=PLACES)
    parser.add_argument("folder", nargs="?", type=pathlib.Path)
    parser.add_argument("--pose-error", default="0.03,2", metavar="METRES,DEGREES", help="of the body on MuJoCo")
    parser.add_argument("--visits", type=int, default=4, choices=(2, 4), help="2: nothing is searched for")
    given = parser.parse_args()
    low, high, folder = given.low, given.high, given.folder or pathlib.Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    make, scene_name = PLACES[given.scene]
    rows = []
    for seed in range(low, high + 1):
        row = seed_of(seed, make(seed, scene_name, folder, given.pose_error), folder, given.visits)
        print(json.dumps(row), flush=True)
        rows.append(row)
    named = [r for r in rows if "gone" in r]
    is_right = lambda r: r["moved"]["verdict"] == "achieved" and (r["moved"]["off_m"] or 9) < NEAR_M
    offs = sorted(r["moved"]["off_m"] for r in named if is_right(r))
    count = lambda condition: sum(1 for r in named if condition(r))
    models = [r["model"] for r in rows if "model" in r]
    print(json.dumps({
        "seeds": len(rows),
        "learned": sum(1 for r in rows if r.get("learned")),
        "false_things_learned": sum(r.get("false", 0) for r in rows),
        "found_where_it_was_moved": count(is_right),
        "false_yes_beside_another": count(lambda r: r["moved"]["verdict"] == "achieved" and not is_right(r)),
        "false_not_there": count(lambda r: r["moved"]["verdict"] == "not_found"),
        "cannot_tell": count(lambda r: r["moved"]["verdict"] == "cannot_tell"),
        "off_m": {"mean": sum(offs) / max(len(offs), 1), "most": max(offs, default=None)},
        "gone_not_there": count(lambda r: r["gone"]["verdict"] == "not_found"),
        "gone_cannot_tell": count(lambda r: r["gone"]["verdict"] == "cannot_tell"),
        "gone_false_yes": count(lambda r: r["gone"]["verdict"] == "achieved"),
        **({"models": {key: round(statistics.mean(m[key] for m in models), 4) for key in models[0]}} if models else {}),
    }))


if __name__ == "__main__":
    main()
