"""The attitude error on SO(3) and its feedback, which ``se3`` and ``indi`` share.

    e_R          = 1/2 (R_d^T R - R^T R_d)^vee                   attitude error: rotation axis times sine of the angle
    e_Omega      = Omega - R^T R_d Omega_d                       rate error, rad/s
    feedback     = -k_R e_R - k_Omega e_Omega                    rad/s^2
    feed_forward = R^T R_d Omega_d' - Omega^ R^T R_d Omega_d     rad/s^2

Source: Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010. On quaternions: with
q = q_d^-1 q_wb, e_R = 2 q_w (q_x, q_y, q_z). Gains are per axis and divided by the inertia. Omega_d and its derivative
come from the command filter.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.rotation_filter import Goal
from quad_core.geometry import cross, relative_attitude, rotate_inverse, subtract
from quad_core.parameters import Real, Value
from quad_core.types import Vec3, VehicleState


class Gains(NamedTuple):
    """Gains of one body axis."""

    angle: Annotated[float, Real("1/s^2", "attitude gain k_R / J; larger: stiffer", 0.0, 1e5, "Lee 2010")] = 300.0
    rate: Annotated[float, Real("1/s", "rate gain k_Omega / J; larger: more damped", 0.0, 1e4, "Lee 2010")] = 30.0


class Tracking(NamedTuple):
    """e_R, e_Omega in rad/s, feedback and feed-forward in rad/s^2, body axes."""

    angle_error: Vec3
    rate_error: Vec3
    feedback: Vec3
    feed_forward: Vec3


def tracking(goal: Goal, state: VehicleState, roll: Gains, pitch: Gains, yaw: Gains) -> Tracking:
    """Return the errors of ``state`` against ``goal`` and what they and the motion of ``goal`` ask for."""
    relative = relative_attitude(goal.attitude, state.q_wb)
    # 1/2 (R_e - R_e^T)^vee of R_e = R_d^T R: the rotation axis times the sine of the angle
    twice_cosine = 2.0 * relative.w
    error = Vec3(twice_cosine * relative.x, twice_cosine * relative.y, twice_cosine * relative.z)
    turned_rates = rotate_inverse(relative, goal.rates)
    turned = rotate_inverse(relative, goal.accelerations)
    error_rate = subtract(state.omega_b, turned_rates)
    feedback = Vec3(
        -roll.angle * error.x - roll.rate * error_rate.x,
        -pitch.angle * error.y - pitch.rate * error_rate.y,
        -yaw.angle * error.z - yaw.rate * error_rate.z,
    )
    return Tracking(error, error_rate, feedback, subtract(turned, cross(state.omega_b, turned_rates)))


def presets(roll_and_pitch: dict[str, float]) -> dict[str, dict[str, Value]]:
    """Return the presets of a law whose gains of roll and pitch are ``roll_and_pitch`` for a state that is late.

    For a state 20 ms (x500) or 15 ms late and noisy, predicted, and rotors that lag: by hand on seed 1, not tuned.
    """
    slow: dict[str, Value] = {f"{axis}.{name}": v for axis in ("roll", "pitch") for name, v in roll_and_pitch.items()}
    slow |= {f"shaping.{axis}.bandwidth": 22.0 for axis in ("roll", "pitch")}
    slow |= {"yaw.angle": 30.0, "yaw.rate": 6.0}
    return {
        "tuned": {},
        "x500": {**slow, "torque.roll": 2.0, "torque.pitch": 2.0, "torque.yaw": 0.3},
        "crazyflie21": {**slow, "torque.roll": 0.006, "torque.pitch": 0.006, "torque.yaw": 0.001},
    }
