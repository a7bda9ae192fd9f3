"""The whole step of the position law against the transcription: outputs, internals, integral and adaptation."""

import paper_equations as eq
import pytest
from evaluation import evaluator
from paper_points import INDICES, VEHICLE, position_points

from quad_core.geometry import body_z, quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, PositionInputs, TrajectoryPoint, Vec3, VehicleState
from quad_position_ctrl import aibs, backstepping

pytestmark = pytest.mark.unit

DT = 0.01
TILTED = Vec3(0.3, -0.4, 1.1)
IDLE = Actuation()
SAME = {"rel": 1e-11, "abs": 1e-11}
POINTS = position_points(count=60, seed=38)
# Everything that the paper does not have, out of the way.
BARE = {
    "thrust_form": "norm",
    "tilt_heading": "reference",
    "anti_windup": False,
    "speed.max_xy": 1e6,
    "speed.max_z": 1e6,
    "speed.braking_xy": 1e6,
    "speed.braking_z": 1e6,
    "limits.acceleration_xy": 1e6,
    "limits.acceleration_z": 1e6,
    "limits.min_lift": -1e6,
    "limits.tilt": 1.58,
    "limits.thrust": 1e6,
    "limits.min_thrust": 0.0,
    "observer.bandwidth": 0.0,
} | {f"{a}.{k}": v for a in "xyz" for k, v in (("max_integral", 1e9), ("max_gain", 1e9), ("adaptation_leak", 0.0))}

eq18, eq23, eq25 = evaluator(eq.EQ18), evaluator(eq.EQ23), evaluator(eq.EQ25)
eq30 = {"corrected": evaluator(eq.EQ30), "printed": evaluator(eq.EQ30_PRINTED_DRAG)}
eq30_known = evaluator(eq.EQ30_KNOWN_DISTURBANCE)
eq37, eq38 = evaluator(list(eq.EQ37.values())), evaluator(eq.EQ38)
thrust_axis = evaluator(eq.EQ4[2::3])


def parameters_of(point, **other):
    values = dict(BARE) | other
    for axis, (first, second) in zip("xyz", INDICES, strict=True):
        values[f"{axis}.position_gain"] = point[f"xi{first}"]
        values[f"{axis}.integral_gain"] = point[f"k{first}"]
        values[f"{axis}.adaptation_rate"] = point[f"alpha{second}"]
    return build(aibs.Parameters, values)


def inputs_of(point, angles=TILTED, actuation=IDLE):
    state = VehicleState(
        p_w=Vec3(*(point[f"x{first}"] for first, _ in INDICES)),
        v_w=Vec3(*(point[f"x{second}"] for _, second in INDICES)),
        q_wb=quaternion_from_euler(angles),
        omega_b=Vec3(0.1, 0.2, 0.3),
    )
    reference = TrajectoryPoint(
        p_w=Vec3(*(point[f"x{first}d"] for first, _ in INDICES)),
        v_w=Vec3(*(point[f"x{first}d_dot"] for first, _ in INDICES)),
        a_w=Vec3(*(point[f"x{first}d_ddot"] for first, _ in INDICES)),
        yaw=point["psi_d"],
        yaw_rate=0.21,
        yaw_acceleration=-0.34,
    )
    return PositionInputs(state, reference, actuation)


def memory_of(point, parameters):
    return aibs.init(parameters, VEHICLE)._replace(
        error_integral=Vec3(*(point[f"Gamma{first}"] for first, _ in INDICES)),
        adaptive_gain=Vec3(*(point[f"xi{second}_hat"] for _, second in INDICES)),
        initialised=True,
    )


def stepped(point, angles=TILTED, **other):
    parameters = parameters_of(point, **other)
    return aibs.step(parameters, VEHICLE, memory_of(point, parameters), inputs_of(point, angles), DT)


def with_command(point, law):
    return point | dict(zip(("U_x", "U_y", "U_z"), law(point), strict=True))


@pytest.mark.parametrize("sign", ["corrected", "printed"])
def test_setpoint_is_eq38_of_eq30(sign):
    for point in POINTS:
        setpoint, _, internals = stepped(point, drag_sign=sign)
        assert internals.acceleration_command == pytest.approx(eq30[sign](point), **SAME)
        thrust, phi, theta = eq38(with_command(point, eq30[sign]))
        assert setpoint.thrust == pytest.approx(thrust, **SAME)
        assert setpoint.angles == pytest.approx((phi, theta, point["psi_d"]), **SAME)
        assert (setpoint.rates, setpoint.accelerations) == (Vec3(0.0, 0.0, 0.21), Vec3(0.0, 0.0, -0.34))


def test_setpoint_quaternion_points_the_thrust_along_the_command():
    for point in POINTS:
        setpoint, _, _ = stepped(point)
        at = {"x1": setpoint.angles.x, "x3": setpoint.angles.y, "x5": setpoint.angles.z}
        assert body_z(setpoint.q_wb) == pytest.approx(thrust_axis(at), **SAME)
        x, y, z = eq30["corrected"](point)
        lift = (x, y, z + VEHICLE.gravity)
        if lift[2] > 0.0:
            along = [setpoint.thrust / VEHICLE.mass * component for component in body_z(setpoint.q_wb)]
            assert along == pytest.approx(lift, rel=1e-10, abs=1e-10)


def test_internals_are_eqs_18_23_25_35_36():
    for point in POINTS:
        _, _, internals = stepped(point)
        assert internals.position_error == pytest.approx(eq18(point), **SAME)
        assert internals.virtual_velocity == pytest.approx(eq23(point), **SAME)
        assert internals.velocity_error == pytest.approx(eq25(point), **SAME)
        e, e2 = eq18(point), eq25(point)
        value = rate = 0.0
        for axis, (first, second) in enumerate(INDICES):
            value += 0.5 * (e[axis] ** 2 + point[f"k{first}"] * point[f"Gamma{first}"] ** 2 + e2[axis] ** 2)
            rate -= point[f"xi{first}"] * e[axis] ** 2 + point[f"xi{second}_hat"] * e2[axis] ** 2
        assert internals.lyapunov == pytest.approx(value, **SAME)
        assert internals.lyapunov_rate == pytest.approx(rate, **SAME)
        assert internals.error_integral == tuple(point[f"Gamma{first}"] for first, _ in INDICES)
        assert internals.adaptive_gain == tuple(point[f"xi{second}_hat"] for _, second in INDICES)


def test_memory_moves_by_forward_euler_of_eqs_21_and_37():
    for point in POINTS:
        _, memory, _ = stepped(point)
        gamma = [point[f"Gamma{first}"] + DT * e for (first, _), e in zip(INDICES, eq18(point), strict=True)]
        gains = [point[f"xi{second}_hat"] + DT * rate for (_, second), rate in zip(INDICES, eq37(point), strict=True)]
        assert memory.error_integral == pytest.approx(gamma, **SAME)
        assert memory.adaptive_gain == pytest.approx(gains, **SAME)


def test_initial_memory_holds_the_initial_gains():
    parameters = build(aibs.Parameters, {"x.initial_gain": 1.5, "y.initial_gain": 2.5, "z.initial_gain": 3.5})
    memory = aibs.init(parameters, VEHICLE)
    assert (memory.error_integral, memory.adaptive_gain) == (Vec3(0.0, 0.0, 0.0), Vec3(1.5, 2.5, 3.5))


def test_leak_and_bounds_act_on_their_own_axis():
    point = POINTS[0]
    leaks = {"x.adaptation_leak": 0.5, "y.adaptation_leak": 1.5, "z.adaptation_leak": 2.5}
    starts = {"x.initial_gain": 1.0, "y.initial_gain": 2.0, "z.initial_gain": 3.0}
    _, memory, _ = stepped(point, **leaks, **starts)
    for axis, (_, second) in enumerate(INDICES):
        gain, name = point[f"xi{second}_hat"], "xyz"[axis]
        leak = leaks[f"{name}.adaptation_leak"] * (gain - starts[f"{name}.initial_gain"])
        assert memory.adaptive_gain[axis] == pytest.approx(gain + DT * (eq37(point)[axis] - leak), **SAME)
    bounds = {"x.max_gain": 0.11, "y.max_gain": 0.12, "z.max_gain": 0.13}
    tight = {"x.max_integral": 0.01, "y.max_integral": 0.02, "z.max_integral": 0.03}
    _, memory, _ = stepped(point, **bounds, **tight)
    assert memory.adaptive_gain == (0.11, 0.12, 0.13)
    assert tuple(abs(value) for value in memory.error_integral) == (0.01, 0.02, 0.03)
    assert backstepping.next_adaptive_gain(0.1, 0.0, 3.0, 0.0, 2.0, 0.5) == 0.0
    assert [backstepping.next_integral(0.5 * sign, 1.5 * sign, 0.51, 0.01) for sign in (-1, 1)] == [-0.51, 0.51]


def test_measured_heading_takes_the_vehicle_yaw_for_psi_d():
    for point in POINTS:
        setpoint, _, _ = stepped(point, Vec3(0.2, -0.3, 2.2), tilt_heading="measured")
        _, phi, theta = eq38(with_command(point, eq30["corrected"]) | {"psi_d": 2.2})
        assert setpoint.angles == pytest.approx((phi, theta, point["psi_d"]), **SAME)


def test_projected_thrust_is_along_the_actual_axis():
    angles = Vec3(0.2, -0.3, 2.2)
    axis = thrust_axis({"x1": 0.2, "x3": -0.3, "x5": 2.2})
    for point in POINTS:
        setpoint, _, _ = stepped(point, angles, thrust_form="projected")
        x, y, z = eq30["corrected"](point)
        unlimited = VEHICLE.mass * (axis[0] * x + axis[1] * y + axis[2] * (z + VEHICLE.gravity))
        assert setpoint.thrust == pytest.approx(max(unlimited, 0.0), **SAME)


def test_disturbance_estimate_stands_in_for_d_of_eq30():
    """One observer step from a known past, by hand: gain 1 - exp(-L dt) on what thrust, drag and weight leave over."""
    point = POINTS[1]
    parameters = parameters_of(point, **{"observer.bandwidth": 7.0, "observer.max_estimate": 1e2})
    angles = Vec3(0.2, -0.3, 2.2)
    now = thrust_axis({"x1": 0.2, "x3": -0.3, "x5": 2.2})
    before, then = (0.1, -0.2, 0.97), (0.31, -0.17, 0.53)
    memory = memory_of(point, parameters)._replace(
        velocity=Vec3(*then), thrust_axis=Vec3(*before), disturbance_estimate=Vec3(0.4, -0.6, 0.8)
    )
    inputs = inputs_of(point, angles, Actuation(thrust=7.7))
    _, next_memory, internals = aibs.step(parameters, VEHICLE, memory, inputs, DT)
    share = 1.0 - 2.718281828459045 ** (-7.0 * DT)
    estimate = []
    for axis, (_, second) in enumerate(INDICES):
        weight = VEHICLE.gravity if axis == 2 else 0.0
        drag = -VEHICLE.drag_coefficient / VEHICLE.mass * point[f"x{second}"]
        known = 7.7 / VEHICLE.mass * 0.5 * (now[axis] + before[axis]) - weight + drag
        seen = (point[f"x{second}"] - then[axis]) / DT - known
        old = (0.4, -0.6, 0.8)[axis]
        estimate.append(max(-100.0, min(100.0, old + share * (seen - old))))
    assert internals.disturbance_estimate == pytest.approx(estimate, rel=1e-9)
    filled = point | dict(zip(("d_x", "d_y", "d_z"), estimate, strict=True))
    assert internals.acceleration_command == pytest.approx(eq30_known(filled), rel=1e-9)
    assert next_memory.disturbance_estimate == internals.disturbance_estimate
    assert next_memory.velocity == inputs.state.v_w
    assert next_memory.thrust_axis == pytest.approx(now, **SAME)


def test_eq30_is_what_the_bounded_form_gives_without_a_bound():
    for point in POINTS:
        for axis, (first, second) in enumerate(INDICES):
            # x_8d' of Eq. 23 by the chain rule: -xi_7 e_7' + x_7d'' - k_7 e_7.
            error, error_rate = eq18(point)[axis], point[f"x{second}"] - point[f"x{first}d_dot"]
            virtual_rate = -point[f"xi{first}"] * error_rate + point[f"x{first}d_ddot"] - point[f"k{first}"] * error
            value = backstepping.bounded_acceleration_command(
                adaptive_gain=point[f"xi{second}_hat"],
                drag=-VEHICLE.drag_coefficient / VEHICLE.mass,
                bounded_error=error,
                velocity_error=eq25(point)[axis],
                velocity=point[f"x{second}"],
                virtual_acceleration=virtual_rate,
                disturbance=point[f"d_{'xyz'[axis]}"],
            )
            assert value == pytest.approx(eq30_known(point)[axis], **SAME)
