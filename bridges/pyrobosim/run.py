"""descry in the four worlds of the ROSCon 2024 deliberation workshop, beside a plan made once and nearest-first.

    python3 bridges/pyrobosim/run.py --seeds 5
    python3 bridges/pyrobosim/run.py --seeds 100 --jobs 2 --out results/pyrobosim

Fetches pyrobosim into an environment of its own. Every run is kept in a line of `runs.jsonl` below `--out`; what is there already is not run again.
"""

import argparse
import concurrent.futures
import json
import multiprocessing
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
PACKAGES = ["pyrobosim==5.0.1"]
POLICIES = ("descry", "plan made once", "the same, each step until it works", "nearest first")
TRIES = 100


def goal_of(facts):
    """The goal of a problem in the words of the domain."""
    return " and ".join([f"bring {item} to the {place}" for item, place in facts["bring"]] + [f"shut the {place}" for place in facts["close"]])


def serve(problem, seed, folder):
    """A body on the socket `folder/body.sock`, until it is ended."""
    import body
    from workshop import Workshop

    one = body.Body(Workshop(problem, seed), str(folder / "result.json"))
    one.listen(str(folder / "domain" / "world.sock"))
    body.descry.serve(one, str(folder / "body.sock"))


def descry_run(descry, problem, seed, goal):
    """One run of descry: what became of it, and the steps of its first plan."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(HERE / "domain", folder / "domain")
        robot = multiprocessing.Process(target=serve, args=(problem, seed, folder), daemon=True)
        robot.start()
        while not (folder / "body.sock").exists():
            if not robot.is_alive():
                raise RuntimeError("the body ended before it listened")
            time.sleep(0.05)
        command = [descry, "do", goal, "--domain", folder / "domain", "--robot", f"socket:{folder / 'body.sock'}", "--seed", str(seed)]
        environment = dict(os.environ, PATH=f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
        try:
            ended = subprocess.run([*command, "--run", folder / "run", "--quiet", "--json"], capture_output=True, text=True, env=environment)
        finally:
            robot.kill()
            robot.join()
        said = json.loads(ended.stdout) if ended.stdout.strip() else {}
        shown = subprocess.run([descry, "show", folder / "run", "--json"], capture_output=True, text=True, check=True)
        plans = [event for event in json.loads(shown.stdout)["events"] if event["event"] == "planned"]
        result = folder / "result.json"
        state = json.loads(result.read_text()) if result.exists() else {"goal": False, "seconds": 0.0, "metres": 0.0, "failed": 0, "battery": 100.0}
        why = "" if state["goal"] else str(said.get("why") or ended.stderr.strip()[-300:])
        steps = [parsed(step) for step in plans[0]["steps"]] if plans else []
        return dict(state, replans=max(len(plans) - 1, 0), claims=ended.returncode == 0, why=why), steps


def parsed(step):
    """`(move a b)`, with or without times, as a list of words."""
    return step[step.index("(") + 1 : step.index(")")].split()


def rival_run(problem, seed, carry_out):
    import rivals
    import workshop
    from ways import Ways

    w = workshop.Workshop(problem, seed)
    hands, why = rivals.Hands(w, Ways(w)), ""
    try:
        carry_out(hands)
    except rivals.Stuck as stuck:
        why = str(stuck)
    return {"goal": w.goal_holds(), "seconds": w.clock.now_s, "metres": w.driven_m, "failed": w.failed,
            "battery": w.robot.battery_level, "replans": 0, "why": why}


def of_symbols(hands, steps):
    """Steps of a plan with the names of stations instead of their symbols."""
    names = {name.replace(" ", "-"): name for name in hands.workshop.stations}
    return [[names.get(word, word) if k else word for k, word in enumerate(step)] for step in steps]


def job(given):
    """All policies on one problem and seed."""
    import rivals
    import workshop

    descry, problem, seed = given
    result, steps = descry_run(descry, problem, seed, goal_of(workshop.PROBLEMS[problem]))
    results = [
        result,
        rival_run(problem, seed, lambda hands: rivals.once(hands, of_symbols(hands, steps), 1)),
        rival_run(problem, seed, lambda hands: rivals.once(hands, of_symbols(hands, steps), TRIES)),
        rival_run(problem, seed, rivals.nearest_first),
    ]
    return [dict(r, problem=problem, seed=seed, policy=policy) for policy, r in zip(POLICIES, results)]


def mean(numbers):
    numbers = list(numbers)
    return sum(numbers) / len(numbers) if numbers else float("nan")


def table(rows):
    """The table as Markdown: a row a problem and policy."""
    lines = ["| problem | policy | runs | goal reached | seconds, where reached | metres | failed actions | replans | battery empty |", "|" + "---|" * 9]
    for problem in sorted({row["problem"] for row in rows}):
        for policy in POLICIES:
            of = [row for row in rows if row["problem"] == problem and row["policy"] == policy]
            reached = [row for row in of if row["goal"]]
            numbers = [mean(row[key] for row in reached) for key in ("seconds", "metres", "failed", "replans")]
            shown = ["–" if n != n else f"{n:.1f}" for n in numbers]
            if policy != "descry":
                shown[3] = "–"
            empty = sum(row["battery"] <= 0 for row in of)
            lines.append(f"| {problem} | {policy} | {len(of)} | {len(reached)} | {' | '.join(shown)} | {empty} |")
    return "\n".join(lines)


def main():
    from environment import run_in

    run_in("pyrobosim", PACKAGES)
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--seeds", type=int, default=5)
    arguments.add_argument("--problems", type=int, nargs="*", default=[1, 2, 3, 4])
    arguments.add_argument("--descry", default=shutil.which("descry") or str(HERE.parents[1] / "target" / "release" / "descry"))
    arguments.add_argument("--jobs", type=int, default=1)
    arguments.add_argument("--out", type=pathlib.Path, default=pathlib.Path("results") / "pyrobosim")
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    kept = given.out / "runs.jsonl"
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    known = {(row["problem"], row["seed"]) for row in rows}
    jobs = [(given.descry, problem, seed) for seed in range(1, given.seeds + 1) for problem in given.problems if (problem, seed) not in known]
    with concurrent.futures.ProcessPoolExecutor(given.jobs) as pool, kept.open("a") as file:
        for done in concurrent.futures.as_completed([pool.submit(job, j) for j in jobs]):
            for row in done.result():
                file.write(json.dumps(row) + "\n")
                rows.append(row)
            file.flush()
    print(table([row for row in rows if row["seed"] <= given.seeds and row["problem"] in given.problems]))


if __name__ == "__main__":
    main()
