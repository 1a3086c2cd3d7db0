"""The file that says what a ROS 2 robot calls its topics, frames and joints."""

import math

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

REQUIRED = object()

# Every key, with the value that it has when it is left out; None: the robot does without.
KEYS = {
    "name": "ROS 2 robot",
    "simulated": False,
    "frames": {"map": "map", "base": "base_link", "camera": REQUIRED, "laser": None},
    "topics": {"depth": REQUIRED, "camera_info": REQUIRED, "colour": None, "map": "map", "scan": None, "localisation": None},
    "camera": {"range_m": [0.4, 6.0], "metres_per_unit": None},
    "localisation": {"sigma_m": 0.05, "sigma_rad": 0.05},
    "base": {"radius_m": None, "footprint_m": None, "linear_m_s": 0.4, "angular_rad_s": 0.8, "clearance_m": 0.05},
    "navigation": {"action": "navigate_to_pose", "arrived_m": 0.25, "arrived_rad": 0.35},
    "head": {"trajectory": REQUIRED, "pan": REQUIRED, "tilt": REQUIRED, "base_from_head": REQUIRED, "pan_limit_rad": 2.6,
             "tilt_down_rad": 1.2, "tilt_up_rad": 0.8},
    "hand": {"grasp": REQUIRED, "place": REQUIRED, "holding": REQUIRED, "reach_m": REQUIRED, "opening_m": REQUIRED},
    "waits": {"start_s": 30.0, "frame_s": 3.0, "transform_s": 0.5, "late_s": 1.0, "head_s": 5.0},
    "surface": [],
    "room": [],
    "door": [],
}
# Parts that the robot lacks when their table is left out.
PARTS = ("head", "hand")


class Wrong(Exception):
    """What in the file is not as it must be, and what was expected."""


def read(path):
    """The settings in a file, as nested dictionaries with every key."""
    try:
        with open(path, "rb") as file:
            given = tomllib.load(file)
    except OSError as why:
        raise Wrong(f"cannot be read: {why.strerror}") from None
    except tomllib.TOMLDecodeError as why:
        raise Wrong(f"is no TOML: {why}") from None
    settings = {key: table(key, given, usual) for key, usual in KEYS.items()}
    unknown = sorted(set(given) - set(KEYS))
    if unknown:
        raise Wrong(f"there is no key `{unknown[0]}`; there are {', '.join(KEYS)}")
    base = settings["base"]
    if (base["radius_m"] is None) == (base["footprint_m"] is None):
        raise Wrong("[base] needs either `radius_m` or `footprint_m`, the corners of the footprint")
    for path, value in numbers(settings):
        if not math.isfinite(value):
            raise Wrong(f"{path} is {value}; a finite number was expected")
    return settings


def table(key, given, usual):
    value = given.get(key, usual)
    if not isinstance(usual, dict):
        if not isinstance(value, type(usual)):
            raise Wrong(f"`{key}` is {value!r}; expected as in {usual!r}")
        return value
    if key not in given and key in PARTS:
        return None
    own = given.get(key, {})
    if not isinstance(own, dict):
        raise Wrong(f"`{key}` is {own!r}; a table [{key}] was expected")
    for name in own:
        if name not in usual:
            raise Wrong(f"[{key}] has no key `{name}`; it has {', '.join(usual)}")
    for name, value in usual.items():
        if value is REQUIRED and name not in own:
            raise Wrong(f"[{key}] needs `{name}`")
    return {name: own.get(name, value) for name, value in usual.items()}


def numbers(value, path=""):
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from numbers(inner, f"{path}.{key}".strip("."))
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from numbers(inner, f"{path}.{number}")
    elif isinstance(value, float):
        yield path, value
