"""Ways to lose or misjudge a vehicle: how each ended before, and what the tests of ``reproductions.yaml`` see now."""

from pathlib import Path

from findings import shown


def main():
    return shown(Path(__file__).with_suffix(".yaml"))
