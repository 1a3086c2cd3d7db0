"""A nose and a thermometer. As an action, it measures; as a word, it states what was measured in this run."""
import json
import os
import sys
import tempfile

DUSTY = ["right-bench"]
DEGREES = {"left-bench": 21.0, "right-bench": 8.5}

# Every program of a run is a child of the same process.
measured = os.path.join(tempfile.gettempdir(), f"descry-dust-{os.getppid()}")


def lines():
    """Actions taken so far, as lists of words."""
    if not os.path.exists(measured):
        return []
    with open(measured, encoding="utf-8") as file:
        return [line.split() for line in file]


for line in sys.stdin:
    question = json.loads(line)
    if "action" in question:
        with open(measured, "a", encoding="utf-8") as file:
            print(question["action"], *question["arguments"], file=file)
        value = "done"
    elif question["fact"] == "dusty":
        sniffed = {words[2] for words in lines() if words[0] == "sniff"}
        value = [f"(dusty {on})" for on in sorted(sniffed) if on in DUSTY]
    else:
        felt = {words[2] for words in lines() if words[0] == "feel"}
        value = [f"(= (warmth {on}) {DEGREES[on]})" for on in sorted(felt)]
    print(json.dumps({"id": question["id"], "value": value}), flush=True)
