#!/usr/bin/env python3
"""Lets the agent live in the home for hours of its own time, with faults, people and restarts, and scores every verdict.

A server (`descry serve`) takes goals; every few goals it is killed, and the next begins with another seed: people have moved
things and shut doors meanwhile, while what was seen before is remembered. Faults come with their chances in the scene.

    tests/soak.py --hours 24                   a day; prints a line a server, then a table
    tests/soak.py --hours 1 --descry PATH      an hour, with another binary

Ends with 1 if a goal did not end once, a verdict is false, or the server's memory grew.
"""

import argparse
import collections
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import tempfile
import time
import urllib.request

TREE = pathlib.Path(__file__).resolve().parent.parent
SURFACES = ["kitchen table", "counter", "desk", "coffee table", "lower board", "upper board"]
FAULTS = {"blocked_path": 0.05, "timed_out_drive": 0.03, "dropped_frame": 0.1, "bad_localisation": 0.05, "grasp_slips": 0.2, "door_shut": 0.05}


def scene(folder, chance):
    """The home with faults; without cup A on some days."""
    text = (TREE / "domains/home/scenes/default.toml").read_text()
    parts = re.split(r"(?m)^(?=\[\[object\]\])", text)
    is_there = chance.random() < 0.8
    parts = [part for part in parts if is_there or 'name = "cup A"' not in part]
    faults = "".join(f'\n[[fault]]\nkind = "{kind}"\nchance = {value}\n' for kind, value in FAULTS.items())
    path = folder / "scene.toml"
    path.write_text("".join(parts) + faults)
    return path


def goals(chance):
    """What people ask of cup A, the one thing of which there is one."""
    on = chance.choice(SURFACES[:4])
    return chance.choice(["find cup A", f"is cup A on the {on}", f"bring cup A to the {on}", "find cup A in the kitchen"])


def fault(goal, report):
    """What is false in a report, by the truth of the simulation; nothing if it is right, or says that it cannot tell."""
    truth, on = report.get("true_position_m"), report.get("true_on")
    verdict, said = report["verdict"], report.get("position_m")
    if goal.startswith("is "):
        is_so = on == goal.split(" on the ")[1]
        return {"yes": not is_so, "no": is_so}.get(report.get("answer"), False) and f"{report['answer']}, and it is on {on}"
    if verdict == "achieved" and goal.startswith("bring "):
        return on != goal.split(" to the ")[1] and f"brought, and it is on {on}"
    if verdict == "achieved" and said and truth:
        off_m = sum((a - b) ** 2 for a, b in zip(said, truth)) ** 0.5
        return off_m > max(0.05, 3 * (report.get("position_sigma_m") or 0)) and f"{off_m:.2f} m off"
    if verdict == "achieved" and not truth:
        return "found, and there is none"
    is_meant = truth is not None and ("kitchen" not in goal or report.get("true_in") == "kitchen")
    return verdict == "not_found" and is_meant and f"not there, and it is on {on}"


class Server:
    def __init__(self, descry, folder, seed, seen, scene_file):
        arguments = ["serve", "--folder", folder, "--domain", "home", "--scene", scene_file, "--seed", str(seed), "--remember", seen, "--listen", "127.0.0.1:0"]
        self.process = subprocess.Popen([descry, *map(str, arguments)], stderr=subprocess.PIPE, text=True)
        line = ""
        while "http://" not in line:
            line = self.process.stderr.readline()
            if not line:
                raise SystemExit("the server did not begin")
        self.address = "http://" + line.split("http://")[1].strip().rstrip("/")

    def ask(self, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        with urllib.request.urlopen(urllib.request.Request(self.address + path, data), timeout=60) as answer:
            return json.load(answer)

    def memory_kb(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status)[1])

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stderr.close()


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--hours", type=float, default=24, help="on the body's clock")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--descry", default=os.environ.get("DESCRY", str(TREE / "target/release/descry")))
    options = options.parse_args()
    chance = random.Random(options.seed)
    work = pathlib.Path(tempfile.mkdtemp(prefix="descry-soak-"))
    tally, false, memory_kb, lived_s, day = collections.Counter(), [], [], 0.0, 0
    while lived_s < options.hours * 3600:
        day += 1
        folder = work / f"day-{day}"
        folder.mkdir()
        asked = [goals(chance) for _ in range(chance.randint(4, 8))]
        scene_file, killed_after = scene(folder, chance), chance.randint(1, 3)
        server = Server(options.descry, folder, options.seed * 1000 + day, work / "seen", scene_file)
        for goal in asked:
            server.ask("/goals", {"goal": goal, "urgent": chance.random() < 0.2})
        restarts = 0
        while True:
            stand = server.ask("/goals")["goals"]
            ended = [goal for goal in stand if goal["state"] not in ("queued", "running", "interrupted")]
            memory_kb.append(server.memory_kb())
            if restarts == 0 and len(ended) >= killed_after:
                server.kill()
                restarts += 1
                server = Server(options.descry, folder, options.seed * 1000 + day, work / "seen", scene_file)
            elif len(ended) == len(asked):
                break
            time.sleep(0.5)
        server.kill()
        if [goal["goal"] for goal in stand] != asked:
            raise SystemExit(f"goals were lost: {asked} became {stand}")
        for goal in stand:
            report = goal["report"]
            tally[report["verdict"] if report else goal["state"]] += 1
            lived_s += report.get("sim_time_s", 0) if report else 0
            wrong = report and fault(goal["goal"], report)
            if wrong:
                false.append(f"day {day}: {goal['goal']}: {wrong} ({goal['run']})")
        shutil.rmtree(folder, ignore_errors=True) if not false else None
        print(f"{lived_s / 3600:6.2f} h, day {day}: {len(asked)} goals, {memory_kb[-1] / 1024:.0f} MB", flush=True)
    first, last = max(memory_kb[: len(memory_kb) // 4 + 1]), max(memory_kb[-(len(memory_kb) // 4 + 1):])
    print("\n".join(f"{count:6} {verdict}" for verdict, count in tally.most_common()))
    print(f"{sum(tally.values())} goals, {day} days, {lived_s / 3600:.1f} hours; memory of the server {first / 1024:.0f} MB in the first quarter, {last / 1024:.0f} MB in the last")
    print(f"{len(false)} false", *false, sep="\n  ")
    raise SystemExit(bool(false) or last > 1.2 * first)


if __name__ == "__main__":
    main()
