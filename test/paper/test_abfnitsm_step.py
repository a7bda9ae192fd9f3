"""The whole step of the attitude law against the transcription: torque, internals, integrals and adaptation."""

import math

import paper_equations as eq
import pytest
import sympy as sp
from attitude_points import AXES, attitude_points
from evaluation import evaluator
from paper_points import VEHICLE

from quad_attitude_ctrl import abfnitsm
from quad_attitude_ctrl.sliding_control import Estimates
from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Vec3, VehicleState

pytestmark = pytest.mark.unit

DT = 0.002
IDLE = Actuation()
SAME = {"rel": 1e-10, "abs": 1e-10}
POINTS = attitude_points(count=40, seed=56)
FORMS = ("abs", "sat")
PARTS = ("roll", "pitch", "yaw")
OFF = {"surface_width": 1.0, "reaching_width": 1.0, "max_surface_integral": 1e9, "max_estimate": 1e9, "max_torque": 1e6}
BARE = {"command": "feed_forward", "mapping": "printed", "anti_windup": False} | {
    f"{part}.{key}": value for part in PARTS for key, value in OFF.items()
}

body_rates = evaluator(eq.EQ13_MATRIX.inv() * sp.Matrix([eq.x2, eq.x4, eq.x6]))
eq40, eq41, eq45, eq46 = (evaluator(rows) for rows in (eq.EQ40, eq.EQ41, eq.EQ45, eq.EQ46))
eq48, eq52, eq53 = evaluator(eq.EQ48), evaluator(eq.EQ52), evaluator(eq.EQ53)
eq56 = {"corrected": evaluator(eq.EQ56), "printed": evaluator(eq.EQ56_PRINTED_DRAG)}
integrand, known_rate = evaluator(eq.rows(eq.integrand)), evaluator(eq.rows(eq.known_rate))
eq55 = {form: evaluator([rate for axis in eq.AXES for rate in eq.eq55(axis, form)]) for form in FORMS}
b = evaluator([eq.b1, eq.b2, eq.b3])
ARMS = (VEHICLE.arm_length, VEHICLE.arm_length, 1.0)


def parameters_of(point, **other):
    values = dict(BARE) | other
    for part, (_, _, name) in zip(PARTS, AXES, strict=True):
        values |= {
            f"{part}.angle_gain": point[f"delta_{name}1"],
            f"{part}.rate_gain": point[f"delta_{name}2"],
            f"{part}.linear_gain": point[f"rho_{name}1"],
            f"{part}.power_gain": point[f"rho_{name}2"],
            f"{part}.power": point[f"sigma_{name}"],
            f"{part}.adaptation_constant": point[f"Delta_{name}1"],
            f"{part}.adaptation_angle": point[f"Delta_{name}2"],
            f"{part}.adaptation_rate": point[f"Delta_{name}3"],
            f"{part}.dead_zone": point["delta"],
        }
    return build(abfnitsm.Parameters, values)


def memory_of(point, parameters):
    memory = abfnitsm.init(parameters, VEHICLE)._replace(initialised=True)
    axes = {}
    for part, (angle, _, name) in zip(PARTS, AXES, strict=True):
        estimates = Estimates(*(point[f"Q_{name}{index}_hat"] for index in (1, 2, 3)))
        axes[part] = getattr(memory, part)._replace(surface_integral=point[f"S{angle}"], estimates=estimates)
    return memory._replace(**axes)


def inputs_of(point, turns=0.0, actuation=IDLE):
    state = VehicleState(
        q_wb=quaternion_from_euler(Vec3(point["x1"], point["x3"], point["x5"])), omega_b=Vec3(*body_rates(point))
    )
    setpoint = AttitudeThrust(
        angles=Vec3(point["x1d"], point["x3d"], point["x5d"] + 2.0 * math.pi * turns),
        rates=Vec3(point["x1d_dot"], point["x3d_dot"], point["x5d_dot"]),
        accelerations=Vec3(point["x1d_ddot"], point["x3d_ddot"], point["x5d_ddot"]),
        thrust=6.5,
    )
    return AttitudeInputs(state, setpoint, actuation)


def stepped(point, turns=0.0, actuation=IDLE, **other):
    parameters = parameters_of(point, **other)
    return abfnitsm.step(parameters, VEHICLE, memory_of(point, parameters), inputs_of(point, turns, actuation), DT)


@pytest.mark.parametrize("sign", ["corrected", "printed"])
def test_wrench_is_eq56_with_the_arm(sign):
    for point in POINTS:
        wrench, _, _ = stepped(point, drag_sign=sign)
        expected = [arm * value for arm, value in zip(ARMS, eq56[sign](point), strict=True)]
        assert wrench.torque_b == pytest.approx(expected, **SAME)
        assert wrench.thrust == 6.5


@pytest.mark.parametrize("turns", [-1.0, 1.0])
def test_yaw_error_is_wrapped(turns):
    for point in POINTS:
        straight, _, _ = stepped(point)
        turned, _, internals = stepped(point, turns)
        assert turned.torque_b == pytest.approx(straight.torque_b, rel=1e-9, abs=1e-9)
        assert internals.angle_error == pytest.approx(eq40(point), rel=1e-9, abs=1e-9)


def test_internals_are_the_terms_of_the_paper():
    for point in POINTS:
        _, _, internals = stepped(point)
        assert internals.angle_error == pytest.approx(eq40(point), **SAME)
        assert internals.rate_error == pytest.approx(eq41(point), **SAME)
        assert internals.sliding_variable == pytest.approx(eq45(point), **SAME)
        assert internals.surface_exponent == pytest.approx(eq46(point)[::2], **SAME)
        assert internals.surface_integral == tuple(point[f"S{angle}"] for angle, _, _ in AXES)
        equivalent = [scale * value for scale, value in zip(b(point), eq52(point), strict=True)]
        reaching = [scale * value for scale, value in zip(b(point), eq53(point), strict=True)]
        assert internals.equivalent_control == pytest.approx(equivalent, **SAME)
        assert internals.reaching_control == pytest.approx(reaching, **SAME)
        assert internals.lyapunov == pytest.approx(eq48(point), **SAME)
        assert internals.lyapunov_rate == pytest.approx(known_rate(point), **SAME)
        names = [name for _, _, name in AXES]
        assert internals.adaptive_constant == tuple(point[f"Q_{name}1_hat"] for name in names)
        assert internals.adaptive_angle == tuple(point[f"Q_{name}2_hat"] for name in names)
        assert internals.adaptive_rate == tuple(point[f"Q_{name}3_hat"] for name in names)
        assert internals.desired_angles == tuple(point[f"x{angle}d"] for angle, _, _ in AXES)
        assert internals.desired_rates == tuple(point[f"x{angle}d_dot"] for angle, _, _ in AXES)
        assert internals.desired_accelerations == tuple(point[f"x{angle}d_ddot"] for angle, _, _ in AXES)


@pytest.mark.parametrize("form", FORMS)
def test_memory_moves_by_forward_euler_of_eqs_45_54_55(form):
    for point in POINTS:
        _, memory, internals = stepped(point, adaptation_form=form)
        rates = eq55[form](point)
        for i, (part, (angle, _, name)) in enumerate(zip(PARTS, AXES, strict=True)):
            axis = getattr(memory, part)
            assert axis.surface_integral == pytest.approx(point[f"S{angle}"] + DT * integrand(point)[i], **SAME)
            moved = [point[f"Q_{name}{j + 1}_hat"] + DT * rates[3 * i + j] for j in range(3)]
            assert axis.estimates == pytest.approx(moved, **SAME)
            assert internals.adaptation_frozen[i] == (abs(eq45(point)[i]) <= point["delta"])


def test_raw_command_takes_the_angle_alone():
    for point in POINTS:
        still = point | {f"x{angle}d_{dots}": 0.0 for angle, _, _ in AXES for dots in ("dot", "ddot")}
        wrench, _, _ = stepped(point, command="raw")
        expected = [arm * value for arm, value in zip(ARMS, eq56["corrected"](still), strict=True)]
        assert wrench.torque_b == pytest.approx(expected, **SAME)


@pytest.mark.parametrize("sign", ["corrected", "printed"])
def test_exact_mapping_gives_the_wanted_euler_accelerations_through_eqs_1_and_13(sign):
    """Torque -> Eq. 1 -> derivative of Eq. 13 gives b U of Eq. 56 without the small-angle model terms."""
    drag = eq.EQ9 if sign == "corrected" else eq.EQ9_PRINTED
    angular = eq.eq1(eq.tau, eq.EQ5, drag)[1]
    motion = dict(zip((eq.p.diff(eq.t), eq.q.diff(eq.t), eq.r.diff(eq.t)), angular, strict=True))
    spin = dict(zip((eq.x1.diff(eq.t), eq.x3.diff(eq.t), eq.x5.diff(eq.t)), eq.EQ13, strict=True))
    euler = evaluator(eq.EQ13.diff(eq.t).xreplace(motion).xreplace(spin))
    terms = sp.Matrix([eq.a1 * eq.x4 * eq.x6, eq.a3 * eq.x2 * eq.x6, eq.a5 * eq.x2 * eq.x4])
    model_terms = evaluator(terms + sp.Matrix(eq.DAMPING[:3]))
    for point in POINTS:
        wrench, _, _ = stepped(point, mapping="exact", drag_sign=sign)
        values = point | dict(zip("pqr", body_rates(point), strict=True))
        values |= dict(zip(("tau_x", "tau_y", "tau_z"), wrench.torque_b, strict=True))
        expected_accelerations = [
            scale * u + term
            for scale, u, term in zip(b(point), eq56["corrected"](point), model_terms(point), strict=True)
        ]
        assert euler(values) == pytest.approx(expected_accelerations, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("limited", range(3))
def test_torque_limit_holds_and_freezes_its_own_axis(limited):
    point = POINTS[0]
    free, _, _ = stepped(point)
    limits = {
        f"{part}.max_torque": 1e6 if i != limited else 0.25 * abs(free.torque_b[i]) for i, part in enumerate(PARTS)
    }
    wrench, memory, internals = stepped(point, anti_windup=True, **limits)
    for i, (part, (angle, _, _)) in enumerate(zip(PARTS, AXES, strict=True)):
        met = i == limited
        assert internals.torque_limited[i] == met
        expected = math.copysign(limits[f"{part}.max_torque"], free.torque_b[i]) if met else free.torque_b[i]
        assert wrench.torque_b[i] == expected
        assert (getattr(memory, part).surface_integral == point[f"S{angle}"]) == met


@pytest.mark.parametrize(("flag", "limited"), [("roll_limited", 0), ("pitch_limited", 1), ("yaw_limited", 2)])
def test_actuation_flag_freezes_its_own_axis(flag, limited):
    point = POINTS[0]
    _, memory, internals = stepped(point, actuation=Actuation(**{flag: True}), anti_windup=True)
    for i, (part, (angle, _, _)) in enumerate(zip(PARTS, AXES, strict=True)):
        assert (getattr(memory, part).surface_integral == point[f"S{angle}"]) == (i == limited)
        if i == limited:
            assert internals.adaptation_frozen[i]
    _, memory, _ = stepped(point, actuation=Actuation(**{flag: True}), anti_windup=False)
    assert getattr(memory, PARTS[limited]).surface_integral != point[f"S{AXES[limited][0]}"]


def test_initial_memory_holds_the_initial_estimates():
    names = ("initial_constant", "initial_angle", "initial_rate")
    values = {f"{part}.{name}": 1.0 + 3 * i + j for i, part in enumerate(PARTS) for j, name in enumerate(names)}
    memory = abfnitsm.init(build(abfnitsm.Parameters, values), VEHICLE)
    found = [tuple(getattr(memory, part).estimates) for part in PARTS]
    assert found == [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0)]
    assert all(getattr(memory, part).surface_integral == 0.0 for part in PARTS)
