"""Sequences of three faults and requests at random moments of a hover, compiled; the worst again in CPython."""

import itertools
import math
import random

from guard_flights import CONDITIONS, KINDS, PERIOD, Fault, Setup, draw_start, faulty_flight, vehicle_named

from quad_core.compilation import compiled
from quad_core.enumerations import GuardMode
from quad_guard import guard

FLIGHTS_PER_SEQUENCE = 60
STEPS = 1700
LONGEST = 40_000
WORST = 10
CLIMB = 2.5  # m above where the hover began
TILT = math.radians(60.0)


def ends_well(ending):
    """Return whether a flight ended safely: flying on, or landed softly; motors off is no good end here."""
    if not ending.finite or ending.climb > CLIMB:
        return False
    if ending.mode == GuardMode.PASS:
        return not ending.touched and ending.largest_tilt < TILT
    softly = ending.touched and ending.speed < 1.5 and ending.tilt < math.radians(15.0)
    return ending.mode == GuardMode.DESCEND and softly and ending.largest_tilt < TILT


def badness(ending):
    """Return how bad a flight was: its largest share of a limit."""
    touchdown = (ending.speed / 1.5, ending.tilt / math.radians(15.0)) if ending.touched else (0.0,)
    return max(*touchdown, ending.largest_tilt / TILT, ending.climb / CLIMB)


def run(figures):
    flight = compiled(faulty_flight)
    setup, rng = Setup(vehicle_named("paper")), random.Random(1)
    modes, bad, worst, visited = [0, 0, 0], [], [], 0
    for kinds in itertools.product(range(KINDS), repeat=3):
        for _ in range(FLIGHTS_PER_SEQUENCE):
            start = draw_start(rng, setup.vehicle, (6.0, 10.0), tilt=10.0, speed=1.0, rate=0.2)
            begins = [rng.randrange(200, 1300) for _ in kinds]
            faults = [Fault(kind, at, at + rng.randrange(1, 300)) for kind, at in zip(kinds, begins, strict=True)]
            ending = flight(setup, start, *faults, STEPS, LONGEST)
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
    report(figures, [ending for *_, ending in worst], visited)
    again = [faulty_flight(setup, start, *faults, STEPS, LONGEST) == ending for *_, start, faults, ending in worst]
    figures.check(all(again), f"the worst {WORST} flown again by CPython: {sum(again)} with the same bits")


def report(figures, endings, visited):
    """Print the extremes of the worst flights, and which pairs of mode and condition were met."""
    figures.at_most("touchdown speed, worst", max(one.speed for one in endings if one.touched), 1.5, "m/s")
    figures.at_most("tilt in flight, worst", math.degrees(max(one.largest_tilt for one in endings)), 60.0, "deg")
    figures.at_most("climb above the hover, worst", max(one.climb for one in endings), CLIMB, "m")
    figures.show(f"longest of the worst {max(one.steps for one in endings) * PERIOD * 1e-9:.1f} s")
    met = [bit for bit in range(3 * CONDITIONS) if visited >> bit & 1]
    pairs = [(GuardMode(bit // CONDITIONS).name.lower(), guard.REASONS[bit % CONDITIONS]) for bit in met]
    figures.show(f"{len(pairs)} pairs of mode and condition met: " + ", ".join(f"{mode}/{why}" for mode, why in pairs))
