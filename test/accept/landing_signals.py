"""One signal at a random moment after a node was killed in flight, both clocks: no motor stops above 0.3 m.

``scripts/accept landing_signals --each N``: N flights in each clock, by default 30. ``--only`` CLOCK.
Two flights at a time; the victim, the signal and its delay are drawn.
"""

import os
import random
import re
import signal
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from figures import Figures, seconds
from flying import finish, start, wait_until_flying
from stops import VICTIMS, landing

from quad_core.guard_parameters import GuardParameters
from quad_flight_log.analysis.flight_checks import Flown, stopped_motors
from quad_flight_log.analysis.tables import flight_tables
from quad_flight_log.bag.reader import open_flight

EACH = int(os.environ.get("QUAD_ACCEPT_EACH", "30"))
ONLY = os.environ.get("QUAD_ACCEPT_ONLY", "")
CLOCKS = {"lockstep": (), "realtime": ("--realtime",)}
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
IN_THE_AIR = 1_500_000  # bytes of a bag whose vehicle is above 1 m
LONGEST_DELAY = 8.0  # s from the kill to the signal; fly asks for a landing 6 s after it


class Case(NamedTuple):
    """Which node is killed, which signal comes how many s later."""

    clock: str
    victim: str
    signal: str
    delay: float


def flown(case, out):
    """Return how the flight of a case ended."""
    process = start("--mission", "takeoff:2,hold:60,land", *CLOCKS[case.clock], "--out", out)
    os.kill(wait_until_flying(process, out, IN_THE_AIR)[case.victim], signal.SIGKILL)
    time.sleep(case.delay)
    process.send_signal(getattr(signal, case.signal))
    return finish(process, 240.0)


def problems(case, done, out):
    """Return what is wrong with a flight."""
    found = [] if done.returncode == 1 else [f"exit code {done.returncode}"]
    if f"{case.victim} was killed by SIGKILL" not in done.stderr:
        found.append("victim not named")
    if "Traceback" in done.stderr:
        found.append("a traceback")
    if case.victim == "recorder":  # the bag ends with it: the commander says how the flight did
        log = (out / "logs" / "commander.log").read_text(encoding="utf-8")
        landed = re.search(r"(LAND|DESCEND) to DISARMED", log)
        return found + ([] if landed else ["the commander has not disarmed on the ground"])
    bag = open_flight(out)
    stopped = stopped_motors(Flown(bag, flight_tables(bag), GuardParameters()))
    height, speed, tilt = landing(bag)
    if stopped or height > 0.3:
        found.append(f"{stopped or 'ends in the air'}: {height:.2f} m, {speed:.2f} m/s, {tilt:.1f} deg")
    return found


def attempt(case, out):
    """Fly a case; return what is wrong with it and what it said."""
    try:
        done = flown(case, out)
        return problems(case, done, out), done.stderr[-600:]
    except (AssertionError, KeyError, OSError) as error:
        return [f"{type(error).__name__}: {error}"[:300]], ""


def main():
    figures, draw = Figures(), random.Random(time.time_ns())
    clocks = [clock for clock in CLOCKS if re.search(ONLY, clock)]
    cases = [
        Case(clock, draw.choice(VICTIMS), draw.choice(SIGNALS), draw.uniform(0.0, LONGEST_DELAY))
        for _ in range(EACH)
        for clock in clocks
    ]
    until, bad, count = time.monotonic() + seconds(7200.0), 0, 0

    def one(numbered):
        number, case = numbered
        return (case, *attempt(case, Path(folder, str(number)))) if time.monotonic() < until else None

    with tempfile.TemporaryDirectory(prefix="landing-signals-") as folder, ThreadPoolExecutor(2) as pool:
        for outcome in pool.map(one, enumerate(cases)):
            if outcome is None:
                continue
            case, wrong, said = outcome
            count, bad = count + 1, bad + bool(wrong)
            name = f"{case.clock}, {case.victim} killed, {case.signal} {case.delay:.1f} s later"
            figures.check(not wrong, f"{name}: {'; '.join(wrong) or 'landed'}")
            if wrong:
                print(said)
    figures.check(bad == 0, f"{count} signals after a node was killed: {bad} flights that ended badly, 0 wanted")
    return figures.code()
