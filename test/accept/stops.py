"""kill -9 and SIGSTOP of 0.1, 1 and 5 s for each node but the vehicle's owner, in real time: landed, by name.

Hover and Case 2 as missions. ``scripts/accept stops --each N``: random moments of each of the 40 kinds, by default 5
(200 flights, 3 hours); then the vehicle's owner stopped for 1 s, N times in each mission. ``--only PATTERN``: the kinds
whose name holds this regular expression, say 'Case 2, .* killed'.
"""

import math
import os
import random
import re
import signal
import tempfile
import time
from pathlib import Path

import numpy as np
from figures import Figures
from flying import finish, node_pids, start, wait_until_flying

from quad_core.guard_parameters import GuardParameters
from quad_flight_log.analysis.flight_checks import Flown, equal_stamps, run_ids, stopped_motors
from quad_flight_log.analysis.tables import flight_tables
from quad_flight_log.bag.reader import open_flight

EACH = int(os.environ.get("QUAD_ACCEPT_EACH", "5"))
ONLY = os.environ.get("QUAD_ACCEPT_ONLY", "")
OWNER = "simulator"
MISSIONS = {"hover": "takeoff,hold:20,land", "Case 2": "takeoff,case2,land"}
PLAN = ("--realtime", "--duration", "25", "--set", "commander.wait_limit=5.0")
VICTIMS = ("trajectory", "position_controller", "attitude_controller", "commander", "recorder")
STOPS = (None, 0.1, 1.0, 5.0)  # s; None: kill -9
AT_HEIGHT = 2_000_000  # bytes of a bag whose take-off is over
REACTION = 0.06  # s from the last good wrench to the backup law


def flight(mission, victim, stop, moment, out):
    """Return how a flight ended in which ``victim`` was stopped for ``stop`` s, or killed (None), at ``moment`` s."""
    process = start("--mission", mission, *PLAN, "--out", out)
    wait_until_flying(process, out, AT_HEIGHT)
    time.sleep(moment)
    pid = node_pids(process.pid).get(victim)
    if pid is None:
        done = finish(process, 300.0)
        raise AssertionError(f"over before {victim} was stopped: {done.stdout[-300:]} {done.stderr[-300:]}")
    os.kill(pid, signal.SIGKILL if stop is None else signal.SIGSTOP)
    if stop is not None:
        time.sleep(stop)
        os.kill(pid, signal.SIGCONT)
    return finish(process, 300.0)


def landing(bag):
    """Return height m, speed m/s and tilt deg of the last true state."""
    last = bag.array("truth")[-1]
    x, y = last["q_wb"][:2]
    return (
        float(last["p_w"][2]),
        float(np.linalg.norm(last["v_w"])),
        math.degrees(math.acos(1.0 - 2.0 * (x * x + y * y))),
    )


def slowest(bag):
    """Return the age in s of the last good wrench when the guard took over for want of one, 0 if it never did."""
    rows = bag.array("flight/guard")
    took = rows[(rows["mode"] == 1) & (rows["reason_text"] == "no good wrench")]
    if not len(took):
        return 0.0
    # who was stopped may have lost the message of the takeover itself; in later ones the wrench is older by their time
    later = 1e-9 * int(bag.metadata["plant_period_ns"]) * float(took["step"][0] - took["since"][0])
    return float(took["command_age"][0]) - later


def names(done, bag):
    """Return all that a flight said of what went wrong: on the terminal, at its end and in its events."""
    events = [row["text"] for row in bag.array("flight/events") if row["severity"] > 0]
    return "\n".join([done.stdout, done.stderr, str(bag.metadata.get("reason", "")), *events])


def blamed(reason):
    """Return the role that the reason of a flight's end names first, empty if it names none."""
    found = [(reason.index(role), role) for role in (*VICTIMS, OWNER) if role in reason]
    return min(found)[1] if found else ""


def is_named(done, bag, victim, stop):
    """Return whether a flight names its victim: a kill on the terminal, and first in the bag's reason if it has one.

    A flight without a reason was flown to its end; one that was stopped may then be good. The recorder cannot write
    why it was killed, and what it lost is the verdict's to say.
    """
    reason = str(bag.metadata.get("reason", ""))
    if stop is None and f"{victim} was killed by SIGKILL" not in done.stderr:
        return False
    if victim == "recorder":
        return stop is None or done.returncode == 0 or victim in names(done, bag)
    if not reason:
        return stop is None or done.returncode == 0
    return blamed(reason) == victim


def judge(figures, name, done, out, victim, stop):
    """Print what a flight was; a disturbed one must name its victim."""
    bag = open_flight(out)
    named = is_named(done, bag, victim, stop)
    reason = bag.metadata.get("reason", "") or "none"
    text = f"{victim} {'named' if named else 'not named'}; reason in the bag: {reason}"
    figures.check(named, f"{name}: exit code {done.returncode}, {text}")
    if not named:
        print(done.stdout[-400:], done.stderr[-800:], sep="\n")
    if victim == "recorder" and bag.truncated:
        print(f"     {name}: the bag ends where its recorder did; exit code {done.returncode}")
        return
    flown = Flown(bag, flight_tables(bag), GuardParameters())
    problems = [text for text in (run_ids(flown), equal_stamps(flown), stopped_motors(flown)) if text]
    figures.check(not problems, f"{name}: {problems or 'motors on in the air'}")
    height, speed, tilt = landing(bag)
    figures.check(
        height < 0.3 and speed < 1.5 and tilt < 15.0, f"{name}: ends at {height:.2f} m, {speed:.2f} m/s, {tilt:.1f} deg"
    )
    if slowest(bag):
        figures.at_most(f"{name}: age of the last good wrench when the guard took over", slowest(bag), REACTION, "s")


def cases():
    """Return (mission's name, victim, stop) of all flights."""
    for case in MISSIONS:
        yield from ((case, victim, stop) for victim in VICTIMS for stop in STOPS)
        yield case, OWNER, 1.0


def kind_name(case, victim, stop):
    """Return a kind in words."""
    return f"{case}, {victim} {'killed' if stop is None else f'stopped {stop:g} s'}"


def fly_one(figures, name, case, victim, stop, moment, out):
    """Fly and judge one."""
    try:
        judge(figures, name, flight(MISSIONS[case], victim, stop, moment, out), out, victim, stop)
    except AssertionError as error:
        figures.check(False, f"{name}: {error}")


def main():
    figures, draw = Figures(), random.Random(1)
    with tempfile.TemporaryDirectory(prefix="stops-") as folder:
        for case, victim, stop in cases():
            moments = [draw.uniform(0.5, 8.0) for _ in range(EACH)]
            if re.search(ONLY, kind_name(case, victim, stop)):
                for number, moment in enumerate(moments, 1):
                    name = f"{kind_name(case, victim, stop)} at {moment:.1f} s, {number}"
                    out = Path(folder, name.replace(" ", "-").replace(",", ""))
                    fly_one(figures, name, case, victim, stop, moment, out)
    return figures.code()
