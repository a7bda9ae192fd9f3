"""What every acceptance run has: a folder, its options, and one line per figure.

A run is a module with ``run(figures)``; ``scripts/accept`` starts this file with the module's name.
"""

import importlib
import os
import re
import sys
import tempfile
from pathlib import Path


class Figures:
    """Prints figures as they come and counts those that miss their limits; ``folder`` is the run's own."""

    def __init__(self, folder):
        self.folder, self.failed = folder, 0
        self.asked_for = {}  # {kind: whether its name was asked for}

    def at_most(self, name, value, limit, unit=""):
        """Print a measured value; a limit that is not kept, or NaN, is a failure."""
        self.check(value <= limit, f"{name}: {value:.4g} {unit}, limit {limit:g} {unit}")

    def check(self, kept, line):
        """Print any other finding."""
        self.failed += not kept
        print(f"{'ok  ' if kept else 'FAIL'} {' '.join(line.split()).replace(' ,', ',')}", flush=True)

    def show(self, line):
        """Print what is not judged."""
        print(f"     {line}", flush=True)

    def seconds(self, default):
        """Return how long a run that has a duration is to take, in s."""
        return float(os.environ.get("QUAD_ACCEPT_SECONDS", default))

    def each(self, default):
        """Return how many of each kind are asked for."""
        return int(os.environ.get("QUAD_ACCEPT_EACH", default))

    def wants(self, name):
        """Return whether a kind is asked for by its name."""
        self.asked_for[name] = re.search(os.environ.get("QUAD_ACCEPT_ONLY", ""), name) is not None
        return self.asked_for[name]

    def code(self):
        """Return the exit code: 0 all kept, 1 a figure missed its limit, 2 no kind has the name that was asked for."""
        if self.asked_for and not any(self.asked_for.values()):
            kinds = "; ".join(self.asked_for)
            print(f"--only: found {os.environ['QUAD_ACCEPT_ONLY']!r}, expected part of one of {kinds}", file=sys.stderr)
            return 2
        return 1 if self.failed else 0


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix=f"{sys.argv[1]}-") as made:
        found = Figures(Path(made))
        importlib.import_module(sys.argv[1]).run(found)
    sys.exit(found.code())
