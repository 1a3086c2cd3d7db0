"""`python -m descry_mujoco record --scene floor --seed 1 --views 8 --out DIR`"""

from __future__ import annotations

import argparse
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
    from .scenes import SCENES

    parser = argparse.ArgumentParser(prog="descry_mujoco", description="A simulated room on MuJoCo, for descry.")
    commands = parser.add_subparsers(dest="command", required=True)
    record = commands.add_parser("record", help="write a folder of frames that `descry --robot recorded:DIR` reads")
    record.add_argument("--out", type=Path, required=True, help="the folder")
    record.add_argument("--views", type=int, default=8, help="frames, all round the tables")
    record.add_argument("--pose-error", type=pose_error, default=(0.0, 0.0), metavar="METRES,DEGREES", help="standard deviations of the stated poses")
    for command in (record,):
        command.add_argument("--scene", choices=sorted(SCENES), default="search")
        command.add_argument("--seed", type=int, default=1)
        command.add_argument("--holes", type=share, default=0.002, help="share of pixels without a return, 0 to 0.1; more on steep sides")
        command.add_argument("--noise", type=float, default=1.0, help="factor on the errors of disparity")
    given = parser.parse_args()
    if given.command == "record" and given.views < 1:
        parser.error("--views: at least one")
    return given


def main() -> None:
    given = arguments()
    from . import recording

    order = recording.Order(given.scene, given.seed, given.views, given.holes, given.noise, *given.pose_error)
    recording.record(order, given.out)
    print(given.out)
    sys.stdout.flush()


if __name__ == "__main__":
    main()
