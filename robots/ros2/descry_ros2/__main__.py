"""`python3 -m descry_ros2 robot.toml` is a robot: `descry find "cup A" --robot "program:python3 -m descry_ros2 robot.toml"`.

`python3 -m descry_ros2 pursue -- --domain home --robot …` offers the action `pursue` to others; what follows `--` are options of `descry do`.
"""

import pathlib
import sys

try:
    import descry_robot
except ImportError:  # in a checkout it lies beside this package
    sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))
    import descry_robot

USAGE = "usage: python3 -m descry_ros2 ROBOT.toml [SOCKET]\n       python3 -m descry_ros2 pursue [DESCRY] [-- OPTIONS OF DESCRY DO]"


def main(arguments):
    if arguments[:1] == ["pursue"]:
        from . import pursue

        at = arguments.index("--") if "--" in arguments else len(arguments)
        return pursue.serve((arguments[1:at] or ["descry"])[0], arguments[at + 1 :])
    if not 1 <= len(arguments) <= 2 or arguments[0].startswith("-"):
        sys.exit(USAGE)
    from . import body, config

    try:
        robot = body.Body(config.read(arguments[0]))
    except (config.Wrong, body.Silent) as why:
        sys.exit(f"{arguments[0]}: {why}")
    try:
        descry_robot.serve(robot, *arguments[1:])
    finally:
        robot.close()


main(sys.argv[1:])
