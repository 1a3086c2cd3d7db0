"""descry's planner beside others on a folder of tasks, such as those of the International Planning Competitions:

    pip install kairos-planner
    python3 planner/peers.py DIR [--descry PATH] [--limit SECONDS]

DIR holds a folder for each domain: `domain.pddl` (or `domain-NAME.pddl` for `NAME.pddl`) and problems. Every planner gets the same
processor seconds and one thread; `descry validate` checks every plan and states its cost.
"""

import argparse
import json
import math
import pathlib
import resource
import shutil
import subprocess
import tempfile


def engines(descry: str, limit: int) -> dict[str, list[str]]:
    """Commands that write a plan to `{plan}`, by name; those that are not installed are left out."""
    found = {"descry": [descry, "plan", "{domain}", "{problem}", "--time-limit", str(limit), "--out", "{plan}"]}
    if kairos := shutil.which("kairos"):
        found["kairos"] = [kairos, "solve", "{domain}", "{problem}", "--no-anytime", "--threads", "1", "--timeout", str(limit), "--output", "{plan}"]
    return found


def tasks(folder: pathlib.Path):
    for problem in sorted(folder.rglob("*.pddl")):
        if not problem.stem.startswith("domain"):
            own = problem.with_name(f"domain-{problem.stem}.pddl")
            yield own if own.exists() else problem.with_name("domain.pddl"), problem


def solve(command: list[str], domain, problem, descry: str, limit: int):
    """Processor seconds and cost of a valid plan, or none."""
    with tempfile.TemporaryDirectory() as work:
        plan = pathlib.Path(work, "a.plan")
        told = [part.format(domain=domain, problem=problem, plan=plan) for part in command]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            subprocess.run(told, capture_output=True, timeout=6 * limit, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1)))
        except subprocess.TimeoutExpired:
            pass
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        written = sorted(pathlib.Path(work).glob("a.plan*"))
        if not written:
            return None
        checked = subprocess.run([descry, "validate", domain, problem, written[-1], "--json"], capture_output=True, text=True)
        return (seconds, json.loads(checked.stdout)["cost"]) if checked.returncode == 0 else None


def mean_ratio(pairs) -> str:
    logs = [math.log(max(a, 0.01) / max(b, 0.01)) for a, b in pairs]
    return f"{math.exp(sum(logs) / len(logs)):.2f}" if logs else "-"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--descry", default="descry")
    parser.add_argument("--limit", type=int, default=10)
    asked = parser.parse_args()
    results = {name: {} for name in engines(asked.descry, asked.limit)}
    for domain, problem in tasks(asked.folder):
        for name, command in engines(asked.descry, asked.limit).items():
            results[name][problem] = solve(command, domain, problem, asked.descry, asked.limit)
        told = ", ".join(f"{name} " + (f"{r[0]:.2f} s cost {r[1]}" if (r := of[problem]) else "-") for name, of in results.items())
        print(f"{problem.parent.name}/{problem.stem}: {told}", flush=True)
    ours = results["descry"]
    for name, of in results.items():
        both = [(of[p], ours[p]) for p in of if of[p] and ours[p]]
        solved = sum(1 for r in of.values() if r)
        print(f"{name}: {solved} of {len(of)} solved; time / descry's {mean_ratio((a[0], b[0]) for a, b in both)}, "
              f"cost / descry's {mean_ratio((a[1], b[1]) for a, b in both if a[1] is not None and b[1] is not None)} where both solve ({len(both)})")


main()
