"""One-token mistakes in laws and plants: unit tests notice each, and those that the paper map names notice theirs."""

import subprocess

from figures import Figures
from flying import ROOT


def main():
    figures = Figures()
    for options in ([], ["--map"]):
        command = [ROOT / "scripts/mutate", *options, "-j", "2"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        print(done.stdout, end="")
        print(done.stderr, end="")
        verdict = (done.stdout.strip().splitlines() or ["nothing"])[-1]
        figures.check(done.returncode == 0, f"{' '.join(['scripts/mutate', *options])}: {verdict}")
    return figures.code()
