"""What the paper proves, held against law and plant together: Eqs. 19, 29, 36 and the exact rate of Eq. 57."""

import paper_equations as eq
import pytest
import test_abfnitsm_step as attitude
import test_aibs_step as position
from evaluation import evaluator
from paper_points import INDICES, VEHICLE

from quad_core.types import Vec3
from quad_dynamics import paper
from quad_dynamics.newton_euler import true_body
from quad_dynamics.parameters import PlantParameters

pytestmark = pytest.mark.unit

BODY = true_body(PlantParameters(), VEHICLE, 0.0)
# Eq. 29 with Eq. 19 in it; the derivative of the velocity stays open, it comes from the plant.
velocities = {eq.x7.diff(eq.t): eq.x8, eq.x9.diff(eq.t): eq.x10, eq.x11.diff(eq.t): eq.x12}
eq29 = evaluator(eq.EQ29.xreplace(velocities | eq.EQ21).xreplace(velocities))
eq36_known = evaluator(eq.EQ36.xreplace({eq.xi8: eq.xi8_hat, eq.xi10: eq.xi10_hat, eq.xi12: eq.xi12_hat}))
POINTS = [point for point in position.POINTS if position.eq30["corrected"](point)[2] + VEHICLE.gravity > 0.5]


def ideal_attitude(point, force_w):
    """Fly the setpoint at once: the plant's acceleration when attitude and thrust are what the law asked for."""
    setpoint, memory, internals = position.stepped(point)
    angles = dict(zip(("x1", "x3", "x5"), setpoint.angles, strict=True))
    states = {f"x{i}": 0.0 for i in (2, 4, 6)} | angles
    state = paper.State(*((point | states)[f"x{i}"] for i in range(1, 13)))
    acting = paper.Acting(setpoint.thrust, force_w, Vec3(0.0, 0.0, 0.0))
    rate = paper.State(*paper.derivative(BODY, acting, (*state, 0.0))[:12])
    moved = {f"x{second}_dot": getattr(rate, f"x{second}") for _, second in INDICES}
    assert (rate.x7, rate.x9, rate.x11) == (point["x8"], point["x10"], point["x12"])
    return point | moved, memory, internals


def test_enough_points_thrust_upward():
    assert len(POINTS) >= 20


def test_eq29_holds_to_rounding_with_exact_state_and_ideal_attitude():
    for point in POINTS:
        values, _, _ = ideal_attitude(point, Vec3(0.0, 0.0, 0.0))
        assert eq29(values) == pytest.approx((0.0, 0.0, 0.0), abs=1e-10)


def test_eq29_is_left_with_exactly_the_disturbance():
    for point in POINTS:
        disturbance = [point[f"d_{axis}"] for axis in "xyz"]
        values, _, _ = ideal_attitude(point, Vec3(*(VEHICLE.mass * d for d in disturbance)))
        assert eq29(values) == pytest.approx(disturbance, abs=1e-10)


def test_eq36_is_the_rate_of_eq35_along_the_flight():
    """L' from the plant's acceleration and the law's own adaptation, with xi = xi_hat(t) + anything."""
    gains = {f"xi{second}": 3.0 + second for _, second in INDICES}
    rate_of_eq35 = evaluator(eq.EQ35.diff(eq.t).xreplace(velocities).xreplace(eq.EQ21).xreplace(velocities))
    eq36 = evaluator(eq.EQ36)
    for point in POINTS:
        values, memory, internals = ideal_attitude(point | gains, Vec3(0.0, 0.0, 0.0))
        for axis, (_, second) in enumerate(INDICES):
            gain = point[f"xi{second}_hat"]
            values[f"xi{second}_hat_dot"] = (memory.adaptive_gain[axis] - gain) / position.DT
        assert rate_of_eq35(values)[0] == pytest.approx(eq36(values)[0], rel=1e-9, abs=1e-9)
        assert internals.lyapunov_rate == pytest.approx(eq36_known(values)[0], rel=1e-10)


@pytest.mark.parametrize("form", attitude.FORMS)
def test_rate_of_eq57_is_the_exact_identity(form):
    """V' from the plant's acceleration, the law's torque and the law's own adaptation, without dead zone."""
    rate_of_eq57 = evaluator(
        eq.rows(
            lambda axis: (
                eq.error(axis) * eq.error_rate(axis)
                + eq.surface(axis) * (axis.rate.diff(eq.t) - axis.angle_d.diff(eq.t, 2) + eq.integrand(axis))
                - sum((axis.Q[i] - axis.Q_hat[i]) * axis.Q_hat[i].diff(eq.t) / axis.Delta[i] for i in range(3))
            )
        )
    )
    disturbances = (eq.d_phi, eq.d_theta, eq.d_psi)
    identity = evaluator([eq.true_rate(axis, d, form) for axis, d in zip(eq.AXES, disturbances, strict=True)])
    inertia = (VEHICLE.inertia_xx, VEHICLE.inertia_yy, VEHICLE.inertia_zz)
    for original in attitude.POINTS:
        point = original | {"delta": 0.0}
        wrench, memory, internals = attitude.stepped(point, adaptation_form=form)
        names = [name for _, _, name in attitude.AXES]
        torque = Vec3(*(wrench.torque_b[i] + inertia[i] * point[f"d_{name}"] for i, name in enumerate(names)))
        state = paper.State(*(point.get(f"x{i}", 0.0) for i in range(1, 13)))
        acting = paper.Acting(wrench.thrust, Vec3(0.0, 0.0, 0.0), torque)
        rate = paper.State(*paper.derivative(BODY, acting, (*state, 0.0))[:12])
        values = point | {"x2_dot": rate.x2, "x4_dot": rate.x4, "x6_dot": rate.x6}
        for part, name in zip(attitude.PARTS, names, strict=True):
            for i, after in enumerate(getattr(memory, part).estimates, start=1):
                values[f"Q_{name}{i}_hat_dot"] = (after - point[f"Q_{name}{i}_hat"]) / attitude.DT
        assert rate_of_eq57(values) == pytest.approx(identity(values), rel=1e-8, abs=1e-8)
        assert internals.adaptation_frozen == (False, False, False)


@pytest.mark.parametrize("form", attitude.FORMS)
def test_dead_zone_freezes_every_estimate_and_nothing_else(form):
    for original in attitude.POINTS[:10]:
        point = original | {"delta": 50.0}
        _, memory, internals = attitude.stepped(point, adaptation_form=form)
        assert internals.adaptation_frozen == (True, True, True)
        for part, (angle, _, name) in zip(attitude.PARTS, attitude.AXES, strict=True):
            axis = getattr(memory, part)
            assert axis.estimates == tuple(point[f"Q_{name}{i}_hat"] for i in (1, 2, 3))
            assert axis.surface_integral != point[f"S{angle}"]
