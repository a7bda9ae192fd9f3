"""Every function of the position law against its row of the transcribed Eqs. 17-38, axis by axis."""

import math

import position_equations as pos
import pytest
from paper_points import INDICES, VEHICLE, position_points
from paper_symbols import evaluator

from quad_core.types import Vec3
from quad_position_ctrl import backstepping as law
from quad_position_ctrl import setpoint

pytestmark = pytest.mark.unit

POINTS = position_points(count=60, seed=1838)
SAME = {"rel": 1e-12, "abs": 1e-12}
PRINTED, CORRECTED = 1, 0

eq18, eq23, eq25 = evaluator(pos.EQ18), evaluator(pos.EQ23), evaluator(pos.EQ25)
eq30, eq30_printed_drag = evaluator(pos.EQ30), evaluator(pos.EQ30_PRINTED_DRAG)
eq30_known = evaluator(pos.EQ30_KNOWN_DISTURBANCE)
eq37 = evaluator(list(pos.EQ37.values()))
eq38 = evaluator(pos.EQ38)
eq35 = evaluator([(e**2 + k * gamma**2 + e2**2) / 2 for e, k, gamma, e2 in (
    (pos.e7, pos.k7, pos.Gamma7, pos.e8),
    (pos.e9, pos.k9, pos.Gamma9, pos.e10),
    (pos.e11, pos.k11, pos.Gamma11, pos.e12),
)])  # fmt: skip
eq36 = evaluator([-pos.xi7 * pos.e7**2 - pos.xi8_hat * pos.e8**2,
                  -pos.xi9 * pos.e9**2 - pos.xi10_hat * pos.e10**2,
                  -pos.xi11 * pos.e11**2 - pos.xi12_hat * pos.e12**2])  # fmt: skip


@pytest.fixture(params=[0, 1, 2], ids=["x", "y", "z"])
def axis(request):
    return request.param


def command(point, axis, drag_sign, disturbance):
    first, second = INDICES[axis]
    return law.acceleration_command(
        position_gain=point[f"xi{first}"],
        integral_gain=point[f"k{first}"],
        adaptive_gain=point[f"xi{second}_hat"],
        drag=law.drag_model(VEHICLE.drag_coefficient, VEHICLE.mass, drag_sign),
        position_error=eq18(point)[axis],
        velocity_error=eq25(point)[axis],
        integral=point[f"Gamma{first}"],
        velocity=point[f"x{second}"],
        reference_acceleration=point[f"x{first}d_ddot"],
        disturbance=disturbance,
    )


def test_eq18_and_25_errors(axis):
    first, second = INDICES[axis]
    for point in POINTS:
        assert law.tracking_error(point[f"x{first}"], point[f"x{first}d"]) == pytest.approx(eq18(point)[axis], **SAME)
        virtual = eq23(point)[axis]
        assert law.tracking_error(point[f"x{second}"], virtual) == pytest.approx(eq25(point)[axis], **SAME)


def test_eq23_virtual_velocity(axis):
    first, _ = INDICES[axis]
    for point in POINTS:
        correction = law.correction_velocity(
            position_gain=point[f"xi{first}"],
            integral_gain=point[f"k{first}"],
            position_error=eq18(point)[axis],
            integral=point[f"Gamma{first}"],
        )
        value = law.virtual_velocity(correction, reference_velocity=point[f"x{first}d_dot"])
        assert value == pytest.approx(eq23(point)[axis], **SAME)


def test_eq30_acceleration_command(axis):
    for point in POINTS:
        assert command(point, axis, CORRECTED, 0.0) == pytest.approx(eq30(point)[axis], **SAME)


def test_eq30_with_the_printed_drag_sign(axis):
    for point in POINTS:
        assert command(point, axis, PRINTED, 0.0) == pytest.approx(eq30_printed_drag(point)[axis], **SAME)


def test_eq30_with_a_known_disturbance(axis):
    for point in POINTS:
        value = command(point, axis, CORRECTED, point[f"d_{'xyz'[axis]}"])
        assert value == pytest.approx(eq30_known(point)[axis], **SAME)


def test_eq30_is_what_the_bounded_form_gives_without_a_bound(axis):
    first, second = INDICES[axis]
    for point in POINTS:
        e7, e8 = eq18(point)[axis], eq25(point)[axis]
        # x_8d' of Eq. 23 by the chain rule: -xi_7 e_7' + x_7d'' - k_7 e_7.
        error_rate = point[f"x{second}"] - point[f"x{first}d_dot"]
        virtual_rate = -point[f"xi{first}"] * error_rate + point[f"x{first}d_ddot"] - point[f"k{first}"] * e7
        value = law.bounded_acceleration_command(
            adaptive_gain=point[f"xi{second}_hat"],
            drag=law.drag_model(VEHICLE.drag_coefficient, VEHICLE.mass, CORRECTED),
            bounded_error=e7,
            velocity_error=e8,
            velocity=point[f"x{second}"],
            virtual_acceleration=virtual_rate,
            disturbance=point[f"d_{'xyz'[axis]}"],
        )
        assert value == pytest.approx(eq30_known(point)[axis], **SAME)


def test_eq37_adaptive_rate(axis):
    _, second = INDICES[axis]
    for point in POINTS:
        value = law.adaptive_rate(point[f"alpha{second}"], eq25(point)[axis])
        assert value == pytest.approx(eq37(point)[axis], **SAME)


def test_eq35_and_36_lyapunov(axis):
    first, second = INDICES[axis]
    for point in POINTS:
        e7, e8 = eq18(point)[axis], eq25(point)[axis]
        value = law.lyapunov(
            integral_gain=point[f"k{first}"], position_error=e7, velocity_error=e8, integral=point[f"Gamma{first}"]
        )
        assert value == pytest.approx(eq35(point)[axis], **SAME)
        rate = law.lyapunov_rate(
            position_gain=point[f"xi{first}"],
            adaptive_gain=point[f"xi{second}_hat"],
            position_error=e7,
            velocity_error=e8,
        )
        assert rate == pytest.approx(eq36(point)[axis], **SAME)


def test_eq21_integral_is_forward_euler():
    assert law.next_integral(0.5, -1.5, 100.0, 0.01) == pytest.approx(0.485, rel=1e-14)
    assert law.next_integral(0.5, 1.5, 0.51, 0.01) == 0.51
    assert law.next_integral(-0.5, -1.5, 0.51, 0.01) == -0.51


def test_eq37_gain_is_forward_euler_with_leak_and_bound():
    assert law.next_adaptive_gain(2.0, 3.0, 0.0, 1.0, 10.0, 0.01) == pytest.approx(2.03, rel=1e-14)
    assert law.next_adaptive_gain(2.0, 3.0, 0.5, 1.2, 10.0, 0.01) == pytest.approx(2.026, rel=1e-14)
    assert law.next_adaptive_gain(2.0, 3.0, 0.0, 1.0, 2.01, 0.01) == 2.01
    assert law.next_adaptive_gain(0.1, 0.0, 3.0, 0.0, 2.0, 0.5) == 0.0


def test_eq38_thrust_and_angles():
    for point in POINTS:
        lift = Vec3(point["U_x"], point["U_y"], point["U_z"] + VEHICLE.gravity)
        thrust, phi, theta = eq38(point)
        assert setpoint.thrust_norm(VEHICLE.mass, lift) == pytest.approx(thrust, **SAME)
        angles = setpoint.desired_angles(lift, heading=point["psi_d"], yaw=0.7)
        assert angles == pytest.approx((phi, theta, 0.7), **SAME)


def test_eq38_projected_thrust_equals_the_norm_on_the_desired_axis():
    for point in POINTS:
        lift = Vec3(point["U_x"], point["U_y"], point["U_z"] + VEHICLE.gravity)
        length = math.dist(lift, (0.0, 0.0, 0.0))
        along = Vec3(lift.x / length, lift.y / length, lift.z / length)
        assert setpoint.thrust_projected(VEHICLE.mass, lift, along) == pytest.approx(eq38(point)[0], **SAME)
        other = Vec3(0.48, -0.6, 0.64)
        expected = VEHICLE.mass * (0.48 * lift.x - 0.6 * lift.y + 0.64 * lift.z)
        assert setpoint.thrust_projected(VEHICLE.mass, lift, other) == pytest.approx(expected, **SAME)
