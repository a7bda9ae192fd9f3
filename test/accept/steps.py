"""First flights in steps: 1,000 random faults at each, compiled, in lockstep and with the delays of real time.

A hover at the height of the step's take-off meets one fault: of commands or states, a law gone wrong, a reference that
runs away, a push. Lost is what comes down faster than 2 m/s, leaning more than 15 degrees, or with its motors stopped
in the air. In real time commands come every 4 to 8 ms, each one interval late.
"""

import math
import random
from typing import NamedTuple

from guard_flights import (
    ATTITUDE,
    FOOT,
    NO_FAULT,
    PERIOD,
    POSITION,
    Fault,
    acts,
    draw_start,
    seen_state,
    spoiled,
    tilt_of,
    vehicle_named,
)

from quad_attitude_ctrl import abfnitsm
from quad_bringup.steps import STEPS
from quad_core.compilation import compiled
from quad_core.geometry import norm
from quad_core.node_parameters import GuardParameters, StepLimits
from quad_core.types import (
    ALL_ROTORS,
    NO_LINK_FAULT,
    NO_SENSOR_FAULT,
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    Conditions,
    PositionInputs,
    Quat,
    Rotors,
    TrajectoryPoint,
    Vec3,
    Wrench,
)
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.parameters import PlantParameters
from quad_guard import guard
from quad_guard.checks import WrenchCommand, broken_limit
from quad_guard.guard import FRESH_MEMORY, Inputs
from quad_position_ctrl import aibs

THRUST, TORQUE, REVERSED, REFERENCE, PUSH = 20, 21, 22, 23, 24
NAMES = {
    0: "wrench lost", 1: "wrench NaN", 2: "wrench absurd", 3: "wrench old", 4: "state lost", 5: "state jumps",
    6: "state frozen", 7: "state NaN", THRUST: "thrust wrong", TORQUE: "torque offset", REVERSED: "torque reversed",
    REFERENCE: "reference runs away", PUSH: "pushed",
}  # fmt: skip
HEIGHTS = {"hop": 0.5, "hover": 1.0, "box": 1.5, "full": 2.0}
EACH, STEPS_FLOWN, LONGEST = 1000, 2500, 20_000
MARGINS = {"hop": 0.4, "hover": 0.6, "box": 0.9, "full": math.inf}  # m: what docs/how_to/first_flights.md states
HANDED_BACK, SPEED, TILT = 0.1, 2.0, 15.0  # s, m/s, deg

guard_step = guard.step
position_init, position_step = aibs.init, aibs.step
attitude_init, attitude_step = abfnitsm.init, abfnitsm.step
plant_step, observe = rigid_body.step, rigid_body.observe


class Case(NamedTuple):
    """A flight: parameters, start, one fault with its vector and size, plant steps from one command to the next."""

    vehicle: Vehicle
    guard: GuardParameters
    plant: PlantParameters
    start: rigid_body.State
    fault: Fault
    vector: Vec3
    size: float
    interval: int


class Ending(NamedTuple):
    """How a flight ended: mode and reason of the guard, contact, speed m/s and tilt rad then, m beyond the box.

    ``beyond``: the first step beyond a limit in truth, ``taken``: at which the guard took over; -1: never.
    """

    finite: bool
    mode: int
    reason: int
    touched: bool
    speed: float
    tilt: float
    outside: float
    beyond: int
    taken: int


def wrong(case: Case, wrench: Wrench, weight: float, k: int) -> Wrench:
    """Return what a law that has gone wrong makes of ``wrench``."""
    torque, v = wrench.torque_b, case.vector
    if acts(case.fault, THRUST, k):
        return Wrench(case.size * weight, torque)
    if acts(case.fault, TORQUE, k):
        return Wrench(wrench.thrust, Vec3(torque.x + v.x, torque.y + v.y, torque.z + v.z))
    if acts(case.fault, REVERSED, k):
        return Wrench(wrench.thrust, Vec3(-torque.x, -torque.y, torque.z))
    return wrench


def flight(case: Case, steps: int, longest: int) -> Ending:
    """Return how a hover under one fault ends; a descent is followed to the ground."""
    vehicle, plant, fault = case.vehicle, case.start, case.fault
    dt, every = PERIOD / 1e9, case.interval
    limits, weight = case.guard.step, vehicle.mass * vehicle.gravity
    zero, none = Vec3(0.0, 0.0, 0.0), Rotors(0.0, 0.0, 0.0, 0.0)
    actuation = Actuation(none, none, 0.0, zero, False, False, False, False, False)
    setpoint = AttitudeThrust(zero, zero, zero, Quat(0.0, 0.0, 0.0, 1.0), weight, 0.0)
    memory = FRESH_MEMORY
    position, attitude = position_init(POSITION, vehicle), attitude_init(ATTITUDE, vehicle)
    first = observe(case.plant, vehicle, plant)
    home, frozen, truth = first.p_w, first, first
    wrench, answered, k = Wrench(weight, zero), 0, 0
    mode, reason, beyond, taken, outside = 0, 0, -1, -1, 0.0
    finite, touched, stopped = True, False, False
    while finite and not touched and not stopped and k < longest and (k < steps or mode == 1):
        sample = seen_state(truth, frozen, fault, NO_FAULT, NO_FAULT, k)
        frozen = sample.state
        arrived = k % every == 0
        command = WrenchCommand(wrench, answered, arrived and k > 0)
        # a node drops what is not finite
        if arrived and sample.arrived and sample.state.q_wb.x == sample.state.q_wb.x:
            away = case.size * dt * (k - fault.begin) if acts(fault, REFERENCE, k) else 0.0
            place = Vec3(home.x + away * case.vector.x, home.y + away * case.vector.y, home.z + away * case.vector.z)
            if k // every % 5 == 0:
                point = TrajectoryPoint(0.0, place, zero, zero, zero, zero, 0.0, 0.0, 0.0)
                seen = PositionInputs(sample.state, point, actuation)
                setpoint, position, _ = position_step(POSITION, vehicle, position, seen, 5 * every * dt)
            given = AttitudeInputs(sample.state, setpoint, actuation)
            made, attitude, _ = attitude_step(ATTITUDE, vehicle, attitude, given, every * dt)
            wrench, answered = wrong(case, made, weight, k), k
            if every == 1:
                command = WrenchCommand(wrench, k, sample.arrived)
        inputs = Inputs(k, PERIOD, spoiled(command, fault, NO_FAULT, NO_FAULT, k), sample, 0)
        flown, memory, report = guard_step(case.guard, vehicle, memory, inputs, dt)
        mode, reason, stopped = report.status.mode, report.status.reason, report.status.stopped
        if mode != 0 and taken < 0:
            taken = k
        push = case.vector if acts(fault, PUSH, k) else zero
        conditions = Conditions(push, zero, zero, 0.0, ALL_ROTORS, 1.0, NO_SENSOR_FAULT, NO_LINK_FAULT)
        plant, actuation = plant_step(case.plant, vehicle, plant, flown, conditions, dt)
        k += 1
        truth = observe(case.plant, vehicle, plant)
        p = truth.p_w
        finite = math.isfinite(norm(p) + norm(truth.v_w) + norm(truth.omega_b))
        outside = max(outside, abs(p.x - home.x) - limits.box, abs(p.y - home.y) - limits.box, p.z - limits.box)
        if beyond < 0 and broken_limit(limits, home, 0.0, p, truth.v_w, truth.q_wb) != 0:
            beyond = k
        touched = p.z <= FOOT
    return Ending(finite, mode, reason, touched, norm(truth.v_w), tilt_of(truth), outside, beyond, taken)


def drawn(rng: random.Random, name: str, vehicle: Vehicle) -> Case:
    """Return a random case of a step."""
    limits: StepLimits = STEPS[name].limits
    kind = rng.choice(list(NAMES))
    begin = rng.randrange(250, 800)
    end = LONGEST if kind in (THRUST, TORQUE, REVERSED, REFERENCE) else begin + rng.randrange(1, 400)
    towards, rise = rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0)
    flat = math.sqrt(1.0 - rise * rise)
    vector, size = Vec3(flat * math.cos(towards), flat * math.sin(towards), rise), 1.0
    if kind == THRUST:
        size = rng.uniform(0.0, 3.0)
    elif kind == TORQUE:
        most = rng.uniform(0.02, 1.0) * 0.25 * vehicle.mass * vehicle.gravity * vehicle.arm_length
        vector = Vec3(most * vector.x, most * vector.y, 0.0)
    elif kind == REFERENCE:
        size = rng.uniform(0.3, 3.0) * limits.speed
    elif kind == PUSH:
        most = rng.uniform(0.05, 0.4) * vehicle.mass * vehicle.gravity
        vector = Vec3(most * vector.x, most * vector.y, most * vector.z)
    height = HEIGHTS[name]
    return Case(
        vehicle,
        GuardParameters(step=limits),
        PlantParameters(mass_error=rng.uniform(-0.05, 0.05) * vehicle.mass),
        draw_start(rng, vehicle, (height, height), tilt=1.0, speed=0.05, rate=0.05),
        Fault(kind, begin, end),
        vector,
        size,
        rng.choice((1, 2, 3, 4)),
    )


def run(figures):
    fly, vehicle, rng = compiled(flight), vehicle_named("paper"), random.Random(5)
    for name in [step for step in HEIGHTS if figures.wants(step)]:
        cases = [drawn(rng, name, vehicle) for _ in range(figures.each(EACH))]
        endings = [fly(case, STEPS_FLOWN, LONGEST) for case in cases]
        lost = [
            (case, end)
            for case, end in zip(cases, endings, strict=True)
            if not end.finite or end.mode == 2 or (end.touched and (end.speed > SPEED or math.degrees(end.tilt) > TILT))
        ]
        for case, end in lost[:5]:
            figures.show(f"{NAMES[case.fault.kind]}, every {case.interval}, {case.vector}, {case.size}: {end}")
        late = [
            (end.taken - end.beyond) * PERIOD / 1e9 if end.taken >= 0 else math.inf
            for end in endings
            if end.beyond >= 0
        ]
        taken = sum(end.taken >= 0 for end in endings)
        figures.check(not lost, f"{name}: {len(cases)} faults, {taken} handed back, {len(lost)} lost")
        figures.at_most(f"{name}: limit broken until handed back, worst of {len(late)}", max(late), HANDED_BACK, "s")
        figures.at_most(f"{name}: beyond the box, worst", max(end.outside for end in endings), MARGINS[name], "m")
        down = [end for end in endings if end.touched]
        figures.at_most(f"{name}: touchdown speed, worst", max(end.speed for end in down), SPEED, "m/s")
        again = [flight(case, STEPS_FLOWN, LONGEST) == end for case, end in zip(cases[:3], endings[:3], strict=True)]
        figures.check(all(again), f"{name}: flown again by CPython: {sum(again)} of {len(again)} with the same bits")
