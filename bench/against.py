"""This checkout beside another one that is set up, round by round: cycles over ROS, steps of the batch.

Every round runs both, the other one first in every second round; what counts are the ratios of the pairs.

  .venv/bin/python bench/against.py ../older
  .venv/bin/python bench/against.py ../older --rounds 9 --only batch
"""

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
_FLIGHT = "import ros_runs as r; f = r.stack({}); print(f.rate, 1e6 / f.cpu_per_cycle)"
# Each text prints what was done per s of wall time and of CPU time; it runs in the bench folder of its own checkout.
MEASURED = {
    "five processes": _FLIGHT.format("r.Request('hover', duration=20.0)"),
    "one process": _FLIGHT.format("r.Request('hover', duration=20.0), True"),
    "batch": "import batch as b; c = b.campaign(); b.fly_numbers(c, [0]); print(*b.rates(c, 40, 2))",
}


def clean_environment() -> dict[str, str]:
    """Return an environment without anything of the checkout that this process runs in."""
    given = {name: os.environ[name] for name in ("HOME", "LANG") if name in os.environ}
    return {**given, "PATH": "/usr/local/bin:/usr/bin:/bin"}


def set_up(text: str) -> Path:
    """Return the checkout at the path ``text``; raises ArgumentTypeError if scripts/setup has not run there."""
    if not Path(text, "scripts/env.sh").is_file():
        raise argparse.ArgumentTypeError(f"{text}: found no scripts/env.sh, expected a checkout that is set up")
    return Path(text)


def measured(checkout: Path, text: str) -> tuple[float, float]:
    """Return the two figures that ``text`` prints in ``checkout``; raises RuntimeError with its last lines."""
    command = ["bash", "-c", 'source scripts/env.sh && cd bench && exec python -c "$1"', "bash", text]
    done = subprocess.run(command, cwd=checkout, env=clean_environment(), capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{checkout}: exit code {done.returncode}: {done.stderr[-400:]}")
    wall, processor = done.stdout.split()[-2:]
    return float(wall), float(processor)


def main() -> int:
    """Measure, print one line per figure; returns the exit code."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    parser.add_argument("other", type=set_up, help="another checkout in which scripts/setup has run")
    parser.add_argument("--rounds", type=int, default=7, metavar="N", help="pairs of each figure (default: 7)")
    parser.add_argument("--only", choices=MEASURED, action="append", help="only this figure; may be repeated")
    options = parser.parse_args()
    for name in options.only or MEASURED:
        pairs = []
        for number in range(options.rounds):
            order = (HERE, options.other) if number % 2 else (options.other, HERE)
            found = {checkout: measured(checkout, MEASURED[name]) for checkout in order}
            pairs.append((found[HERE], found[options.other]))
            print(f"{name} {number + 1}: {pairs[-1]}", file=sys.stderr)
        for index, kind in enumerate(("wall", "CPU")):
            ratios = [ours[index] / theirs[index] for ours, theirs in pairs]
            text = f"{statistics.median(ratios):.3f} of the other ({min(ratios):.3f} to {max(ratios):.3f})"
            print(f"{name}, per s of {kind} time: {text}, {len(ratios)} pairs", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
