"""One-token mistakes in laws and plants: unit tests notice every one of them."""

import subprocess

from figures import Figures
from flying import ROOT


def main():
    figures = Figures()
    done = subprocess.run([ROOT / "scripts/mutate", "-j", "2"], capture_output=True, text=True, check=False)
    print(done.stdout, end="")
    print(done.stderr, end="")
    verdict = (done.stdout.strip().splitlines() or ["nothing"])[-1]
    figures.check(done.returncode == 0, f"scripts/mutate: {verdict}")
    return figures.code()
