"""Two hundred goals of four clients for `descry serve`, some urgent, some cancelled, and a kill in the middle: each ends once, in a verdict,
and the server keeps in memory no more than their reports.

    DESCRY=target/release/descry python3 cli/tests/serve_load.py [GOALS]
"""

import collections
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

SAID = ("find mug", "is there a mug on the table", "find the unknown", "find cup A")
CLIENTS, OVER, REPORT_KB = 4, ("ended", "cancelled"), 200


class Server:
    def __init__(self, folder):
        command = [os.environ["DESCRY"], "serve", "--listen", "127.0.0.1:0", "--folder", str(folder)]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        line = next(line for line in self.process.stderr if "http://" in line)
        self.address = "http://" + line.split("http://")[1].strip().strip("/")
        threading.Thread(target=self.process.stderr.read, daemon=True).start()

    def ask(self, method, path, **body):
        request = urllib.request.Request(f"{self.address}/{path}", json.dumps(body).encode() if body else None, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)

    def over(self):
        return sum(goal["state"] in OVER for goal in self.ask("GET", "goals")["goals"])

    def resident_kb(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmRSS:")).split()[1])

    def wait(self, count, seconds):
        until = time.monotonic() + seconds
        while self.over() < count:
            assert time.monotonic() < until, f"{self.over()} of {count} are over"
            time.sleep(0.5)


def clients(server, goals):
    """Four clients at once: every fifth of their goals is urgent, every fourth is cancelled."""
    given = []

    def one():
        for n in range(goals // CLIENTS):
            goal = server.ask("POST", "goals", goal=SAID[n % len(SAID)], urgent=n % 5 == 0)["id"]
            given.append(goal)
            if n % 4 == 3:
                server.ask("DELETE", f"goals/{goal}")

    all_of_them = [threading.Thread(target=one) for _ in range(CLIENTS)]
    [client.start() for client in all_of_them]
    [client.join() for client in all_of_them]
    return given


def main(goals):
    with tempfile.TemporaryDirectory() as folder:
        server = Server(folder)
        given = clients(server, goals // 2)
        server.wait(goals // 4, 3600)
        server.process.kill()
        server.process.wait()
        server = Server(folder)
        given += clients(server, goals - goals // 2)
        before_kb = server.resident_kb()
        server.wait(len(given), 7200)
        after_kb = server.resident_kb()
        for goal in server.ask("GET", "goals")["goals"]:
            assert goal["state"] != "ended" or goal["report"]["verdict"], goal
        server.process.terminate()
        server.process.wait()
        lines = (pathlib.Path(folder) / "goals.jsonl").read_text().splitlines()
    ends = collections.Counter(line["id"] for line in map(json.loads, lines) if line.get("state") in OVER)
    assert sorted(ends) == sorted(given) and set(ends.values()) == {1}, ends
    assert after_kb < before_kb + REPORT_KB * len(given), f"{before_kb} kB before, {after_kb} kB after"
    print(f"{len(given)} goals ended once each; {before_kb} kB with them queued, {after_kb} kB after them")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
