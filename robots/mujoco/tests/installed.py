"""Whether MuJoCo and a renderer are here. Where they are not, the tests say so loudly and are skipped."""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

try:
    import descry_mujoco  # noqa: F401  chooses the renderer before MuJoCo is loaded
    import mujoco

    mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8).close()
    MISSING = None
except Exception as error:  # every way in which an installation can fall short
    MISSING = f"{type(error).__name__}: {error}"
    print(f"SKIPPED: the room on MuJoCo is not tested: {MISSING}", file=sys.stderr)

needs_mujoco = unittest.skipIf(MISSING, MISSING)
