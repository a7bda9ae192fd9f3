"""Every Python that the README promises: set-up from nothing in a clone with it, then a flight."""

import os
import subprocess
import tempfile
import time
from pathlib import Path

from figures import Figures
from flying import ROOT

VERSIONS = ("3.10", "3.11", "3.12", "3.13")
SETUP_LIMIT = 900.0  # s, packages cached, beside other work


def clean_environment():
    """Return the environment of a shell that has sourced nothing."""
    keep = ("HOME", "PATH", "USER", "LANG", "PYENV_ROOT", "UV_PYTHON_INSTALL_DIR", "XDG_DATA_HOME")
    pip = [name for name in os.environ if name.startswith("PIP_")]
    path = os.pathsep.join(part for part in os.environ["PATH"].split(os.pathsep) if str(ROOT) not in part)
    return {**{name: os.environ[name] for name in (*keep, *pip) if name in os.environ}, "PATH": path}


def interpreter(version):
    """Return the first Python of ``version`` that runs, empty if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    found = [f"python{version}", *map(str, sorted(pyenv.glob(f"{version}.*/bin/python{version}")))]
    for candidate in found:
        # A version manager's shim may be on the PATH and fail.
        words = ["bash", "-c", f"{candidate} -c pass"]
        if subprocess.run(words, env=clean_environment(), capture_output=True, check=False).returncode == 0:
            return candidate
    return ""


def set_up(figures, version, python, folder):
    """Set a clone up from nothing with ``python`` and fly in it."""
    clone = Path(folder, "clone")
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    clean = clean_environment()
    began = time.monotonic()
    done = subprocess.run([clone / "scripts/setup"], cwd=clone, env={**clean, "PYTHON": python}, check=False)
    seconds = time.monotonic() - began
    figures.check(done.returncode == 0, f"Python {version}: scripts/setup: exit code {done.returncode}")
    figures.at_most(f"Python {version}: scripts/setup", seconds, SETUP_LIMIT, "s")
    if done.returncode != 0:
        return
    made = subprocess.run([clone / ".venv/bin/python", "-V"], capture_output=True, text=True, check=False)
    figures.check(made.stdout.startswith(f"Python {version}."), f"Python {version}: .venv has {made.stdout}")
    flight = [clone / "scripts/fly", "hover", "--duration", "0.5"]
    done = subprocess.run(flight, cwd=clone, env=clean, capture_output=True, text=True, check=False)
    last = (done.stdout + done.stderr).strip().splitlines()[-1:]
    figures.check(done.returncode == 0, f"Python {version}: scripts/fly hover: exit code {done.returncode} {last}")


def main():
    figures = Figures()
    for version in os.environ.get("QUAD_ACCEPT_PYTHONS", " ".join(VERSIONS)).split():
        python = interpreter(version)
        if not python:
            figures.check(False, f"Python {version}: none found on this machine")
            continue
        with tempfile.TemporaryDirectory(prefix=f"python-{version}-") as folder:
            set_up(figures, version, python, folder)
    return figures.code()
