"""INDI: incremental nonlinear dynamic inversion of the attitude, a ``quad.attitude_law`` plug-in.

    nu      = R^T R_d Omega_d' - Omega^ R^T R_d Omega_d - k_R e_R - k_Omega e_Omega     desired acceleration, rad/s^2
    w'_f    = H(s) w',   tau_f = H(s) tau,   H(s) = (b / (s + b))^2                     the same filter for both
    torque  = tau_f + J (nu - w'_f)                                                     N m

Source: Smeur, Chu and de Croon, Adaptive incremental nonlinear dynamic inversion for attitude control of micro air
vehicles, JGCD 39(3), 2016, without its adaptation of J. The model is left out of the feedback: what acts on the body
but rotors is in w'_f and not in tau_f, and so in the next increment. tau is what the rotors gave (`actuation`),
so limits wind nothing up and rotor lag is known. w' is the change of the body rates over the last step, the mean over
the very time that tau stands for; both must be equally old, so late rates need their prediction. e_R and e_Omega are
those of ``geometric``.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.geometric import Gains, presets, tracking
from quad_attitude_ctrl.rotation_filter import (
    NO_ROTATION,
    RotationShaping,
    RotationState,
    as_angles,
    filter_and_goal,
    next_rotation,
)
from quad_attitude_ctrl.torque import TorqueLimits, internals_of, limited_torque, torque_for
from quad_core.geometry import ZERO, TwoLags, add, low_passed_twice, slope, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeInputs, AttitudeInternals, AxisFlags, Vec3, Wrench
from quad_core.vehicle import Vehicle

Internals = AttitudeInternals


class Parameters(NamedTuple):
    """Parameters of INDI."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    bandwidth: Annotated[
        float, Real("rad/s", "poles b of acceleration's and torque's filter; larger: noisier", 0.1, 1e4, "Smeur 2016")
    ] = 100.0
    shaping: RotationShaping = RotationShaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filter, body rates of the last step in rad/s, filtered angular acceleration and torque."""

    filter: RotationState = RotationState()
    omega_b: Vec3 = Vec3()
    acceleration: TwoLags = TwoLags()
    torque: TwoLags = TwoLags()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no acceleration, no torque."""
    nothing = TwoLags(ZERO, ZERO)
    return Memory(filter=NO_ROTATION, omega_b=ZERO, acceleration=nothing, torque=nothing, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``angle_error`` is e_R, ``rate_error`` e_Omega, ``reaching_control`` the feedback and
    ``equivalent_control`` the rest of nu, in rad/s^2.
    """
    state = inputs.state
    omega_b = state.omega_b
    acceleration, given, shaping = memory.acceleration, memory.torque, parameters.shaping
    command, goal = filter_and_goal(shaping, memory.filter, memory.initialised, state.q_wb, inputs.setpoint)
    if memory.initialised:
        acceleration = low_passed_twice(acceleration, slope(memory.omega_b, omega_b, dt), parameters.bandwidth, dt)
        given = low_passed_twice(given, inputs.actuation.torque_b, parameters.bandwidth, dt)
    found = tracking(goal, state, parameters.roll, parameters.pitch, parameters.yaw)
    feedback, feed_forward = found.feedback, found.feed_forward
    missing = subtract(add(feed_forward, feedback), acceleration.second)
    torque = limited_torque(add(given.second, torque_for(vehicle, missing)), parameters.torque)
    next_filter = next_rotation(shaping, command, inputs.setpoint, dt)
    rest = AxisFlags(False, False, False)
    internals = internals_of(as_angles(goal), found.angle_error, found.rate_error, feed_forward, feedback, torque, rest)
    next_memory = Memory(next_filter, omega_b, acceleration, given, True)
    return Wrench(inputs.setpoint.thrust, torque.torque), next_memory, internals


PRESETS = presets({"angle": 220.0, "rate": 22.0})
for _vehicle in ("x500", "crazyflie21"):
    PRESETS[_vehicle]["bandwidth"] = 50.0
