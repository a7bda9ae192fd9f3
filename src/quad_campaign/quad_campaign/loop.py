"""The closed loop without ROS, in the order of decision record 0001, as one text for CPython and Numba.

The stages are names that ``engine.link`` binds to the functions of the chosen plug-ins; everything else is plain
text. What the nodes publish at plant step k is what this loop appends at step k.
"""

import math
from typing import Any, NamedTuple

from quad_campaign.score import Score, scored, with_torque_change
from quad_campaign.stages import (
    attitude_init,
    attitude_step,
    disturbance_sample,
    plan,
    plant_init,
    plant_lumped,
    plant_observe,
    plant_step,
    position_init,
    position_step,
    sensing_step,
    trajectory_duration,
    trajectory_sample,
)
from quad_core.bounds import is_flyable
from quad_core.timing import seconds, steps_to_cover
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    Disturbance,
    PositionInputs,
    Quat,
    Rotors,
    TrajectoryPoint,
    Vec3,
    VehicleState,
    Wrench,
)
from quad_core.vehicle import Vehicle
from quad_dynamics.link import Memory as LinkMemory
from quad_dynamics.link import step as link_step
from quad_dynamics.sensor import is_faulty

FLYING = 0
ENDED = 1
DIVERGED = 2
REFUSED = 3
"""A law gave a number that is not finite: over ROS it would not have been published."""


class Schedule(NamedTuple):
    """Plant period in ns, periods of the stages in plant steps, and from which t in s errors are counted."""

    plant_period: int
    trajectory_steps: int
    position_steps: int
    attitude_steps: int
    score_from: float


class Setup(NamedTuple):
    """Parameter sets of one flight, as the plug-ins declare them."""

    vehicle: Vehicle
    schedule: Schedule
    plant: Any
    disturbance: Any
    trajectory: Any
    position: Any
    attitude: Any
    sensing: Any


class Drawn(NamedTuple):
    """The 2-D arrays of one flight: what disturbance and sensing drew, and the delay lines of sensors and command link.

    They stand apart from what a step hands to the next, because Numba counts references to an array at every hand-over.
    """

    weather: Any
    noise: Any
    sensing_line: Any
    link_line: Any


class Carry(NamedTuple):
    """All that one step hands to the next. ``step`` is the next plant step, ``end`` the first not flown."""

    step: int
    end: int
    outcome: int
    plant: Any
    sensing: Any
    link: LinkMemory
    plan: Any
    position: Any
    attitude: Any
    reference: TrajectoryPoint
    setpoint: AttitudeThrust
    wrench: Wrench
    applied: Wrench
    actuation: Actuation
    score: Score


class Records(NamedTuple):
    """What the step topics would carry; a list has an item per step of its publisher."""

    truth: list[VehicleState]
    state: list[VehicleState]
    disturbance: list[Disturbance]
    actuation: list[Actuation]
    reference: list[TrajectoryPoint]
    attitude_setpoint: list[AttitudeThrust]
    position_internals: list[Any]
    wrench_setpoint: list[Wrench]
    attitude_internals: list[Any]


def take_off(setup: Setup, drawn: Drawn, sensing: Any, link: LinkMemory) -> Carry:
    """Return the flight before its first step: plant at its initial state, trajectory planned from what is seen of it.

    ``sensing`` and ``link`` are the memories of sensors and command link before step 0.
    """
    plant = plant_init(setup.plant, setup.vehicle)
    truth = plant_observe(setup.plant, setup.vehicle, plant)
    conditions = disturbance_sample(setup.disturbance, drawn.weather, 0.0)
    state, _ = sensing_step(setup.sensing, drawn.noise, drawn.sensing_line, sensing, truth, conditions.sensor, 0)
    path = plan(setup.trajectory, setup.vehicle, state)
    duration = trajectory_duration(setup.trajectory, path)
    zero = Vec3(0.0, 0.0, 0.0)
    none = Rotors(0.0, 0.0, 0.0, 0.0)
    return Carry(
        0,
        steps_to_cover(duration, setup.schedule.plant_period),
        FLYING if is_flyable(truth) else DIVERGED,
        plant,
        sensing,
        link,
        path,
        position_init(setup.position, setup.vehicle),
        attitude_init(setup.attitude, setup.vehicle),
        TrajectoryPoint(0.0, zero, zero, zero, zero, zero, 0.0, 0.0, 0.0),
        AttitudeThrust(zero, zero, zero, Quat(0.0, 0.0, 0.0, 1.0), 0.0, 0.0),
        Wrench(0.0, zero),
        Wrench(0.0, zero),
        Actuation(none, none, 0.0, zero, False, False, False, False, False),
        Score(0, 0.0, 0.0, 0.0, 0.0),
    )


def fly(setup: Setup, drawn: Drawn, carry: Carry, steps: int, logging: bool) -> tuple[Carry, Records]:
    """Return the flight ``steps`` plant steps later (sooner at its end) and, if ``logging``, what happened.

    The outcome is DIVERGED when the true state left ``quad_core.bounds``. ``carry`` is used up.
    """
    truths = []
    states = []
    disturbances = []
    actuations = []
    references = []
    setpoints = []
    position_internals = []
    wrenches = []
    attitude_internals = []

    vehicle = setup.vehicle
    schedule = setup.schedule
    weather = drawn.weather
    noise = drawn.noise
    sensing_line = drawn.sensing_line
    link_line = drawn.link_line
    plant_dt = seconds(1, schedule.plant_period)
    position_dt = seconds(schedule.position_steps, schedule.plant_period)
    attitude_dt = seconds(schedule.attitude_steps, schedule.plant_period)
    k = carry.step
    outcome = carry.outcome
    plant = carry.plant
    truth = plant_observe(setup.plant, vehicle, plant)
    sensing_memory = carry.sensing
    link_memory = carry.link
    position_memory = carry.position
    attitude_memory = carry.attitude
    reference = carry.reference
    setpoint = carry.setpoint
    wrench = carry.wrench
    applied = carry.applied
    actuation = carry.actuation
    score = carry.score
    stop = k + steps
    if stop > carry.end:
        stop = carry.end

    while outcome == FLYING and k < stop:
        time = seconds(k, schedule.plant_period)
        conditions = disturbance_sample(setup.disturbance, weather, time)
        state = truth
        if sensing_memory.active or sensing_memory.frozen or is_faulty(conditions.sensor):
            state, sensing_memory = sensing_step(
                setup.sensing, noise, sensing_line, sensing_memory, truth, conditions.sensor, k
            )
        if logging:
            truths.append(truth)
            states.append(state)
            disturbances.append(plant_lumped(setup.plant, vehicle, plant, wrench, conditions))

        if k % schedule.trajectory_steps == 0:
            reference = trajectory_sample(setup.trajectory, carry.plan, time)
            if reference.trajectory_time >= schedule.score_from:
                score = scored(score, truth, reference)
            if logging:
                references.append(reference)

        if k % schedule.position_steps == 0:
            setpoint, position_memory, seen = position_step(
                setup.position, vehicle, position_memory, PositionInputs(state, reference, actuation), position_dt
            )
            if not is_finite_setpoint(setpoint):
                outcome = REFUSED
            elif logging:
                setpoints.append(setpoint)
                position_internals.append(seen)

        if outcome == FLYING and k % schedule.attitude_steps == 0:
            before = wrench
            wrench, attitude_memory, watched = attitude_step(
                setup.attitude, vehicle, attitude_memory, AttitudeInputs(state, setpoint, actuation), attitude_dt
            )
            if not is_finite_wrench(wrench):
                outcome = REFUSED
            elif score.samples > 0:
                score = with_torque_change(score, before.torque_b, wrench.torque_b)
            if logging and outcome == FLYING:
                wrenches.append(wrench)
                attitude_internals.append(watched)

        if outcome == FLYING:
            if conditions.link.delay <= 0.0 and not conditions.link.lost:
                applied = wrench
            else:
                applied, link_memory = link_step(link_line, link_memory, conditions.link, wrench, applied, k, plant_dt)
            plant, actuation = plant_step(setup.plant, vehicle, plant, applied, conditions, plant_dt)
            if logging:
                actuations.append(actuation)
            truth = plant_observe(setup.plant, vehicle, plant)
            k += 1
            if not is_flyable(truth):
                outcome = DIVERGED
            elif k == carry.end:
                outcome = ENDED

    return (
        Carry(
            k,
            carry.end,
            outcome,
            plant,
            sensing_memory,
            link_memory,
            carry.plan,
            position_memory,
            attitude_memory,
            reference,
            setpoint,
            wrench,
            applied,
            actuation,
            score,
        ),
        Records(
            truths,
            states,
            disturbances,
            actuations,
            references,
            setpoints,
            position_internals,
            wrenches,
            attitude_internals,
        ),
    )


def is_finite_setpoint(setpoint: AttitudeThrust) -> bool:
    """Tell whether the position law's answer could be sent."""
    q = setpoint.q_wb
    return (
        is_finite_vector(setpoint.angles)
        and is_finite_vector(setpoint.rates)
        and is_finite_vector(setpoint.accelerations)
        and math.isfinite(q.x + q.y + q.z + q.w)
        and math.isfinite(setpoint.thrust)
        and math.isfinite(setpoint.thrust_fraction)
    )


def is_finite_wrench(wrench: Wrench) -> bool:
    """Tell whether the attitude law's answer could be sent."""
    return math.isfinite(wrench.thrust) and is_finite_vector(wrench.torque_b)


def is_finite_vector(v: Vec3) -> bool:
    """Tell whether all three components are finite."""
    return math.isfinite(v.x) and math.isfinite(v.y) and math.isfinite(v.z)
