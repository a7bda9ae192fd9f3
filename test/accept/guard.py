"""The guard's backup law from 100,000 random states of three vehicles to the ground, compiled."""

import math
import random

from figures import Figures
from guard_flights import descent, draw_start, vehicle_named

from quad_core import guard
from quad_core.compilation import compiled
from quad_core.guard_parameters import GuardParameters
from quad_dynamics.parameters import PlantParameters

FLIGHTS = 34_000
LONGEST = 60_000
LONGEST_GAP = 240


def main():
    figures, fly = Figures(), compiled(descent)
    for seed, name in enumerate(("paper", "x500", "crazyflie21")):
        vehicle, rng = vehicle_named(name), random.Random(seed)
        fastest, steepest, others = 0.0, 0.0, 0
        for _ in range(FLIGHTS):
            plant = PlantParameters(mass_error=rng.uniform(-0.1, 0.1) * vehicle.mass)
            start = draw_start(rng, vehicle, (5.0, 10.0))
            begin = rng.randrange(3000)
            end = begin + rng.randrange(LONGEST_GAP)
            ending = fly(GuardParameters(), plant, vehicle, start, LONGEST, begin, end)
            fastest, steepest = max(fastest, ending.speed), max(steepest, ending.tilt)
            others += not ending.touched or not ending.finite or ending.mode != guard.DESCEND
        figures.check(others == 0, f"{name}: {FLIGHTS} flights, {others} that did not land under the backup law")
        figures.at_most(f"{name}: touchdown speed, worst of {FLIGHTS}", fastest, 1.5, "m/s")
        figures.at_most(f"{name}: tilt at touchdown, worst of {FLIGHTS}", math.degrees(steepest), 15.0, "deg")
    return figures.code()
