"""Sequences of three faults and requests at random moments of a hover: laws and guard, compiled; the worst over ROS."""

import itertools
import json
import math
import os
import random
import sys
import tempfile
from pathlib import Path

from figures import Figures
from flying import fly
from guard_faults import (
    CONDITIONS,
    FOOT,
    KINDS,
    PERIOD,
    Fault,
    Outcome,
    faulty_flight,
    initial_of,
    setup_of,
    tilt_of,
)
from guard_flights import draw_start, vehicle_named

from quad_core.compilation import compiled
from quad_core.geometry import norm
from quad_core.types import Quat, Vec3, VehicleState
from quad_dynamics import rigid_body
from quad_dynamics.parameters import PlantParameters
from quad_flight_log.bag.reader import open_flight
from quad_guard import guard

FLIGHTS_PER_SEQUENCE = 60
STEPS = 1700
LONGEST = 40_000
WORST = 10
CLIMB = 2.5  # m above where the hover began
TILT = math.radians(60.0)
CALM_HOVER = ("--plant", "rigid_body", "--set", "simulator.disturbance=none", "--start", "printed")
STATE = {"p_w": Vec3, "v_w": Vec3, "q_wb": Quat, "omega_b": Vec3}


def ends_well(ending):
    """Return whether a flight ended safely: flying on, or landed softly; motors off is no good end here."""
    if not ending.finite or ending.climb > CLIMB:
        return False
    if ending.mode == guard.PASS:
        return not ending.touched and ending.largest_tilt < TILT
    softly = ending.touched and ending.speed < 1.5 and ending.tilt < math.radians(15.0)
    return ending.mode == guard.DESCEND and softly and ending.largest_tilt < TILT


def badness(ending):
    """Return how bad a flight was: its largest share of a limit."""
    touchdown = (ending.speed / 1.5, ending.tilt / math.radians(15.0)) if ending.touched else (0.0,)
    return max(*touchdown, ending.largest_tilt / TILT, ending.climb / CLIMB)


def main():
    figures, flight = Figures(), compiled(faulty_flight)
    vehicle, rng = vehicle_named("paper"), random.Random(1)
    setup, modes, bad, worst, visited = setup_of(vehicle), [0, 0, 0], [], [], 0
    for kinds in itertools.product(range(KINDS), repeat=3):
        for _ in range(FLIGHTS_PER_SEQUENCE):
            drawn = draw_start(rng, vehicle, (6.0, 10.0), tilt=10.0, speed=1.0, rate=0.2)
            initial = initial_of(drawn.motion)
            begins = [rng.randrange(200, 1300) for _ in kinds]
            faults = [Fault(kind, at, at + rng.randrange(1, 300)) for kind, at in zip(kinds, begins, strict=True)]
            ending = flight(setup, started(initial, vehicle), *faults, STEPS, LONGEST)
            modes[ending.mode] += 1
            visited |= ending.visited
            if not ends_well(ending):
                bad.append((faults, ending))
            worst.append((badness(ending), len(worst), initial, faults, ending))
        worst = sorted(worst, key=lambda one: -one[0])[:WORST]
    for faults, ending in bad[:10]:
        print(faults, ending)
    flown, descended, killed = modes
    figures.check(
        not bad, f"{sum(modes)} flights: {flown} flew on, {descended} landed, {killed} killed, {len(bad)} bad"
    )
    report(figures, worst, visited)
    again = [
        faulty_flight(setup, started(initial, vehicle), *faults, STEPS, LONGEST) == ending
        for *_, initial, faults, ending in worst
    ]
    figures.check(all(again), f"the worst {WORST} flown again by CPython: {sum(again)} with the same bits")
    over_ros = [flown_over_ros(initial, faults, ending) == ending for *_, initial, faults, ending in worst]
    figures.check(all(over_ros), f"the worst {WORST} flown again over ROS: {sum(over_ros)} with the same bits")
    return figures.code()


def started(initial, vehicle):
    """Return the plant's state at step 0."""
    return rigid_body.init(PlantParameters(initial=initial), vehicle)


def flown_over_ros(initial, faults, ending):
    """Return how the same flight ends over ROS in lockstep, by its bag; ``visited`` is not in it."""
    # one step more: the state after the last one is not published
    steps = LONGEST if ending.mode == guard.DESCEND else ending.steps + 1
    words = [*CALM_HOVER, "--duration", f"{steps * PERIOD * 1e-9:.3f}"]
    for name, value in zip(("p", "v", "angles", "omega"), initial, strict=True):
        for axis, number in value._asdict().items():
            words += ["--set", f"simulator.rigid_body.initial.{name}.{axis}={number!r}"]
    for axis, number in initial.p._asdict().items():
        words += ["--set", f"trajectory.hover.position.{axis}={number!r}"]
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        case, out = Path(folder, "faults.json"), Path(folder, "bag")
        case.write_text(json.dumps(faults), "utf-8")
        own = f"simulator={sys.executable} {Path(__file__).parents[1] / 'faulty_simulator.py'}"
        environment = {**os.environ, "QUAD_FAULTS": str(case)}
        done = fly("hover", *words, "--own", own, "--out", out, env=environment)
        if not out.is_dir():
            print(done.stdout[-500:], done.stderr[-500:])
            return None
        return outcome_of(open_flight(out), ending)


def outcome_of(bag, ending):
    """Return the Outcome that ``bag`` shows up to the step at which ``ending`` was reached."""
    path = bag.array("truth")[: ending.steps + 1]
    columns = [[kind(*row) for row in path[name].tolist()] for name, kind in STATE.items()]
    states = [VehicleState(*numbers) for numbers in zip(*columns, strict=True)]
    guarded = bag.array("flight/guard")
    last = guarded[guarded["step"] < ending.steps][-1]
    end = states[-1]
    return Outcome(
        len(states) - 1,
        int(last["mode"]),
        int(last["reason"]),
        True,
        end.p_w.z <= FOOT,
        norm(end.v_w),
        tilt_of(end),
        max(map(tilt_of, states[1:])),
        end.p_w.z,
        max(0.0, *(state.p_w.z - states[0].p_w.z for state in states)),
        ending.visited,
    )


def report(figures, worst, visited):
    """Print the extremes of the worst flights, and which pairs of mode and condition were met."""
    endings = [ending for *_, ending in worst]
    figures.at_most("touchdown speed, worst", max(one.speed for one in endings if one.touched), 1.5, "m/s")
    figures.at_most("tilt in flight, worst", math.degrees(max(one.largest_tilt for one in endings)), 60.0, "deg")
    figures.at_most("climb above the hover, worst", max(one.climb for one in endings), CLIMB, "m")
    print(f"     longest of the worst {max(one.steps for one in endings) * PERIOD * 1e-9:.1f} s")
    pairs = [
        (guard.MODES[bit // CONDITIONS], guard.REASONS[bit % CONDITIONS]) for bit in range(30) if visited >> bit & 1
    ]
    print(f"     {len(pairs)} pairs of mode and condition met: " + ", ".join(f"{mode}/{why}" for mode, why in pairs))
