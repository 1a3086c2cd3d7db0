"""Answers of a map: seconds of a drive ("inf" where no road leads), and whether a road is open."""
import json
import sys

SECONDS = {("farm", "bridge"): 60, ("bridge", "town"): 60, ("farm", "ford"): 90, ("ford", "town"): 80}
CLOSED = {("bridge", "town")}

for line in sys.stdin:
    question = json.loads(line)
    way = tuple(question["arguments"])
    if question["kind"] == "cost":
        value = SECONDS.get(way, "inf")
    else:
        value = way not in CLOSED
    print(json.dumps({"id": question["id"], "value": value}), flush=True)
