"""A fresh clone with each Python that the README promises: time of scripts/setup, then scripts/fly as a user types it.

QUAD_ACCEPT_PYTHONS names the versions; a version that this machine lacks is said and left out.
"""

import os
import subprocess
import time
from pathlib import Path

from flying import ROOT

VERSIONS = ("3.12", "3.10", "3.11", "3.13")
SETUP_LIMIT = 180.0  # s, packages cached


def clean_environment():
    """Return the environment of a shell that has sourced nothing."""
    keep = ("HOME", "USER", "LANG", "PYENV_ROOT", "XDG_DATA_HOME", *(name for name in os.environ if "PIP_" in name))
    path = os.pathsep.join(part for part in os.environ["PATH"].split(os.pathsep) if str(ROOT) not in part)
    return {**{name: os.environ[name] for name in keep if name in os.environ}, "PATH": path}


def interpreter(version):
    """Return the first Python of ``version`` that runs, empty if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    for candidate in [f"python{version}", *map(str, sorted(pyenv.glob(f"{version}.*/bin/python{version}")))]:
        # a version manager's shim may be on the PATH and fail
        words = ["bash", "-c", f"{candidate} -c pass"]
        if subprocess.run(words, env=clean_environment(), capture_output=True, check=False).returncode == 0:
            return candidate
    return ""


def timed(words, clone, **changes):
    """Return the exit code of ``words`` in the clone, and how many s they took."""
    began = time.monotonic()
    done = subprocess.run(words, cwd=clone, env={**clean_environment(), **changes}, check=False)
    return done.returncode, time.monotonic() - began


def run(figures):
    for version in os.environ.get("QUAD_ACCEPT_PYTHONS", " ".join(VERSIONS)).split():
        python = interpreter(version)
        if not python:
            figures.show(f"Python {version}: none found on this machine")
            continue
        clone = figures.folder / f"Flüge und mehr {version}"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
        code, seconds = timed([clone / "scripts/setup"], clone, PYTHON=python)
        figures.check(code == 0, f"Python {version}: scripts/setup: exit code {code}")
        figures.at_most(f"Python {version}: scripts/setup, packages cached", seconds, SETUP_LIMIT, "s")
        flight = ["hover", "--duration", "0.5"] if version != VERSIONS[0] else []
        code, seconds = timed([clone / "scripts/fly", *flight], clone)
        what = " ".join(["scripts/fly", *flight])
        figures.check(code == 0, f"Python {version}: {what}: exit code {code} after {seconds:.0f} s")
