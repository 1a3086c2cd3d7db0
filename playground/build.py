"""Makes docs/playground/index.html, one page that needs nothing else: python3 playground/build.py [--test]

`rustup target add wasm32-unknown-unknown` once before. --test also loads the page in Chromium and looks for the plan.
"""

import base64
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
EXAMPLES = ["breakfast", "ferry", "fuel", "market", "wishes"]
SMALL = {"OPT_LEVEL": "s", "LTO": "true", "PANIC": "abort", "STRIP": "true", "DEBUG": "false"}


def build() -> bytes:
    env = dict(os.environ, **{f"CARGO_PROFILE_RELEASE_{key}": value for key, value in SMALL.items()})
    subprocess.run(["cargo", "build", "--release", "--locked", "--target", "wasm32-unknown-unknown", "-p", "descry-playground"], cwd=ROOT, env=env, check=True)
    return (TARGET / "wasm32-unknown-unknown/release/descry_playground.wasm").read_bytes()


def page(wasm: bytes) -> str:
    texts = {name: [(ROOT / "docs/cookbook" / name / f"{what}.pddl").read_text() for what in ["domain", "problem"]] for name in EXAMPLES}
    text = (ROOT / "playground/page.html").read_text()
    text = text.replace("/*EXAMPLES*/{}", json.dumps(texts).replace("</", "<\\/"))
    return text.replace("/*WASM*/", base64.b64encode(wasm).decode())


def test(file: pathlib.Path) -> None:
    began = time.monotonic()
    drawn = subprocess.run(
        ["chromium", "--headless=new", "--no-sandbox", "--virtual-time-budget=2000", "--dump-dom", f"file://{file}"],
        capture_output=True, text=True, check=True,
    ).stdout
    for part in ["plan found in", "(toast rye)", "<rect", "no plan within"]:
        shown = part in drawn.split("<script>")[0]
        assert shown == (part != "no plan within"), f"{part} {'is not' if not shown else 'is'} on the page"
    print(f"the page shows its first plan; Chromium took {time.monotonic() - began:.1f} s in all")


def main() -> None:
    made = ROOT / "docs/playground/index.html"
    made.parent.mkdir(exist_ok=True)
    made.write_text(page(build()))
    print(f"{made.relative_to(ROOT)}: {made.stat().st_size} bytes")
    if "--test" in sys.argv:
        test(made)


main()
