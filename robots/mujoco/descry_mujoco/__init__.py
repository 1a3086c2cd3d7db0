"""A simulated room on MuJoCo: recordings for descry, and a body that descry drives as a program."""

import os
import sys
from pathlib import Path

# Without a display MuJoCo renders in software. A renderer that the environment names stays.
os.environ.setdefault("MUJOCO_GL", "osmesa")
# The helpers for robots in Python lie beside this package.
sys.path.append(str(Path(__file__).resolve().parents[2] / "python"))
