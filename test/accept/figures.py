"""One line per figure of an acceptance run."""

import os

SECONDS = "QUAD_ACCEPT_SECONDS"


def seconds(default):
    """Return how long a run that has a duration is to take, in s."""
    return float(os.environ.get(SECONDS, default))


class Figures:
    """Prints figures as they come and remembers whether all kept their limits."""

    def __init__(self):
        self.failed = 0

    def at_most(self, name, value, limit, unit=""):
        """Print a measured value; a limit that is not kept, or NaN, is a failure."""
        self.check(value <= limit, f"{name}: {value:.4g} {unit}, limit {limit:g} {unit}")

    def check(self, kept, line):
        """Print any other finding."""
        self.failed += not kept
        print(f"{'ok  ' if kept else 'FAIL'} {' '.join(line.split()).replace(' ,', ',')}", flush=True)

    def code(self):
        """Return the exit code."""
        return 1 if self.failed else 0
