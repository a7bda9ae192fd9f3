"""Take-over of a standby controller at random moments of Case 2 in real time: errors, steps of the wrench.

``scripts/accept exchange --each N``: 2 N flights, by default 20, with one moment each; every second one by request
instead of kill -9.
"""

import os
import random
import signal
import tempfile
import time
from pathlib import Path

import numpy as np
from figures import Figures
from flying import bag_file, finish, start, wait_until, wait_until_flying
from takeovers import STANDBY, active_pid, asked

from quad_flight_log.analysis.arrays import by_stamp
from quad_flight_log.analysis.metrics import thrust_and_torque
from quad_flight_log.bag.reader import open_flight

EACH = int(os.environ.get("QUAD_ACCEPT_EACH", "10"))
DURATION = 12.0  # s of Case 2 after its approach
LONGEST = 900.0
AFTER = 2.0  # s
RATIO = 1.2
DOMAIN = 88
PERIOD = 2_000_000  # ns
GAP = 40_000_000
"""ns in which nobody answers at worst: `flight.takeover_age`, a period of the position law and some waiting."""
ROLES = ("position_controller", "attitude_controller")
SAME_SEED = ("case2", "--realtime", "--duration", str(DURATION), "--limits", "position_max=5", *STANDBY)


def flown(out, moments, request):
    """Fly and let ``{role: share of the bag's final size}`` be replaced then; returns the finished process."""
    process = start(*SAME_SEED, "--domain", str(DOMAIN), "--out", out)
    wait_until_flying(process, out)
    for role, ready in sorted(moments.items(), key=lambda item: item[1]):
        wait_until(
            lambda ready=ready: process.poll() is not None or bag_file(out).stat().st_size > ready,
            LONGEST,
            "the moment",
        )
        if process.poll() is not None:  # over before its moment
            break
        if request:
            assert asked(DOMAIN, f"shadow_{role}")[0]
        else:
            os.kill(active_pid(process.pid, role), signal.SIGKILL)
    return finish(process, LONGEST)


def took_over(bag):
    """Return {role: step} of the takeovers that a bag shows."""
    return {row["role"].removeprefix("shadow_"): int(row["step"]) for row in bag.array("flight/takeover")}


def errors(bag):
    """Return stamps in ns and distances in m from the reference, at every step of the reference."""
    truth, reference = by_stamp(bag.array("truth")), by_stamp(bag.array("reference"))
    _, ours, theirs = np.intersect1d(truth["stamp_ns"], reference["stamp_ns"], return_indices=True)
    distance = np.linalg.norm(truth["p_w"][ours] - reference["p_w"][theirs], axis=1)
    return truth["stamp_ns"][ours], distance


def rmse_after(bag, stamp):
    """Return the RMSE in m of the ``AFTER`` s from ``stamp`` ns on."""
    stamps, distance = errors(bag)
    window = (stamps >= stamp) & (stamps < stamp + AFTER * 1e9)
    return float(np.sqrt(np.mean(distance[window] ** 2)))


def wrench_step(bag, low=0, high=2**62):
    """Return the largest steps of thrust N and torque N m between two answers of the time [low, high] in ns."""
    rows = by_stamp(bag.array("wrench_setpoint"))
    thrust, torque = thrust_and_torque(rows)
    window = (rows["stamp_ns"] >= low) & (rows["stamp_ns"] <= high)
    return float(np.abs(np.diff(thrust[window])).max()), float(np.abs(np.diff(torque[window], axis=0)).max())


def wrench_change(bag, within):
    """Return the largest changes of thrust N and torque N m within ``within`` ns: a silence as long hides as much."""
    rows = by_stamp(bag.array("wrench_setpoint"))
    thrust, torque = thrust_and_torque(rows)
    count = round(within / np.median(np.diff(rows["stamp_ns"])))
    return float(np.abs(thrust[count:] - thrust[:-count]).max()), float(np.abs(torque[count:] - torque[:-count]).max())


def judge(figures, name, bag, undisturbed, within):
    """Compare the flight after each takeover with the undisturbed one, its wrench with changes ``within`` ns."""
    largest = wrench_change(undisturbed, within)
    for role, step in took_over(bag).items():
        stamp = step * PERIOD
        ratio = rmse_after(bag, stamp) / rmse_after(undisturbed, stamp)
        figures.at_most(
            f"{name}: {role} at {stamp * 1e-9:.2f} s, RMSE of the 2 s after it over undisturbed", ratio, RATIO
        )
        found = wrench_step(bag, stamp - 50_000_000, stamp + 50_000_000)
        figures.check(
            found[0] <= largest[0] and found[1] <= largest[1],
            f"{name}: {role}, largest wrench step around it {found[0]:.3f} N and {found[1]:.4f} N m, "
            f"undisturbed flight within {within * 1e-6:g} ms {largest[0]:.3f} N and {largest[1]:.4f} N m",
        )


def main():
    figures, draw = Figures(), random.Random(1)
    with tempfile.TemporaryDirectory(prefix="exchange-") as folder:
        still = Path(folder, "undisturbed")
        done = flown(still, {}, False)
        undisturbed, size = open_flight(still), bag_file(still).stat().st_size
        figures.check(done.returncode == 0, f"undisturbed, exit code {done.returncode}")
        for number in range(2 * EACH):
            out, request = Path(folder, str(number)), number % 2 == 1
            chosen = [draw.choice(ROLES)]
            moments = {role: draw.uniform(0.05, 0.75) * size for role in chosen}
            began = time.monotonic()
            done = flown(out, moments, request)
            bag = open_flight(out)
            name = f"{number + 1}, {'request' if request else 'kill -9'}"
            found = took_over(bag)
            figures.check(
                done.returncode == 0 and set(found) == set(chosen),
                f"{name}: exit code {done.returncode}, {found} ({time.monotonic() - began:.0f} s)",
            )
            judge(figures, name, bag, undisturbed, PERIOD if request else GAP)
    return figures.code()
