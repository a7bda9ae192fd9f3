"""The closed loop without ROS, in the order of decision record 0001, as one text for CPython and Numba.

``fly_of`` returns the loop of a flight, a closure over what its plug-ins do. What the laws answer in a step is
``stages.answer_of``, made from the table of the cascade. What the nodes publish at plant step k is what this loop logs
at step k. ``take_off`` plans the trajectory; it alone is never compiled.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from quad_core.cycle import ReferenceLag, followed, is_flyable, seconds, steps_to_cover
from quad_core.enumerations import GuardMode, GuardRequest
from quad_core.lift_off import airborne, standing
from quad_core.node_parameters import GuardParameters
from quad_core.types import Actuation, Disturbance, TrajectoryPoint, VehicleState, with_ground
from quad_core.vehicle import Vehicle
from quad_dynamics.simulated_vehicle import (
    LinkMemory,
    RandomStreams,
    SimulatedVehicle,
    VehicleFunctions,
    receive,
    sensing_is_active,
)
from quad_dynamics.simulated_vehicle import Memory as VehicleMemory
from quad_flight.score import NOTHING_SCORED, Score, scored, with_torque_change
from quad_guard.checks import StateSample
from quad_guard.ending import is_down
from quad_guard.guard import FRESH_MEMORY
from quad_guard.guard import Inputs as GuardInputs
from quad_guard.guard import Memory as GuardMemory
from quad_guard.guard import step as guard_step

FLYING = 0
ENDED = 1
DIVERGED = 2
REFUSED = 3  # a law gave or remembered a number that is not finite: over ROS it would not have been published
TAKEN_OVER = 4  # the guard took the vehicle from the controller; the flight ended when it was down, or with the plan
INFEASIBLE = 5  # the flight went on to its end, but the reference had asked for more than the vehicle has


Function = Callable[..., Any]


class Functions(NamedTuple):
    """What the loop calls of a flight's plug-ins. ``side``: those of the vehicle; ``answer``: all stages together."""

    side: VehicleFunctions
    plant_lumped: Function
    disturbance_sample: Function
    trajectory_plan: Function
    trajectory_sample: Function
    trajectory_duration: Function
    answer: Function
    distance_behind: Function


class Schedule(NamedTuple):
    """Plant period in ns, periods of trajectory and stages in plant steps, from which t in s errors are counted."""

    plant_period: int
    trajectory_steps: int
    stage_steps: Any
    score_from: float


class Setup(NamedTuple):
    """Parameter sets of one flight, as the plug-ins declare them.

    ``stages``: one per stage of the cascade; ``internals``: what the log shows of each before its first step.
    As ``fly`` sets them: ``has_ground``, the plant has a ground on which the vehicle can come to rest; ``stands``, it
    stands there at step 0.
    """

    vehicle: Vehicle
    schedule: Schedule
    plant: Any
    disturbance: Any
    trajectory: Any
    sensing: Any
    stages: Any
    internals: Any
    guard: GuardParameters = GuardParameters()
    has_ground: bool = False
    stands: bool = False


class Start(NamedTuple):
    """What sensors, command link and stages remember, and what the stages have said, before step 0."""

    sensing: Any
    link: LinkMemory
    memory: Any
    signals: Any


class LoopState(NamedTuple):
    """All that one step hands to the next. ``step`` is the next plant step, ``end`` the first not flown.

    ``refused``: number of the stage that was refused, from 1; 0: none. ``side``: what the vehicle's side remembers.
    """

    step: int
    end: int
    outcome: int
    refused: int
    side: VehicleMemory
    plan: Any
    memory: Any
    reference: TrajectoryPoint
    signals: Any
    guard: GuardMemory
    score: Score
    behind: ReferenceLag


class Row(NamedTuple):
    """What the step topics carry at one plant step, or carried last."""

    truth: VehicleState
    state: VehicleState
    disturbance: Disturbance
    actuation: Actuation
    reference: TrajectoryPoint
    signals: Any
    internals: Any


def side_of(setup: Setup) -> SimulatedVehicle:
    """Return what does not change of the vehicle's side."""
    return SimulatedVehicle(setup.vehicle, setup.schedule.plant_period, setup.plant, setup.disturbance, setup.sensing)


def take_off(functions: Functions, setup: Setup, drawn: RandomStreams, start: Start) -> LoopState:
    """Return the flight before step 0: plant at its initial state, trajectory planned from what is seen of it.

    It runs once per flight, in plain Python.
    """
    side = side_of(setup)
    memory = functions.side.begin(side, start.sensing, start.link)
    truth = functions.side.observe(side, memory)
    conditions = functions.disturbance_sample(setup.disturbance, drawn.weather, 0.0)
    state, _ = functions.side.sense(side, drawn, memory, truth, conditions, True, 0)
    lift = airborne(setup.guard.ground_height)
    if setup.stands:
        lift = standing(state.p_w.z)
        state = with_ground(state, lift.ground_z, lift.on_ground)
    plan = functions.trajectory_plan(setup.trajectory, setup.vehicle, state)
    duration = functions.trajectory_duration(setup.trajectory, plan)
    return LoopState(
        step=0,
        end=steps_to_cover(duration, setup.schedule.plant_period),
        outcome=FLYING if is_flyable(truth) else DIVERGED,
        refused=0,
        side=memory._replace(sensing=start.sensing, lift=lift),
        plan=plan,
        memory=start.memory,
        reference=TrajectoryPoint(),
        signals=start.signals,
        guard=FRESH_MEMORY,
        score=NOTHING_SCORED,
        behind=ReferenceLag(),
    )


def fly_of(functions: Functions, write: Any = None) -> Function:
    """Return ``fly`` of a flight with these plug-ins; ``write(rows, row number, Row)`` logs a step, None: it does not.

    A loop that is compiled without it is free of it.
    """
    observe, sense, move = functions.side.observe, functions.side.sense, functions.side.move
    plant_lumped, disturbance_sample = functions.plant_lumped, functions.disturbance_sample
    trajectory_sample, answer = functions.trajectory_sample, functions.answer
    distance_behind = functions.distance_behind
    is_logging = write is not None

    def fly(setup: Setup, drawn: RandomStreams, carry: LoopState, steps: int, rows: Any) -> LoopState:
        """Return the flight ``steps`` plant steps later, sooner at its end; if it logs, ``rows`` gets a row per step.

        The outcome is DIVERGED when the true state is no longer flyable, REFUSED when a stage was refused: that step
        is logged, but not flown. It is TAKEN_OVER when the guard flew to the end, which then is where the vehicle is
        down, and INFEASIBLE at the planned end when the vehicle, at a limit, had come no nearer to its reference for
        too long.
        """
        vehicle = setup.vehicle
        schedule = setup.schedule
        plant_dt = seconds(1, schedule.plant_period)
        internals = setup.internals
        k = carry.step
        outcome = carry.outcome
        refused = carry.refused
        fixed = side_of(setup)
        side = carry.side
        # not carried: its numbers are those of the plant's state, of which the compiled loop keeps one copy then
        truth = observe(fixed, side)
        memory = carry.memory
        reference = carry.reference
        signals = carry.signals
        guard = carry.guard
        command_steps = schedule.stage_steps[-1]
        score = carry.score
        behind = carry.behind
        stop = k + steps
        if stop > carry.end:
            stop = carry.end

        while outcome == FLYING and k < stop:
            time = seconds(k, schedule.plant_period)
            conditions = disturbance_sample(setup.disturbance, drawn.weather, time)
            state = truth
            # Numba counts references to the arrays of a call: skipping `sense` saves a tenth of a step
            if sensing_is_active(side, conditions):
                state, side = sense(fixed, drawn, side, truth, conditions, True, k)
            # the last stage's output is the command that the vehicle obeys
            before = signals[-1]
            if is_logging:
                disturbance = plant_lumped(setup.plant, vehicle, side.plant, before, conditions)

            if k % schedule.trajectory_steps == 0:
                reference = trajectory_sample(setup.trajectory, carry.plan, time)
                if reference.trajectory_time >= schedule.score_from:
                    score = scored(score, truth, reference)

            signals, memory, internals, refused = answer(
                setup, memory, signals, internals, state, reference, side.actuation, k
            )
            after = truth
            if refused == 0:
                if k % schedule.stage_steps.position_controller == 0:
                    distance = distance_behind(internals.position_controller)
                    behind = followed(behind, distance, k * schedule.plant_period)
                command = signals[-1]
                if score.samples > 0:
                    score = with_torque_change(score, before.torque_b, command.torque_b)
                # a command holds until the next one: it is that of the step which the last stage answered
                answered = k if command_steps == 1 else k - k % command_steps
                received, side = receive(fixed, drawn, side, conditions, command, answered, k)
                flown = received.wrench
                if setup.guard.enabled:
                    sample = StateSample(state, k, True)
                    inputs = GuardInputs(k, schedule.plant_period, received, sample, GuardRequest.NONE)
                    flown, guard, _ = guard_step(setup.guard, vehicle, guard, inputs, plant_dt)
                side = move(fixed, side, conditions, flown)
                after = observe(fixed, side)
            if is_logging:
                write(
                    rows, k - carry.step, Row(truth, state, disturbance, side.actuation, reference, signals, internals)
                )
            if refused > 0:
                outcome = REFUSED
            else:
                truth = after
                k += 1
                if not is_flyable(truth):
                    outcome = DIVERGED
                elif guard.mode != GuardMode.PASS and is_down(setup.guard, guard, truth, setup.has_ground):
                    outcome = TAKEN_OVER
                elif k == carry.end:
                    outcome = TAKEN_OVER
                    if guard.mode == GuardMode.PASS:
                        outcome = ENDED if behind.infeasible_ns < 0 else INFEASIBLE

        return LoopState(
            step=k,
            end=carry.end,
            outcome=outcome,
            refused=refused,
            side=side,
            plan=carry.plan,
            memory=memory,
            reference=reference,
            signals=signals,
            guard=guard,
            score=score,
            behind=behind,
        )

    # Numba's file cache tells functions apart by it
    fly.__qualname__ = "fly_logged" if is_logging else "fly"
    return fly
