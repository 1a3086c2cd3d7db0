"""`python -m descry_mujoco record --scene floor --seed 1 --views 8 --out DIR`, `python -m descry_mujoco serve --scene search --seed 1`"""

from __future__ import annotations

import argparse
import math
import os
import sys
from pathlib import Path


def share(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 0.1:
        raise argparse.ArgumentTypeError(f"{text}: a share from 0 to 0.1")
    return value


def pose_error(text: str) -> tuple[float, float]:
    try:
        metres, degrees = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text}: METRES,DEGREES such as 0.03,1.2") from None
    if metres < 0.0 or degrees < 0.0:
        raise argparse.ArgumentTypeError(f"{text}: standard deviations are not below zero")
    return metres, degrees


def arguments() -> argparse.Namespace:
    from .stage import SCENES

    parser = argparse.ArgumentParser(prog="descry_mujoco", description="A simulated room on MuJoCo, for descry.")
    commands = parser.add_subparsers(dest="command", required=True)
    record = commands.add_parser("record", help="write a folder of frames that `descry --robot recorded:DIR` reads")
    record.add_argument("--out", type=Path, required=True, help="the folder")
    record.add_argument("--views", type=int, default=8, help="frames, all round the tables")
    record.add_argument("--pose-error", type=pose_error, default=(0.0, 0.0), metavar="METRES,DEGREES", help="standard deviations of the stated poses")
    serve = commands.add_parser("serve", help="be a robot: `descry --robot \"program:…\"`")
    serve.add_argument("--pose-error", type=pose_error, default=(0.03, 2.0), metavar="METRES,DEGREES", help="standard deviations of localisation")
    serve.add_argument("--truth", type=Path, help="write there how everything really stands, for reports")
    serve.add_argument("--listen", metavar="HOST:PORT", help="wait for who connects, instead of standard input and output")
    serve.add_argument("--visit", type=int, choices=range(1, 5), default=1, help="of the households: what has come by then")
    serve.add_argument("--without", default="", metavar="KINDS", help="kinds of things that are taken away first, with commas between")
    for command in (record, serve):
        # A recording goes round tables that stand together.
        known = sorted(name for name in SCENES if command is serve or name not in ("home", "household", "shared-household"))
        command.add_argument("--scene", choices=known, default="search")
        command.add_argument("--seed", type=int, default=1)
        command.add_argument("--holes", type=share, default=0.002, help="share of pixels without a return, 0 to 0.1; more on steep sides")
        command.add_argument("--noise", type=float, default=1.0, help="factor on the errors of disparity")
    given = parser.parse_args()
    if given.command == "record" and given.views < 1:
        parser.error("--views: at least one")
    return given


def record(given: argparse.Namespace) -> None:
    from . import recording

    order = recording.Order(given.scene, given.seed, given.views, given.holes, given.noise, *given.pose_error)
    recording.record(order, given.out)
    print(given.out)


def serve(given: argparse.Namespace) -> None:
    import descry_robot

    from . import body, household, stage

    # Where nothing comes or goes every visit is the same.
    scene = household.of_visit(stage.arrange(given.scene, given.seed), given.visit)
    # Nobody errs in the same way at every visit.
    seed = given.seed + 1_000_003 * (given.visit - 1)
    scene.start = stage.start_pose(scene)
    scene = scene.without(given.without.split(","))
    metres, degrees = given.pose_error
    settings = body.Settings(seed, metres, math.radians(degrees), given.holes, given.noise, given.truth)
    descry_robot.serve(body.Body(scene, settings), given.listen)


def main() -> None:
    given = arguments()
    {"record": record, "serve": serve}[given.command](given)
    # The renderer's own clean-up at the end of Python complains about its order.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
