"""A stage and a vehicle interface of a user, each from a scratch workspace: built, flown, recorded, replayed."""

import subprocess
import sys

from figures import Figures
from flying import ROOT

TESTS = ("test/test_new_stage.py", "test/test_vehicle_interface.py")


def main():
    figures = Figures()
    for test in TESTS:
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", test]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        figures.check(done.returncode == 0, f"{test}: {done.stdout.strip().splitlines()[-1]}")
        if done.returncode:
            print(done.stdout[-3000:] + done.stderr[-1000:])
    return figures.code()
