"""Sequences of three faults and requests at random moments of a hover: laws and guard, compiled; the worst again."""

import itertools
import math
import random

from figures import Figures
from guard_faults import CONDITIONS, KINDS, PERIOD, Fault, faulty_flight, setup_of
from guard_flights import draw_start, vehicle_named

from quad_core import guard
from quad_core.compilation import compiled

FLIGHTS_PER_SEQUENCE = 60
STEPS = 1700
LONGEST = 40_000
WORST = 10
CLIMB = 2.5  # m above where the hover began
TILT = math.radians(60.0)


def ends_well(ending):
    """Tell whether a flight ended safely: flying on, landed softly, or motors off for want of any state."""
    if not ending.finite or ending.climb > CLIMB:
        return False
    if ending.mode == guard.PASS:
        return not ending.touched and ending.largest_tilt < TILT
    if ending.mode == guard.DESCEND:
        return ending.touched and ending.speed < 1.5 and ending.tilt < math.radians(15.0) and ending.largest_tilt < TILT
    return ending.reason == guard.STATE_GONE


def badness(ending):
    """Return how bad a flight was: its largest share of a limit, those that the motors were stopped on left out."""
    if ending.mode == guard.KILL:
        return 0.0
    touchdown = (ending.speed / 1.5, ending.tilt / math.radians(15.0)) if ending.touched else (0.0,)
    return max(*touchdown, ending.largest_tilt / TILT, ending.climb / CLIMB)


def main():
    figures, fly = Figures(), compiled(faulty_flight)
    vehicle, rng = vehicle_named("paper"), random.Random(1)
    setup, modes, bad, worst, visited = setup_of(vehicle), [0, 0, 0], [], [], 0
    for kinds in itertools.product(range(KINDS), repeat=3):
        for _ in range(FLIGHTS_PER_SEQUENCE):
            start = draw_start(rng, vehicle, (6.0, 10.0), tilt=10.0, speed=1.0, rate=0.2)
            begins = [rng.randrange(200, 1300) for _ in kinds]
            faults = [Fault(kind, at, at + rng.randrange(1, 300)) for kind, at in zip(kinds, begins, strict=True)]
            ending = fly(setup, start, *faults, STEPS, LONGEST)
            modes[ending.mode] += 1
            visited |= ending.visited
            if not ends_well(ending):
                bad.append((faults, ending))
            worst.append((badness(ending), len(worst), start, faults, ending))
        worst = sorted(worst, key=lambda one: -one[0])[:WORST]
    for faults, ending in bad[:10]:
        print(faults, ending)
    flown, descended, killed = modes
    figures.check(
        not bad, f"{sum(modes)} flights: {flown} flew on, {descended} landed, {killed} killed, {len(bad)} bad"
    )
    report(figures, worst, visited)
    again = [faulty_flight(setup, start, *faults, STEPS, LONGEST) == ending for *_, start, faults, ending in worst]
    figures.check(all(again), f"the worst {WORST} flown again by CPython: {sum(again)} with the same bits")
    return figures.code()


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
