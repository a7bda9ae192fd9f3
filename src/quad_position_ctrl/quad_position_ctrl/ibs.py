"""IBS: integral backstepping with a fixed gain, a ``quad.position_law`` plug-in; the paper's baseline (sect. 4).

    U_x = x_7d'' + (xi_7^2 - 1 - k_7) e_7 - (xi_7 + xi_8) e_8 - a_7 x_8 + xi_7 k_7 Gamma_7       (30, per axis)

Eqs. 18-30 with a constant xi_8 in the place of the adaptive xi_hat_8 (Eq. 37 left out) and no disturbance estimate: the
text of ``aibs`` with both switched off, its limits unchanged. Source of the form: Bouabdallah and Siegwart, Full
control of a quadrotor, IROS 2007.
"""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs
from quad_core.vehicle import DragSign, Vehicle
from quad_position_ctrl.aibs import Internals, Memory
from quad_position_ctrl.aibs import Parameters as AdaptiveParameters
from quad_position_ctrl.aibs import init as adaptive_init
from quad_position_ctrl.aibs import step as adaptive_step
from quad_position_ctrl.backstepping import AxisGains as AdaptiveGains
from quad_position_ctrl.backstepping import IntegralBound, IntegralGain, PositionGain
from quad_position_ctrl.disturbance_observer import Observer
from quad_position_ctrl.setpoint import AntiWindup, FeedForward, LiftLimits, ThrustForm, TiltHeading
from quad_position_ctrl.speed_limit import SpeedLimits

__all__ = ["Gains", "Internals", "Memory", "Parameters", "init", "step"]


class Gains(NamedTuple):
    """Gains of one axis; named after the x axis."""

    position_gain: PositionGain = 4.25
    velocity_gain: Annotated[
        float,
        Real("1/s", "velocity error to acceleration, xi_8 (y: 10, z: 12), fixed; larger: stiffer", 0.0, 1e3, "Eq. 30"),
    ] = 7.0
    integral_gain: IntegralGain = 0.01
    max_integral: IntegralBound = 20.0


class Parameters(NamedTuple):
    """Parameters of IBS."""

    x: Gains = Gains()
    y: Gains = Gains()
    z: Gains = Gains()
    anti_windup: AntiWindup = True
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    feed_forward: FeedForward = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:
    """Return the memory before the first step: Gamma = 0."""
    return adaptive_init(_adaptive(parameters), vehicle)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    ``adaptive_gain`` of the internals holds the fixed xi_8, xi_10, xi_12.
    """
    return adaptive_step(_adaptive(parameters), vehicle, memory, inputs, dt)


def _adaptive(parameters: Parameters) -> AdaptiveParameters:
    """Return the parameters of AIBS that make it IBS."""
    return AdaptiveParameters(
        x=_adaptive_gains(parameters.x),
        y=_adaptive_gains(parameters.y),
        z=_adaptive_gains(parameters.z),
        drag_sign=DragSign.CORRECTED,
        thrust_form=ThrustForm.PROJECTED,
        tilt_heading=TiltHeading.MEASURED,
        anti_windup=parameters.anti_windup,
        speed=parameters.speed,
        limits=parameters.limits,
        observer=Observer(bandwidth=0.0, max_estimate=0.0),
        feed_forward=parameters.feed_forward,
    )


def _adaptive_gains(gains: Gains) -> AdaptiveGains:
    return AdaptiveGains(
        position_gain=gains.position_gain,
        integral_gain=gains.integral_gain,
        max_integral=gains.max_integral,
        adaptation_rate=0.0,
        initial_gain=gains.velocity_gain,
        max_gain=gains.velocity_gain,
        adaptation_leak=0.0,
        adaptation_dead_zone=0.0,
    )
