"""Other people's packages in an environment of their own, fetched by name at the first use."""

import os
import pathlib
import subprocess
import sys

HOME = pathlib.Path(os.environ.get("DESCRY_BRIDGES", pathlib.Path.home() / ".cache" / "descry" / "bridges"))


def run_in(name, packages):
    """Runs this program again in the environment `name`, where `packages` are; returns when it is there already."""
    folder = HOME / name
    if pathlib.Path(sys.prefix) == folder:
        return
    python, listed = folder / "bin" / "python", folder / "packages.txt"
    if not listed.exists() or listed.read_text() != "\n".join(packages):
        print(f"fetching {', '.join(packages)} into {folder}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", *packages], check=True)
        listed.write_text("\n".join(packages))
    os.execv(python, [str(python), *sys.argv])
