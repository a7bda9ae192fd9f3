"""kill -9 of each node in turn during flights over ROS, four times each: named cause, exit 1, at most 0.3 s lost."""

import os
import random
import signal
import tempfile
import time
from pathlib import Path

from figures import Figures
from flying import ROLES, bag_file, finish, last_reception, start, wait_until_flying

from quad_flight_log.bag.reader import open_flight

EACH = 4
LIMIT = 0.3


def kill(role, out, delay):
    """Return (how the flight ended, s of wall clock lost) after ``role`` was killed ``delay`` s into a flight."""
    flight = start("case1", "--out", out)
    pids = wait_until_flying(flight, out)
    time.sleep(delay)
    killed = time.time()
    os.kill(pids[role], signal.SIGKILL)
    done = finish(flight)
    return done, killed - last_reception(bag_file(out))


def main():
    figures = Figures()
    draw = random.Random(1)
    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        for role in ROLES:
            worst = 0.0
            for number in range(EACH):
                out = Path(folder, f"{role}-{number}")
                done, lost = kill(role, out, draw.uniform(0.0, 3.0))
                named = done.returncode == 1 and f"{role} was killed by SIGKILL" in done.stderr
                flown = open_flight(out).array("truth")["stamp_ns"][-1] * 1e-9
                figures.check(
                    named, f"{role}: exit code {done.returncode}, cause named: {named}; {flown:.3f} s readable"
                )
                worst = max(worst, lost)
            figures.at_most(f"{role}: most wall clock lost of {EACH} kills", worst, LIMIT, "s")
    return figures.code()
