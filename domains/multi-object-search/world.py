"""The household of the search task: what is where, what was seen, what time it is. Usage:

    python3 world.py reset [SEED]      begins again, as in the benchmark or with things laid out by a seed
    python3 world.py WORD              answers descry on standard input, one JSON line a question
"""

import json
import math
import random
import sys

PLACES = {"start": (-5, -5), "living-room": (0, 0), "kitchen": (10, 0), "bedroom": (0, 12), "office": (10, 12)}
TRUTH = {"notebook": "living-room", "pillow": "living-room", "clock": "kitchen", "mug": "kitchen", "knife": "bedroom"}
STEP_S = 5.0  # a search, a pick or a place
FILE = "world.json"


def prior(place):
    return 0.6 if place == "kitchen" else 0.4


def way_s(a, b):
    return math.dist(PLACES[a], PLACES[b])


def load():
    with open(FILE) as file:
        return json.load(file)


def reset(seed):
    truth = dict(TRUTH)
    if seed is not None:
        drawn = random.Random(seed)
        places = [p for p in PLACES if p != "start"]
        truth = {item: drawn.choices(places, [prior(p) for p in places])[0] for item in sorted(TRUTH)}
    save({"truth": truth, "seen": {}, "searched": [], "at": "start", "clock_s": 0.0})


def save(world):
    with open(FILE, "w") as file:
        json.dump(world, file)


def open_places(world):
    return [p for p in PLACES if p not in world["searched"]]


def search_time(world, item, place, planned):
    """What a search takes, and as much longer as it is likely to be in vain: (1 - p) / p of a search. What is searched for another
    thing by the same plan takes no time of its own."""
    p = prior(place) / sum(prior(p) for p in open_places(world))
    return (1 - p) / p * STEP_S + (0.0 if place in planned else STEP_S)


def act(world, action, arguments):
    seen = world["seen"]
    if action == "move":
        world["clock_s"] += way_s(world["at"], arguments[1])
        world["at"] = arguments[1]
        return "at " + arguments[1]
    world["clock_s"] += STEP_S
    item, place = arguments
    if action == "search":
        world["searched"].append(place)
        there = sorted(i for i, p in world["truth"].items() if p == place)
        seen.update({i: place for i in there})
        return "there: " + (", ".join(there) or "nothing")
    if action == "pick":
        seen[item] = "hand"
        world["truth"][item] = "hand"
    else:
        seen[item] = place
        world["truth"][item] = place
    return action + " " + item


def answer(word, world, question):
    if word == "act":
        said = act(world, question["action"], question["arguments"])
        save(world)
        return said
    if word == "way":
        return way_s(*question["arguments"])
    if word == "search-time":
        planned = {r["arguments"][0] for r in question.get("state", []) if r.get("value") is True}
        return search_time(world, *question["arguments"], planned - set(world["searched"]))
    if word == "located":
        return ["(located %s %s)" % (i, p) for i, p in sorted(world["seen"].items()) if p != "hand"]
    if word == "could-be":
        lost = sorted(i for i in world["truth"] if i not in world["seen"])
        return ["(could-be %s %s)" % (i, p) for i in lost for p in open_places(world)]
    return ["(= (clock-s) %.1f)" % world["clock_s"]]


def main():
    word = sys.argv[1]
    if word == "reset":
        reset(int(sys.argv[2]) if len(sys.argv) > 2 else None)
        return
    for line in sys.stdin:
        question = json.loads(line)
        value = answer(word, load(), question)
        print(json.dumps({"id": question["id"], "value": value}), flush=True)


if __name__ == "__main__":
    main()
