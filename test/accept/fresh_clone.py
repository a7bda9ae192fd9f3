"""A fresh clone: time of scripts/setup with packages cached, then scripts/fly as a newcomer types it."""

import os
import subprocess
import tempfile
import time
from pathlib import Path

from figures import Figures
from flying import ROOT

SETUP_LIMIT = 180.0


def main():
    figures = Figures()
    keep = ("HOME", "PATH", "USER", "LANG", "PYTHON", "PIP_CACHE_DIR", "PIP_CONFIG_FILE", "PIP_INDEX_URL")
    path = os.pathsep.join(part for part in os.environ["PATH"].split(os.pathsep) if str(ROOT) not in part)
    clean = {**{name: os.environ[name] for name in keep if name in os.environ}, "PATH": path}
    with tempfile.TemporaryDirectory(prefix="fresh-") as folder:
        clone = Path(folder, "clone")
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
        began = time.monotonic()
        done = subprocess.run([clone / "scripts/setup"], cwd=clone, env=clean, check=False)
        seconds = time.monotonic() - began
        figures.check(done.returncode == 0, f"scripts/setup: exit code {done.returncode}")
        figures.at_most("scripts/setup: time, packages cached", seconds, SETUP_LIMIT, "s")
        began = time.monotonic()
        subprocess.run([clone / "scripts/setup"], cwd=clone, env=clean, check=True)
        print(f"     scripts/setup again: {time.monotonic() - began:.2f} s")
        began = time.monotonic()
        done = subprocess.run([clone / "scripts/fly"], cwd=clone, env=clean, check=False)
        seconds = time.monotonic() - began
        figures.check(
            done.returncode == 0, f"scripts/fly, both cases: exit code {done.returncode} after {seconds:.0f} s"
        )
    return figures.code()
