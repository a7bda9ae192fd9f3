"""Measures the stack beside its floor and its peers, and prints one table.

Figures are medians of rounds in this very run; what is compared is measured in turn. examples:
  scripts/bench                    everything
  scripts/bench batch --rounds 5
  scripts/bench ros_loop --json ros.json
  scripts/bench companion --rounds 1 --json my_computer.json     what this computer can fly: five minutes
"""

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

from table import Row, as_text, versions

BENCHES = ("ros_loop", "batch", "laws", "guard_cost", "peers", "companion")


def main() -> int:
    """Measure what was asked for; returns the exit code."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="bench", description=__doc__, formatter_class=formatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BENCHES)} (default: all)")
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="rounds of each measurement (default: 5)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also store the rows, all values, and the versions")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in BENCHES]
    if unknown or options.rounds < 1:
        parser.error(f"found {unknown or options.rounds}, expected {', '.join(BENCHES)} and at least 1 round")
    rows: list[Row] = []
    for name in options.names or BENCHES:
        sys.stderr.write(f"bench: {name} ...\n")
        rows += importlib.import_module(name).measure(options.rounds)
    facts = {**versions(), "load": " ".join(f"{load:.1f}" for load in os.getloadavg())}
    print(as_text(rows))
    print("\n" + ", ".join(f"{key} {value}" for key, value in facts.items()))
    if options.json:
        content = {"versions": facts, "rows": [row._asdict() for row in rows]}
        options.json.write_text(json.dumps(content, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
