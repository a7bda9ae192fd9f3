"""The long acceptance runs: each prints one line per figure and fails if a figure misses its limit.

A run is a module in test/accept with run(figures). Exit code: 0 all kept, 1 a run failed, 2 bad usage or set-up.

Examples:
  scripts/accept --list
  scripts/accept                 all of them (hours on two cores)
  scripts/accept laws stops      only these
  scripts/accept fuzz --seconds 600
"""

import argparse
import ast
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
RUNS = ROOT / "test" / "accept"


class Outcome(NamedTuple):
    """How a run ended, after how many s."""

    name: str
    code: int
    seconds: float


def summaries() -> dict[str, str]:
    """Return {name: first line of its docstring} of all runs: the modules that have a run()."""
    found = {}
    for path in sorted(RUNS.glob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "run" for node in tree.body):
            found[path.stem] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return found


def run(name: str) -> Outcome:
    """Run one in a process of its own, its lines straight to our output."""
    print(f"== {name}: {summaries()[name]}", flush=True)
    began = time.monotonic()
    paths = os.pathsep.join(
        [
            str(RUNS),
            str(ROOT / "test"),
            *(str(ROOT / "src" / name / "test") for name in ("quad_flight_log", "quad_report", "quad_identify")),
            str(Path(__file__).parent),
            os.environ.get("PYTHONPATH", ""),
        ]
    )
    command = [sys.executable, str(RUNS / "figures.py"), name]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": paths}, check=False)
    return Outcome(name, done.returncode, time.monotonic() - began)


def main() -> int:
    """Run what the command line names; returns the exit code."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="scripts/accept", description=__doc__, formatter_class=formatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="which runs (default: all)")
    parser.add_argument("--list", action="store_true", help="name the runs and end")
    parser.add_argument("--seconds", type=float, metavar="S", help="duration of the runs that have one: fuzz, soak")
    parser.add_argument("--each", type=int, metavar="N", help="flights or throws of each kind")
    parser.add_argument("--only", metavar="PATTERN", help="only kinds whose name holds this regular expression")
    options = parser.parse_args()
    for name in ("seconds", "each", "only"):
        if getattr(options, name) is not None:
            os.environ[f"QUAD_ACCEPT_{name.upper()}"] = str(getattr(options, name))
    known = summaries()
    if options.list:
        width = max(map(len, known))
        print("\n".join(f"{name.ljust(width)}  {text}" for name, text in known.items()))
        return 0
    unknown = [name for name in options.names if name not in known]
    if unknown:
        parser.error(f"no run {unknown[0]!r}; expected {', '.join(known)}")
    outcomes = [run(name) for name in options.names or known]
    print("== summary")
    for outcome in outcomes:
        print(f"{'passed' if outcome.code == 0 else 'FAILED'}  {outcome.name} ({outcome.seconds:.0f} s)")
    bad = {outcome.code for outcome in outcomes} - {0}
    return 0 if not bad else 2 if bad == {2} else 1


if __name__ == "__main__":
    sys.exit(main())
