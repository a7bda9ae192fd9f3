"""Sequences of three faults of wrench and state at random moments of a hover: laws and guard, compiled."""

import itertools
import math
import random

from figures import Figures
from guard_faults import KINDS, Fault, faulty_flight, setup_of
from guard_flights import draw_start, vehicle_named

from quad_core import guard
from quad_core.compilation import compiled

FLIGHTS_PER_SEQUENCE = 100
STEPS = 1700
LONGEST = 40_000


def ends_well(ending):
    """Tell whether a flight ended safely: flying on, landed softly, or motors off for want of any state."""
    if not ending.finite:
        return False
    if ending.mode == guard.PASS:
        return not ending.touched and ending.largest_tilt < math.radians(60.0)
    if ending.mode == guard.DESCEND:
        return ending.touched and ending.speed < 1.5 and ending.tilt < math.radians(15.0)
    return ending.reason == guard.STATE_GONE


def main():
    figures, fly = Figures(), compiled(faulty_flight)
    vehicle, rng = vehicle_named("paper"), random.Random(1)
    setup, modes, bad = setup_of(vehicle), [0, 0, 0], []
    for kinds in itertools.product(range(KINDS), repeat=3):
        for _ in range(FLIGHTS_PER_SEQUENCE):
            start = draw_start(rng, vehicle, (6.0, 10.0), tilt=10.0, speed=1.0, rate=0.2)
            begins = [rng.randrange(200, 1300) for _ in kinds]
            faults = [Fault(kind, at, at + rng.randrange(1, 300)) for kind, at in zip(kinds, begins, strict=True)]
            ending = fly(setup, start, *faults, STEPS, LONGEST)
            modes[ending.mode] += 1
            if not ends_well(ending):
                bad.append((faults, ending))
    for faults, ending in bad[:10]:
        print(faults, ending)
    flown, descended, killed = modes
    figures.check(
        not bad, f"{sum(modes)} flights: {flown} flew on, {descended} landed, {killed} killed, {len(bad)} bad"
    )
    return figures.code()
