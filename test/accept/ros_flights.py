"""Case 1 and Case 2 over ROS in lockstep, two seeds each and each twice, once under load: RMSE, hash, speed."""

import tempfile
from pathlib import Path

from figures import Figures
from flying import busy_loops, finish, start

from quad_flight_log.analysis.tables import measured
from quad_flight_log.bag.payload_hash import payload_hash
from quad_flight_log.bag.reader import open_flight

LIMIT = 0.02
LONGEST = 1200.0


def flown(figures, out, *arguments):
    """Fly to the end; returns the bag, None if the flight failed."""
    done = finish(start(*arguments, "--out", out), LONGEST)
    figures.check(done.returncode == 0, f"fly {' '.join(arguments)}: exit code {done.returncode}")
    return open_flight(out) if done.returncode == 0 else None


def main():
    figures = Figures()
    with tempfile.TemporaryDirectory(prefix="ros-flights-") as folder:
        for case in ("case1", "case2"):
            for seed in ("1", "2"):
                choices = (case, "--seed", seed)
                alone = flown(figures, Path(folder, f"{case}-{seed}"), *choices)
                with busy_loops(2, LONGEST):
                    loaded = flown(figures, Path(folder, f"{case}-{seed}-loaded"), *choices)
                if alone is None or loaded is None:
                    continue
                name = f"{case} seed {seed} over ROS"
                figures.at_most(f"{name}: 3-D RMSE", measured(alone).position_rmse, LIMIT, "m")
                same = payload_hash(alone) == payload_hash(loaded)
                figures.check(same, f"{name}: same payload hash under two busy loops: {same}")
                for label, bag in (("as the machine was", alone), ("under two busy loops", loaded)):
                    print(f"     {name}: {float(bag.metadata['real_time_factor']):.2f} x real time {label}")
    return figures.code()
