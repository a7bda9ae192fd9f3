"""The flight log: 20 kills, and foreign readers and replay of a whole Case 1."""

import os
import random
import signal
import time

import flying
import foreign_readers

from quad_analysis.replay import replay
from quad_core.cascade import STAGE
from quad_flight_log.reader import open_flight

KILLS = 20
LIMIT = 0.3  # s
BAG_LIMIT = 80.0  # MB of a Case 1


def run(figures):
    kills(figures, figures.folder)
    whole_flight(figures, figures.folder)


def kills(figures, folder):
    """Kill the recorder of a Case 1 at random moments."""
    draw, losses = random.Random(1), []
    for number in range(KILLS):
        out = folder / f"kill{number}"
        process = flying.start("case1", "--out", out)
        pids = flying.wait_until_flying(process, out, 100_000)
        time.sleep(draw.uniform(0.0, 5.0))
        killed = time.time()
        os.kill(pids["recorder"], signal.SIGKILL)
        done = flying.finish(process)
        figures.check(done.returncode == 1, f"kill {number + 1}: fly ended with exit code {done.returncode}")
        losses.append(killed - flying.last_reception(flying.bag_file(out)))
    figures.at_most(f"kill -9 at {KILLS} random moments: largest loss of wall clock", max(losses), LIMIT, "s")


def whole_flight(figures, folder):
    bag = folder / "case1"
    done = flying.finish(flying.start("case1", "--out", bag), 900.0)
    figures.check(done.returncode == 0, f"Case 1 over ROS: exit code {done.returncode}")
    flight = open_flight(bag)
    figures.at_most("Case 1: size of the bag", flight.path.stat().st_size * 1e-6, BAG_LIMIT, "MB")
    for role in STAGE:
        found = replay(flight, role)
        text = f"replay of {role}: {len(found.steps)} steps, {len(found.recorded)} numbers each, bit-equal"
        figures.check(found.equal and len(found.steps) * found.steps[1] >= 40_000, text)
    done = flying.fly("case2", "--duration", "5", "--realtime", "--limits", "position_max=5", "--out", folder / "rt")
    figures.check(done.returncode == 0, f"Case 2 in real time: exit code {done.returncode}")
    for role in STAGE:
        found = replay(open_flight(folder / "rt"), role)
        figures.check(found.equal, f"replay of {role} in real time: {len(found.steps)} steps, bit-equal {found.notes}")
    seen = foreign_readers.ours(bag)
    for name in ("rosbags", "mcap_ros2"):
        began = time.monotonic()
        same = getattr(foreign_readers, f"by_{name}")(bag) == {
            topic: found for topic, found in seen.items() if found[0]
        }
        count = sum(count for count, _ in seen.values())
        figures.check(same, f"{name}: {count} messages, equal values ({time.monotonic() - began:.0f} s)")
