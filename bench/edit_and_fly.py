"""How long an edited law takes until its vehicle flies, here and in another checkout, in turn.

Each round adds a comment to aibs.py, calls ``scripts/fly hover`` and takes the time from the call to the first state
in the bag. The first flight of each checkout is not counted; between flights whatever compiles in the background ends.

  .venv/bin/python bench/edit_and_fly.py ../older
  .venv/bin/python bench/edit_and_fly.py ../older --rounds 9
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from against import HERE, clean_environment, set_up
from mcap.reader import make_reader

LAW = Path("src/quad_position_ctrl/quad_position_ctrl/aibs.py")
SETTLED = 40.0  # s: what a flight compiles in the background takes less


@contextmanager
def edited(checkout: Path, number: int) -> Iterator[None]:
    """Have a comment that was never there before at the end of the law."""
    law = checkout / LAW
    original = law.read_text(encoding="utf-8")
    law.write_text(f"{original}\n# round {number} of {time.time_ns()}\n", encoding="utf-8")
    try:
        yield
    finally:
        law.write_text(original, encoding="utf-8")


def started_after(checkout: Path) -> float:
    """Return the s from the call of scripts/fly to the first state; raises RuntimeError if the flight fails."""
    with tempfile.TemporaryDirectory(prefix="edit-and-fly-") as folder:
        bag = Path(folder, "bag")
        words = ["scripts/fly", "hover", "--duration", "1", "--out", str(bag)]
        called = time.time()
        done = subprocess.run(words, cwd=checkout, env=clean_environment(), capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{checkout}: exit code {done.returncode}: {done.stderr[-400:]}")
        with next(bag.glob("*.mcap")).open("rb") as stream:
            _, _, state = next(make_reader(stream).iter_messages(["/state"]))
    return state.publish_time / 1e9 - called


def main() -> int:
    """Measure, print the medians and the ratio; returns the exit code."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    parser.add_argument("other", type=set_up, help="another checkout in which scripts/setup has run")
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="pairs of flights (default: 5)")
    options = parser.parse_args()
    checkouts = (HERE, options.other)
    found: tuple[list[float], list[float]] = ([], [])
    for number in range(options.rounds + 1):
        for which in (0, 1) if number % 2 else (1, 0):
            with edited(checkouts[which], number):
                taken = started_after(checkouts[which])
                time.sleep(SETTLED)
            print(f"round {number}, {checkouts[which]}: {taken:.2f} s", file=sys.stderr)
            if number:
                found[which].append(taken)
    ratios = [ours / theirs for ours, theirs in zip(*found, strict=True)]
    for checkout, times in zip(checkouts, found, strict=True):
        print(f"{checkout}: {statistics.median(times):.2f} s ({min(times):.2f} to {max(times):.2f})")
    print(f"ours over the other: {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
