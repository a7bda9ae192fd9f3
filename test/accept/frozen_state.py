"""A state that freezes at 1,000 random moments: bare Case 2 and hover, HOLD of a commander; disturbed and in calm air.

Each freeze is compared with the same flight without it: the first change by more than 1e-9 (m, m/s, 1, rad/s) that
the frozen state lacks starts the clock. A hover that has come to rest within that has nothing to show until its wrench
moves: in the last part a commander asks for a landing then. A flight ends on the ground within 1.5 m/s and 15 deg, or
the freeze was over before anything had to be done. A freeze lasts up to 1.8 s in calm air and 1 s under the paper's
disturbance, whose torque is not seen meanwhile. In HOLD a quarter of them has no end: they come down harder.
"""

import math
import random
from typing import NamedTuple

import numpy as np
from commanded_flights import PERFECT, hovering, tilt

from quad_core.cycle import seconds
from quad_core.enumerations import GuardMode, Mode, Request
from quad_core.geometry import norm
from quad_core.types import CALM, SensorFault, VehicleState
from quad_core.vehicle import Vehicle
from quad_dynamics import held_gaussian
from quad_flight.flight import fly, from_names

PERIOD = 2_000_000
LONGEST, LONGEST_DISTURBED = 1.8, 1.0  # s
FLOWN = {"case2": (64.0, 140.0), "hover": (20.0, 40.0)}  # s of moments, and of the whole flight
GAUSSIAN = "held_gaussian acceleration_sd=0.5 acceleration_clip=1.5 angular_sd=0.66 angular_clip=2 hold=2"
HEIGHT = 5.0  # m of HOLD and hover
LEAST_HEIGHT = 3.5  # m: lower than this the guard does not promise a soft landing
SEEN_IN, SEEN_IN_CALM = 0.15, 0.5  # s
SPEED, TILT = 1.5, 15.0  # m/s, deg
CHANGE = 1e-9
RESTED = 30.0  # s of HOLD in calm air until nothing moves


class Found(NamedTuple):
    """One freeze: s from the first missing change until seen (NaN: not), whether something changed, and the end.

    ``came_down``: whether the guard flew to the ground, at ``speed`` m/s and ``tilt`` deg; ``forever``: no end.
    """

    delay: float
    missed: bool
    came_down: bool
    speed: float
    tilt: float
    largest_tilt: float
    forever: bool


def scenario(folder, events):
    """Return the path of a scenario with these events."""
    path = folder / "scenario.yaml"
    lines = "".join(f"        {line}\n" for line in events)
    head = "/**/simulator:\n  ros__parameters:\n    disturbance: timeline\n    timeline:\n      events: |\n"
    path.write_text(head + lines)
    return str(path)


def readings(topics):
    """Return the state's 13 numbers at each step."""
    state = topics["state"]
    parts = [state[name][:, None] if state[name].ndim == 1 else state[name] for name in VehicleState._fields]
    return np.concatenate(parts, axis=1)


def first_change(live, begin):
    """Return the first step at which a live state has changed since step ``begin``, None if none has."""
    differ = np.flatnonzero((np.abs(live[begin + 1 :] - live[begin]) > CHANGE).any(axis=1))
    return begin + 1 + int(differ[0]) if len(differ) else None


def bare(folder, case, disturbed, count, rng):
    """Yield ``count`` freezes of a flight without a commander."""
    weather, (moments, whole) = [GAUSSIAN] if disturbed else [], FLOWN[case]
    settings = [f"trajectory.hover.position.z={HEIGHT}"] if case == "hover" else []

    def flown(start, lasts):
        events = [*weather, f"freeze start={start:.3f} end={start + lasts:.3f}"]
        flight = from_names(case, settings=settings, scenario=scenario(folder, events), duration=whole)
        return fly(flight, compiled=True)

    base = flown(7000.0, 1.0)
    live = readings(base.topics)
    least = int(np.flatnonzero(base.topics["truth"]["p_w"][:, 2] > LEAST_HEIGHT)[0])
    for _ in range(count):
        begin = rng.randrange(least, round(moments * 1e9 / PERIOD))
        lasts = rng.uniform(0.02, LONGEST_DISTURBED if disturbed else LONGEST)
        result = flown(seconds(begin, PERIOD), lasts)
        change = first_change(live, begin)
        missed = change is not None and change < begin + round(lasts * 1e9 / PERIOD)
        since = int(result.guard.split("since step ")[1].split(":")[0]) if result.guard else None
        delay = seconds(since - change, PERIOD) if missed and since is not None else math.nan
        truth = result.topics["truth"]
        leans = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (truth["q_wb"][:, :2] ** 2).sum(axis=1), -1.0, 1.0)))
        speed = float(np.linalg.norm(truth["v_w"][-1]))
        yield Found(delay, missed, bool(result.guard), speed, float(leans[-1]), float(leans.max()), False), lasts


def has_changed(frozen, live):
    """Return whether position, velocity, attitude or body rates differ by more than CHANGE."""
    pairs = zip(frozen[:4], live[:4], strict=True)
    return any(abs(a - b) > CHANGE for one, other in pairs for a, b in zip(one, other, strict=True))


def rested(count, rng):
    """Yield ``count`` freezes for good of a vehicle at rest, and the landing that is asked for up to 3 s later."""
    base = hovering(HEIGHT, RESTED)
    for _ in range(count):
        base.go(rng.uniform(0.02, 0.2))
        begin = base.k
        twin = base.fork(fault=lambda k, a=begin: SensorFault(frozen=k >= a))
        twin.go(rng.uniform(0.0, 3.0))
        asked = twin.k
        live = base.fork().go(seconds(asked - begin, PERIOD))
        live.go(1.0, Request.LAND, until=lambda it, at=twin.truth: has_changed(at, it.truth))
        twin.go(3.0, Request.LAND, until=lambda it: it.memory.mode != GuardMode.PASS)
        yield seconds(twin.k - live.k, PERIOD), twin.memory.mode == GuardMode.DESCEND, twin.largest_tilt


def held(disturbed, count, rng):
    """Yield ``count`` freezes in HOLD, with a commander and a ground."""
    parameters = held_gaussian.Parameters()
    table = held_gaussian.draw(parameters, Vehicle(), 7, 400.0)

    def weather(k):
        return held_gaussian.sample(parameters, table, seconds(k, PERIOD)) if disturbed else CALM

    base, longest = hovering(HEIGHT, 0.0, acts=weather), LONGEST_DISTURBED if disturbed else LONGEST
    for _ in range(count):
        base.go(rng.uniform(0.05, 0.5 if disturbed else 0.2))
        begin, forever = base.k, rng.random() < 0.25
        end = begin + (10**9 if forever else round(rng.uniform(0.02, longest) * 1e9 / PERIOD))
        twin = base.fork(fault=lambda k, a=begin, b=end: SensorFault(frozen=True) if a <= k < b else PERFECT)
        live, change, since, touched, before = base.fork(), None, None, None, base.truth
        for _ in range(round(20e9 / PERIOD)):
            twin.step()
            if change is None and live.k < end:
                live.step()
                change = live.k - 1 if live.k - 1 > begin and has_changed(twin.read, live.read) else None
            if since is None and twin.memory.mode != GuardMode.PASS:
                since = twin.memory.since
            if touched is None and twin.truth.p_w.z <= 0.001:
                touched = norm(before.v_w), math.degrees(tilt(before))
            before = twin.truth
            if twin.mode == Mode.DISARMED or twin.is_over or (since is None and twin.k > end + 500):
                break
        missed = change is not None
        delay = seconds(since - change, PERIOD) if missed and since is not None else math.nan
        speed, lean = touched or (math.nan, math.nan)
        largest = math.degrees(twin.largest_tilt)
        yield Found(delay, missed, touched is not None, speed, lean, largest, forever), seconds(end - begin, PERIOD)


def judged(figures, name, found, limit):
    """Print the figures of one kind of flight; a freeze shorter than the guard's patience need not be seen."""
    seen = [one for one, _ in found if not math.isnan(one.delay)]
    unseen = [(one, lasts) for one, lasts in found if one.missed and math.isnan(one.delay) and lasts > limit]
    figures.check(
        not unseen, f"{name}: {len(found)} freezes, {len(seen)} seen, {len(unseen)} of more than {limit} s unseen"
    )
    figures.at_most(f"{name}: seen after the first missing change, worst", max(one.delay for one in seen), limit, "s")
    short = [one for one, _ in found if one.came_down and not one.forever]
    figures.at_most(f"{name}: touchdown of {len(short)}, fastest", max(one.speed for one in short), SPEED, "m/s")
    figures.at_most(f"{name}: touchdown, steepest", max(one.tilt for one in short), TILT, "deg")
    largest = max(one.largest_tilt for one, _ in found if not one.forever)
    figures.show(f"{name}: largest tilt in flight {largest:.1f} deg")
    forever = [one for one, _ in found if one.came_down and one.forever]
    if forever:
        fastest, steepest = max(one.speed for one in forever), max(one.tilt for one in forever)
        figures.show(f"{name}: {len(forever)} frozen for good: at most {fastest:.2f} m/s, {steepest:.1f} deg")


def run(figures):
    rng = random.Random(28)
    for disturbed, limit, counts in ((True, SEEN_IN, (250, 200, 125)), (False, SEEN_IN_CALM, (150, 150, 125))):
        for case, count in zip(("case2", "hover", "HOLD"), counts, strict=True):
            way = held(disturbed, count, rng) if case == "HOLD" else bare(figures.folder, case, disturbed, count, rng)
            judged(figures, f"{case}, {'disturbed' if disturbed else 'calm'}", list(way), limit)
    found = list(rested(50, rng))
    unseen = sum(not seen for _, seen, _ in found)
    figures.check(unseen == 0, f"at rest in calm air, then LAND: {len(found)} freezes, {unseen} unseen")
    figures.at_most("at rest, seen after the first missing change, worst", max(found)[0], SEEN_IN, "s")
