"""A simulated room on MuJoCo: recordings for descry, and a body that descry drives as a program."""

import os

# Without a display MuJoCo renders in software. A renderer that the environment names stays.
os.environ.setdefault("MUJOCO_GL", "osmesa")
