"""The nominal vehicle: what Table 1 lists, and the limits it leaves out; what a stage does for it without an input."""

from enum import IntEnum
from typing import Annotated, Any, NamedTuple

from quad_core.geometry import ZERO, euler_from_quaternion, quaternion_from_euler
from quad_core.parameters import Choice, ParameterError, Real
from quad_core.types import AttitudeThrust, TrajectoryPoint, Vec3, VehicleState


class Layout(IntEnum):
    """Where the rotors stand: on the body axes, or turned by 45 degrees to the left."""

    PLUS = 0
    X = 1


Signs = tuple[int, int, int, int]
Triple = tuple[float, float, float]


class Arrangement(NamedTuple):
    """Where the four motors of a log stand and how they turn the body, in the log's own order.

    ``forward`` and ``left``: place over the arm of that axis; ``yaw``: 1 where more speed turns the body to +yaw (a
    propeller that turns clockwise seen from above), -1 where to -yaw.
    """

    forward: Signs
    left: Signs
    yaw: Signs

    @property
    def levers(self) -> tuple[tuple[int, ...], ...]:
        """Roll, pitch and yaw torque of each rotor's thrust over its arm."""
        return self.left, tuple(-place for place in self.forward), self.yaw


ARRANGEMENTS = {
    "x": Arrangement((-1, 1, 1, -1), (-1, -1, 1, 1), (1, -1, 1, -1)),
    "plus": Arrangement((-1, 0, 1, 0), (0, -1, 0, 1), (1, -1, 1, -1)),
    "crazyflie": Arrangement((1, -1, -1, 1), (-1, -1, 1, 1), (-1, 1, -1, 1)),
    "px4": Arrangement((1, -1, 1, -1), (-1, 1, 1, -1), (-1, -1, 1, 1)),
}
"""x and plus: the order of this project's plants; crazyflie: M1 front right, clockwise; px4: airframe Quadrotor X."""


class DragSign(IntEnum):
    """Sign of the drag terms of eqs. 5 and 9: drag opposes the motion, or as the paper prints it."""

    CORRECTED = 0
    PRINTED = 1


class Vehicle(NamedTuple):
    """Nominal parameters of a quadrotor; defaults are Table 1 of the paper.

    The plant may differ from it (``quad_dynamics`` holds the errors); the laws know only this.
    """

    mass: Annotated[float, Real("kg", "mass m", 0.001, 1000.0, "Table 1")] = 0.56
    gravity: Annotated[float, Real("m/s^2", "gravitational acceleration g", 0.1, 30.0, "Table 1")] = 9.8
    arm_length: Annotated[float, Real("m", "distance d from the centre to a rotor", 0.001, 10.0, "Table 1")] = 0.3
    inertia_xx: Annotated[float, Real("kg m^2", "moment of inertia about body x", 1e-7, 100.0, "Table 1")] = 3.5e-3
    inertia_yy: Annotated[float, Real("kg m^2", "moment of inertia about body y", 1e-7, 100.0, "Table 1")] = 3.5e-3
    inertia_zz: Annotated[float, Real("kg m^2", "moment of inertia about body z", 1e-7, 100.0, "Table 1")] = 7.0e-3
    lift_coefficient: Annotated[float, Real("N s^2", "rotor lift k_L (Eq. 3)", 1e-12, 1.0, "Table 1")] = 4.2e-3
    torque_coefficient: Annotated[float, Real("N m s^2", "rotor drag k_M (Eq. 8)", 1e-14, 1.0, "Table 1")] = 0.038
    drag_coefficient: Annotated[float, Real("N s/m", "translational drag k_F", 0.0, 100.0, "Table 1")] = 5.6e-4
    drag_torque_coefficient: Annotated[float, Real("N m s^2", "rotational drag k_T", 0.0, 100.0, "Table 1")] = 5.6e-4
    thrust_to_weight: Annotated[float, Real("", "largest thrust in m g, a quarter of it per rotor", 1.05, 20.0)] = 3.0
    layout: Annotated[int, Choice(Layout, "plus: 1 rear, 2 right, 3 front, 4 left", "Figure 1")] = Layout.PLUS.value
    rotor_time_constant: Annotated[float, Real("s", "lag of the rotor speed, first order; 0: none", 0.0, 1.0)] = 0.0
    rotor_speed_min: Annotated[float, Real("rad/s", "lowest rotor speed in flight", 0.0, 1e5)] = 0.0
    rotor_inertia: Annotated[float, Real("kg m^2", "moment of one rotor about its axis", 0.0, 10.0, "Eq. 1")] = 0.0
    rotor_drag_coefficient: Annotated[float, Real("N s^2/m", "force across over rotor and air speed", 0.0, 1.0)] = 0.0


def check_inertia(vehicle: Vehicle) -> None:
    """Raise ParameterError if no body has such moments of inertia: each is at most the sum of the two others.

    A hundredth is left for rounded data sheets; a flat body has the sum itself, as in Table 1.
    """
    moments = (vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz)
    largest = max(moments)
    others = sum(moments) - largest
    if largest > 1.01 * others:
        name = f"inertia_{'xyz'[moments.index(largest)] * 2}"
        raise ParameterError(
            f"vehicle.{name}: found {largest:g} kg m^2, expected at most {others:g}, the sum of the two others:"
            " no body has more"
        )


def coupling_torque(body: Any, omega: Triple) -> Triple:
    """Return -w x (J w) in N m, body frame (Eqs. 1, 6, 7), of a ``body`` with the diagonal inertia of a ``Vehicle``.

    ``omega``: its body rates in rad/s.
    """
    p, q, r = omega
    xx, yy, zz = body.inertia_xx, body.inertia_yy, body.inertia_zz
    return (yy - zz) * q * r, (zz - xx) * p * r, (xx - yy) * p * q


def max_thrust(vehicle: Vehicle) -> float:
    """Return the largest collective thrust in N."""
    return vehicle.thrust_to_weight * vehicle.mass * vehicle.gravity


def safe_input(topic: str, last: Any, vehicle: Vehicle, state: VehicleState) -> Any:
    """Return what a stage acts on when ``last``, its newest input of ``topic``, is too old; None: it cannot answer."""
    if topic == "reference":
        return hold_position(last)
    if topic == "attitude_setpoint":
        return level_hover(vehicle, state)
    return None


def level_hover(vehicle: Vehicle, state: VehicleState) -> AttitudeThrust:
    """Return level attitude at the present heading with the nominal hover thrust."""
    angles = Vec3(0.0, 0.0, euler_from_quaternion(state.q_wb).z)
    thrust = vehicle.mass * vehicle.gravity
    return AttitudeThrust(angles, ZERO, ZERO, quaternion_from_euler(angles), thrust, thrust / max_thrust(vehicle))


def hold_position(last: TrajectoryPoint) -> TrajectoryPoint:
    """Return the last reference at rest: its position and heading with all derivatives zero."""
    return TrajectoryPoint(last.trajectory_time, last.p_w, yaw=last.yaw)
