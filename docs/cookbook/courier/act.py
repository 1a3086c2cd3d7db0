"""The courier's body: it does what it is told. A real one would drive; an "error" instead of a value says why it could not."""
import json
import sys

for line in sys.stdin:
    question = json.loads(line)
    print(json.dumps({"id": question["id"], "value": " ".join([question["action"], *question["arguments"]])}), flush=True)
