"""INDI of the acceleration: differential-flatness tracking by increments, a ``quad.position_law`` plug-in.

    a_c     = a_d - K_x e_x - K_v e_v - K_a (a_f - a_d)                             wanted acceleration, m/s^2
    a       = dv/dt,  k = F_T/m b_z - g e_3 + a_7 v                                 measured, and what is explained
    a_f     = H(s) a,  k_f = H(s) k,  H(s) = (b / (s + b))^2                        the same filter for both
    U       = a_c - (a_f - k_f) - a_7 v                                             acceleration to be made by thrust
    F       = m (U + g e_3),  f = F . R e_3,  b_1, b_2, b_3 as in ``se3``           thrust and attitude

Source: Tal and Karaman, Accurate tracking of aggressive quadrotor trajectories using incremental nonlinear dynamic
inversion and differential flatness, IEEE TCST 29(3), 2021 (arXiv 1809.04048): the thrust vector that is given plus what
acceleration is missing, thrust_c = thrust_f + m (a_c - a_f). The drag model is that of Sun et al., A comparative study
of nonlinear MPC and differential-flatness-based control for quadrotor agile flight, IEEE T-RO 38(6), 2022 (arXiv
2109.01365): the drag known now stands in the place of the filtered one. Their rates are those of jerk and snap:
``feed_forward`` here, `command: led` or `feed_forward` of the attitude law `indi`, which adds the increments of
torque. F_T is what the rotors gave (`actuation`), so limits wind nothing up. The acceleration is the change of the
velocity over the last step, as no topic carries an accelerometer.
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, TwoLags, add, body_z, low_passed_twice, scale, slope, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals, Vec3
from quad_core.vehicle import DragSign, Vehicle
from quad_position_ctrl.se3 import pointed, shown, tracking
from quad_position_ctrl.setpoint import FeedForward, LiftLimits, drag_model, slow_presets
from quad_position_ctrl.speed_limit import SpeedLimits

Internals = PositionInternals


class Gains(NamedTuple):
    """Gains of one direction."""

    position: Annotated[float, Real("1/s^2", "position gain K_x; larger: stiffer", 0.01, 1e4)] = 18.0
    velocity: Annotated[float, Real("1/s", "velocity gain K_v; larger: more damped", 0.01, 1e3)] = 7.8
    acceleration: Annotated[float, Real("", "acceleration gain K_a; larger: stiffer against pushes", 0.0, 10.0)] = 0.5


class Parameters(NamedTuple):
    """Parameters of INDI of the acceleration."""

    xy: Gains = Gains()
    z: Gains = Gains()
    bandwidth: Annotated[
        float, Real("rad/s", "poles b of acceleration's and thrust's filter; larger: noisier", 0.1, 1e4)
    ] = 20.0
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    feed_forward: FeedForward = False


class Memory(NamedTuple):
    """Velocity m/s and body z axis of the last step, acceleration and what explains it, filtered."""

    velocity: Vec3 = Vec3()
    thrust_axis: Vec3 = Vec3()
    acceleration: TwoLags = TwoLags()
    explained: TwoLags = TwoLags()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: nothing is missing."""
    return Memory(ZERO, ZERO, TwoLags(ZERO, ZERO), TwoLags(ZERO, ZERO), False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    ``disturbance_estimate`` of the internals is a_f - k_f.
    """
    state, xy, z = inputs.state, parameters.xy, parameters.z
    axis, acceleration, explained = body_z(state.q_wb), memory.acceleration, memory.explained
    if memory.initialised:
        now = known(vehicle, inputs.actuation.thrust, add(memory.thrust_axis, axis), state.v_w)
        acceleration = low_passed_twice(acceleration, slope(memory.velocity, state.v_w, dt), parameters.bandwidth, dt)
        explained = low_passed_twice(explained, now, parameters.bandwidth, dt)
    missing = subtract(acceleration.second, explained.second)
    found = tracking(xy.position, xy.velocity, z.position, z.velocity, parameters.speed, vehicle, inputs)
    ahead = subtract(acceleration.second, inputs.reference.a_w)
    if not memory.initialised:
        ahead = ZERO
    command = Vec3(
        found.command.x - missing.x - xy.acceleration * ahead.x,
        found.command.y - missing.y - xy.acceleration * ahead.y,
        found.command.z - missing.z - z.acceleration * ahead.z,
    )
    thrust, setpoint = pointed(parameters.limits, parameters.feed_forward, vehicle, inputs, command)
    return (
        setpoint,
        Memory(state.v_w, axis, acceleration, explained, True),
        shown(found, inputs, command, missing, thrust, False),
    )


def known(vehicle: Vehicle, thrust: float, both_axes: Vec3, velocity: Vec3) -> Vec3:
    """Return k in m/s^2; ``both_axes``: sum of the body z axes at both ends of the step, whose mean counts."""
    lift, drag = 0.5 * thrust / vehicle.mass, drag_model(vehicle, DragSign.CORRECTED)
    return add(scale(lift, both_axes), add(scale(drag, velocity), Vec3(0.0, 0.0, -vehicle.gravity)))


PRESETS = slow_presets(position=14.0, velocity=5.0, acceleration=0.2)
