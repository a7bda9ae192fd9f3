"""L1 adaptive augmentation of geometric tracking on SE(3), a ``quad.position_law`` plug-in.

    v_hat'  = F_T/m b_z - g e_3 + a_7 v + s_hat - a (v_hat - v)                     state predictor, m/s^2
    s_hat   = -a e^(-aT) / (1 - e^(-aT)) (v_hat - v)   at every step of T s         adaptation, m/s^2
    u_ad    = -w_c / (s + w_c) s_hat, |s_hat| <= max                                what is compensated, m/s^2
    U       = -k_x e_x - k_v e_v + a_d - a_7 v + u_ad                               acceleration, m/s^2
    F       = m (U + g e_3),  f = F . R e_3,  b_1, b_2, b_3 as in ``se3``           thrust and attitude

Source: Wu, Cheng, Ackerman, Gahlawat, Lakshmanan, Zhao and Hovakimyan, L1 adaptive augmentation for geometric tracking
control of quadrotors, ICRA 2022 (arXiv 2109.06998): its predictor and its piecewise-constant adaptation with
A_s = -a, for the translation. There the part along the thrust alone is compensated; here, as in the L1 baseline of
Neural-Fly (O'Connell et al., Science Robotics 7(66), 2022), the whole vector is, by thrust and attitude. F_T is what
the rotors gave (`actuation`), so limits wind nothing up.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, add, body_z, clamp, low_passed, scale, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals, Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.indi import known
from quad_position_ctrl.se3 import Gains, pointed, shown, tracking
from quad_position_ctrl.setpoint import FeedForward, LiftLimits, slow_presets
from quad_position_ctrl.speed_limit import SpeedLimits

Internals = PositionInternals


class Parameters(NamedTuple):
    """Parameters of the L1 adaptive law."""

    xy: Gains = Gains()
    z: Gains = Gains()
    predictor_pole: Annotated[float, Real("1/s", "pole a of the predictor; larger: slower adaptation", 0.01, 1e3)] = 5.0
    bandwidth: Annotated[float, Real("rad/s", "w_c of the low-pass; larger: faster, less robust", 0.0, 1e4)] = 12.0
    max_estimate: Annotated[float, Real("m/s^2", "largest estimate per axis", 0.0, 100.0)] = 5.0
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    feed_forward: FeedForward = False


class Memory(NamedTuple):
    """v_hat and v_hat - v in m/s, s_hat and -u_ad in m/s^2, body z axis of the last step."""

    predicted: Vec3 = Vec3()
    miss: Vec3 = Vec3()
    estimate: Vec3 = Vec3()
    compensated: Vec3 = Vec3()
    thrust_axis: Vec3 = Vec3()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no disturbance."""
    return Memory(ZERO, ZERO, ZERO, ZERO, ZERO, False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    ``disturbance_estimate`` of the internals is -u_ad.
    """
    v, axis, xy, z = inputs.state.v_w, body_z(inputs.state.q_wb), parameters.xy, parameters.z
    predicted, estimate, compensated = v, ZERO, ZERO
    if memory.initialised:
        explained = known(vehicle, inputs.actuation.thrust, add(memory.thrust_axis, axis), v)
        rate = subtract(add(explained, memory.estimate), scale(parameters.predictor_pole, memory.miss))
        predicted = add(memory.predicted, scale(dt, rate))
        estimate = adapted(parameters, subtract(predicted, v), dt)
        compensated = low_passed(memory.compensated, estimate, parameters.bandwidth, dt)
    found = tracking(xy.position, xy.velocity, z.position, z.velocity, parameters.speed, vehicle, inputs)
    command = subtract(found.command, compensated)
    thrust, setpoint = pointed(parameters.limits, parameters.feed_forward, vehicle, inputs, command)
    after = Memory(predicted, subtract(predicted, v), estimate, compensated, axis, True)
    return setpoint, after, shown(found, inputs, command, compensated, thrust, False)


def adapted(parameters: Parameters, miss: Vec3, dt: float) -> Vec3:
    """Return s_hat in m/s^2, each part within its bound, for ``miss`` = v_hat - v in m/s."""
    decay, bound = math.exp(-parameters.predictor_pole * dt), parameters.max_estimate
    gain = -parameters.predictor_pole * decay / (1.0 - decay)
    return Vec3(
        clamp(gain * miss.x, -bound, bound), clamp(gain * miss.y, -bound, bound), clamp(gain * miss.z, -bound, bound)
    )


PRESETS = slow_presets({"bandwidth": 8.0}, position=14.0, velocity=5.0)
