"""A workspace of a user on top of this one: packages of examples, built by colcon."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_COLCON = "import sys; from colcon_core.command import main; sys.exit(main())"


def built(folder: Path, *packages: str) -> dict[str, str]:
    """Build ``packages``, folders of examples, in workspace ``folder``; return the environment of a shell there.

    The shell has sourced this workspace first. Raises CalledProcessError with the output of a build that fails.
    """
    for package in packages:
        shutil.copytree(ROOT / "examples" / package, folder / "src" / Path(package).name)
    python = f"-DPython3_EXECUTABLE={sys.executable}"
    command = [sys.executable, "-c", _COLCON, "--log-base", "log", "build", "--cmake-args", "-G", "Ninja", python]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True, timeout=280)
    shell = ["bash", "-c", "source install/local_setup.bash && env -0"]
    listed = subprocess.run(shell, cwd=folder, check=True, capture_output=True, text=True, timeout=60)
    found = dict(line.split("=", 1) for line in listed.stdout.split("\0") if "=" in line)
    return {**os.environ, **found}


def changed_files() -> str:
    """Return what git sees as changed in this repository."""
    command = ["git", "status", "--porcelain"]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, timeout=60).stdout
