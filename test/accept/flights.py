"""The whole-stack tests that take too long for scripts/test: missions in real time, all modes of the PX4 bridge."""

import subprocess
import sys
from pathlib import Path


def run(figures):
    command = [sys.executable, "-m", "pytest", "-q", "-m", "long", "--durations", "10"]
    code = subprocess.run(command, cwd=Path(__file__).parents[2], check=False).returncode
    figures.check(code == 0, f"long tests: exit code {code}")
