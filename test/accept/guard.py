"""The guard's backup law from 100,000 random states of three vehicles to the ground, compiled; and without any state.

The second part loses the state for good in a hover at 2 and 5 m: beside motors off at once, with mass errors of 5 % and
a torque from outside that the model does not know.
"""

import itertools
import math
import random

from guard_flights import STATE_LOST, Fault, Setup, descent, draw_start, faulty_flight, vehicle_named

from quad_core.compilation import compiled
from quad_core.enumerations import GuardMode
from quad_core.node_parameters import GuardParameters
from quad_core.types import Conditions, Vec3
from quad_dynamics.parameters import PlantParameters

FLIGHTS = 34_000
LONGEST = 60_000
LONGEST_GAP = 240
BLIND = 500
BIASES = (0.0, 0.1, 0.3, 1.0)  # rad/s^2 about a random axis across body z
EVEN = 1.0  # rad/s^2 with which flying blind is as fast as falling: 9.3 and 9.2 m/s for an x500 from 5 m
KNOWN = 50  # steps with a state before it is lost


def run(figures):
    fly = compiled(faulty_flight)
    for seed, name in enumerate(("paper", "x500", "crazyflie21")):
        vehicle, rng = vehicle_named(name), random.Random(seed)
        fastest, steepest, others = 0.0, 0.0, 0
        for _ in range(FLIGHTS):
            plant = PlantParameters(mass_error=rng.uniform(-0.1, 0.1) * vehicle.mass)
            start = draw_start(rng, vehicle, (5.0, 10.0))
            begin = rng.randrange(3000)
            gap = Fault(STATE_LOST, begin, begin + rng.randrange(LONGEST_GAP))
            ending = descent(Setup(vehicle, plant=plant), start, LONGEST, gap, fly)
            fastest, steepest = max(fastest, ending.speed), max(steepest, ending.tilt)
            others += not ending.touched or not ending.finite or ending.mode != GuardMode.DESCEND
        figures.check(others == 0, f"{name}: {FLIGHTS} flights, {others} that did not land under the backup law")
        figures.at_most(f"{name}: touchdown speed, worst of {FLIGHTS}", fastest, 1.5, "m/s")
        figures.at_most(f"{name}: tilt at touchdown, worst of {FLIGHTS}", math.degrees(steepest), 15.0, "deg")
        without_state(figures, name, fly)


def without_state(figures, name, fly):
    """Compare the model flown blind with motors off, in touchdown speed."""
    vehicle, limits = vehicle_named(name), GuardParameters()
    off = limits._replace(state=limits.state._replace(gone_age=limits.state.lost_age))
    for height, bias in itertools.product((2.0, 5.0), BIASES):
        rng, speeds = random.Random(7), ([], [])
        for _ in range(BLIND):
            plant = PlantParameters(mass_error=rng.uniform(-0.05, 0.05) * vehicle.mass)
            start = draw_start(rng, vehicle, (height, height), tilt=15.0, speed=1.0, rate=0.3)
            towards = rng.uniform(-math.pi, math.pi)
            x, y = bias * vehicle.inertia_xx * math.cos(towards), bias * vehicle.inertia_yy * math.sin(towards)
            acts = Conditions(torque_b=Vec3(x, y, 0.0))
            for parameters, found in zip((limits, off), speeds, strict=True):
                setup = Setup(vehicle, parameters, plant, acts)
                found.append(descent(setup, start, LONGEST, Fault(STATE_LOST, KNOWN, LONGEST), fly).speed)
        flown, fallen = map(sorted, speeds)
        figures.check(
            flown[BLIND // 2] < fallen[BLIND // 2] * (1.05 if bias == EVEN else 1.0),
            f"{name}: no state from {height:g} m, {bias:g} rad/s^2 unknown: median {flown[BLIND // 2]:.1f} m/s, "
            f"worst {flown[-1]:.1f} m/s; motors off {fallen[BLIND // 2]:.1f} and {fallen[-1]:.1f} m/s",
        )
