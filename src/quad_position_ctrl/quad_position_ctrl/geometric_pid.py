"""Geometric PID, position part: tracking on SE(3) with an integral, a ``quad.position_law`` plug-in.

    e_i'    = e_v + c e_x                                                           integral, m
    U       = -k_x e_x - k_v e_v - k_i sat(e_i) + a_d - a_7 v                       acceleration, m/s^2
    F       = m (U + g e_3),  f = F . R e_3,  b_1, b_2, b_3 as in ``se3``           thrust and attitude

Source: Goodarzi, Lee and Lee, Geometric nonlinear PID control of a quadrotor UAV on SE(3), ECC 2013, position mode; sat
bounds each component. Written for a world with z up; gains are divided by the mass. Added: the limits and the drag term
-a_7 v of all position laws; the integral rests while a limit is met.
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, clamp, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals, Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.se3 import pointed, shown, tracking
from quad_position_ctrl.setpoint import AntiWindup, FeedForward, LiftLimits, integrals_frozen, slow_presets
from quad_position_ctrl.speed_limit import SpeedLimits

Internals = PositionInternals


class Gains(NamedTuple):
    """Gains of one direction."""

    position: Annotated[float, Real("1/s^2", "position gain k_x / m; larger: stiffer", 0.01, 1e4)] = 12.0
    velocity: Annotated[float, Real("1/s", "velocity gain k_v / m; larger: more damped", 0.01, 1e3)] = 7.0
    integral: Annotated[float, Real("1/s^2", "integral gain k_i / m; larger: offsets go faster; 0: off", 0.0, 1e4)] = (
        10.0
    )
    mixing: Annotated[float, Real("1/s", "share c of e_x in the integral; larger: offsets go faster", 0.0, 100.0)] = 2.0
    max_integral: Annotated[float, Real("m", "bound of e_i in sat", 0.0, 1e6)] = 0.5


class Parameters(NamedTuple):
    """Parameters of the position part."""

    xy: Gains = Gains()
    z: Gains = Gains()
    anti_windup: AntiWindup = True
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    feed_forward: FeedForward = False


class Memory(NamedTuple):
    """The integral e_i in m."""

    integral: Vec3 = Vec3()


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no integral."""
    return Memory(ZERO)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    ``disturbance_estimate`` of the internals is k_i sat(e_i) / m: what the law accepts d to be.
    """
    xy, z, e_i = parameters.xy, parameters.z, memory.integral
    found = tracking(xy.position, xy.velocity, z.position, z.velocity, parameters.speed, vehicle, inputs)
    part = Vec3(
        xy.integral * clamp(e_i.x, -xy.max_integral, xy.max_integral),
        xy.integral * clamp(e_i.y, -xy.max_integral, xy.max_integral),
        z.integral * clamp(e_i.z, -z.max_integral, z.max_integral),
    )
    command = subtract(found.command, part)
    thrust, setpoint = pointed(parameters.limits, parameters.feed_forward, vehicle, inputs, command)
    frozen = integrals_frozen(parameters.anti_windup, found.correction, thrust, inputs.actuation)
    e_x, e_v = found.position_error, found.velocity_error
    after = e_i
    if not frozen:
        after = Vec3(
            e_i.x + dt * (e_v.x + xy.mixing * e_x.x),
            e_i.y + dt * (e_v.y + xy.mixing * e_x.y),
            e_i.z + dt * (e_v.z + z.mixing * e_x.z),
        )
    return setpoint, Memory(after), shown(found, inputs, command, part, thrust, frozen)


PRESETS = slow_presets(position=10.0, velocity=5.0, integral=10.0, mixing=2.5)
