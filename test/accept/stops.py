"""Nodes killed, stopped or asked to end in flight: landed, by name; no motor stops in the air.

kill -9 and SIGSTOP of 0.1, 1 and 5 s of each node but the vehicle's owner in hover and Case 2, in real time; the owner
stopped for 1 s; and in both clocks a signal to `fly` up to 8 s after a node was killed. ``--each N``: random moments
of each kind, by default 2 of the 30 with a signal and 5 of the others (270 flights, 4 hours). ``--only PATTERN``: the
kinds whose name holds this regular expression, say 'Case 2, .* killed$' or 'lockstep, .* SIG'.
"""

import os
import random
import re
import signal
import time
from typing import NamedTuple

from flying import finish, landing, node_pids, start, wait_until_flying

from quad_analysis.flight_checks import equal_stamps, flown_of, run_ids, stopped_motors
from quad_core.node_parameters import GuardParameters
from quad_flight_log.reader import open_flight

OWNER = "simulator"
PLAN = ("--realtime", "--duration", "25", "--set", "commander.wait_limit=5.0")
MISSIONS = {
    "hover": ("takeoff,hold:20,land", *PLAN),
    "Case 2": ("takeoff,case2,land", *PLAN),
    "lockstep": ("takeoff:2,hold:60,land",),
    "realtime": ("takeoff:2,hold:60,land", "--realtime"),
}
VICTIMS = ("trajectory", "position_controller", "attitude_controller", "commander", "recorder")
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
STOPS = (None, 0.1, 1.0, 5.0)  # s; None: kill -9
AT_HEIGHT = 2_000_000  # bytes of a bag whose take-off is over
LONGEST_DELAY = 8.0  # s from the kill to the signal; fly asks for a landing 6 s after it
REACTION = 0.06  # s from the last good wrench to the backup law


class Kind(NamedTuple):
    """A mission, the node that is stopped for ``stop`` s or killed (None), and a signal to `fly` afterwards."""

    mission: str
    victim: str
    stop: float | None
    signal: str = ""

    def __str__(self):
        done = "killed" if self.stop is None else f"stopped {self.stop:g} s"
        return f"{self.mission}, {self.victim} {done}{self.signal and f', then {self.signal}'}"


KINDS = [
    *(Kind(mission, victim, stop) for mission in ("hover", "Case 2") for victim in VICTIMS for stop in STOPS),
    *(Kind(mission, OWNER, 1.0) for mission in ("hover", "Case 2")),
    *(Kind(clock, victim, None, name) for clock in ("lockstep", "realtime") for victim in VICTIMS for name in SIGNALS),
]


def flight(kind, moment, out):
    """Return how a flight ended whose victim was stopped or killed at ``moment`` s, or a signal came so long after."""
    process = start("--mission", *MISSIONS[kind.mission], "--out", out)
    wait_until_flying(process, out, AT_HEIGHT)
    if not kind.signal:
        time.sleep(moment)
    pid = node_pids(process.pid).get(kind.victim)
    if pid is None:
        done = finish(process, 300.0)
        raise AssertionError(f"over before {kind.victim} was stopped: {done.stdout[-300:]} {done.stderr[-300:]}")
    os.kill(pid, signal.SIGKILL if kind.stop is None else signal.SIGSTOP)
    if kind.stop is not None:
        time.sleep(kind.stop)
        os.kill(pid, signal.SIGCONT)
    if kind.signal:
        time.sleep(moment)
        process.send_signal(getattr(signal, kind.signal))
    return finish(process, 300.0)


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


def is_named(kind, done, bag):
    """Return whether a flight names its victim: a kill on the terminal, and first in the bag's reason if it has one.

    A flight without a reason was flown to its end; one that was stopped may then be good. The recorder cannot write
    why it was killed, and what it lost is the verdict's to say. After a signal the reason is the signal.
    """
    reason = str(bag.metadata.get("reason", ""))
    if kind.stop is None and f"{kind.victim} was killed by SIGKILL" not in done.stderr:
        return False
    if kind.signal:
        return done.returncode == 1 and "Traceback" not in done.stderr
    if kind.victim == "recorder":
        return kind.stop is None or done.returncode == 0 or kind.victim in names(done, bag)
    if not reason:
        return kind.stop is None or done.returncode == 0
    return blamed(reason) == kind.victim


def judge(figures, kind, name, done, out):
    """Print what a flight was; a disturbed one must name its victim, and land."""
    bag = open_flight(out)
    named = is_named(kind, done, bag)
    reason = bag.metadata.get("reason", "") or "none"
    text = f"{kind.victim} {'named' if named else 'not named'}; reason in the bag: {reason}"
    figures.check(named, f"{name}: exit code {done.returncode}, {text}")
    if not named:
        print(done.stdout[-400:], done.stderr[-800:], sep="\n")
    if kind.victim == "recorder" and bag.truncated:  # the bag ends with it: the commander says how the flight did
        log = (out / "logs" / "commander.log").read_text(encoding="utf-8")
        figures.check(bool(re.search("(LAND|DESCEND) to DISARMED", log)), f"{name}: disarmed on the ground")
        return
    flown = flown_of(bag)._replace(guard=GuardParameters())
    problems = [text for text in (run_ids(flown), equal_stamps(flown), stopped_motors(flown)) if text]
    figures.check(not problems, f"{name}: {problems or 'motors on in the air'}")
    height, speed, tilt = landing(bag)
    softly = kind.signal or (speed < 1.5 and tilt < 15.0)
    figures.check(height < 0.3 and softly, f"{name}: ends at {height:.2f} m, {speed:.2f} m/s, {tilt:.1f} deg")
    if slowest(bag) and not kind.signal:
        figures.at_most(f"{name}: age of the last good wrench when the guard took over", slowest(bag), REACTION, "s")


def run(figures):
    draw = random.Random(1)
    for kind in KINDS:
        moments = [draw.uniform(0.1, LONGEST_DELAY) for _ in range(figures.each(2 if kind.signal else 5))]
        for number, moment in enumerate(moments if figures.wants(str(kind)) else (), 1):
            name = f"{kind} at {moment:.1f} s, {number}"
            out = figures.folder / name.replace(" ", "-").replace(",", "")
            try:
                judge(figures, kind, name, flight(kind, moment, out), out)
            except AssertionError as error:
                figures.check(False, f"{name}: {error}")
