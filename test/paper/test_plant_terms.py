"""Both plants against the transcription of Eqs. 1-17, term by term and as whole right-hand sides."""

import random

import paper_equations as eq
import pytest
import sympy as sp
from evaluation import evaluator
from paper_points import VEHICLE, VEHICLE_VALUES

from quad_core.geometry import body_z, euler_rates, quaternion_from_euler
from quad_core.types import CALM, Quat, Rotors, Vec3, VehicleState, Wrench
from quad_core.vehicle import DragSign
from quad_dynamics import newton_euler, paper, rigid_body, rotors
from quad_dynamics.parameters import Effectiveness, InertiaError, PlantParameters

pytestmark = pytest.mark.unit

SAME = {"rel": 1e-12, "abs": 1e-12}
CHANCE = random.Random(117)
TORQUE_NAMES = ("U_phi", "U_theta", "U_psi")


def random_point():
    point = dict(VEHICLE_VALUES)
    point |= {f"x{i}": CHANCE.uniform(-1.2, 1.2) for i in (1, 3)} | {"x5": CHANCE.uniform(-3.1, 3.1)}
    point |= {f"x{i}": CHANCE.uniform(-4.0, 4.0) for i in (2, 4, 6, 7, 8, 9, 10, 11, 12)}
    point |= {name: CHANCE.uniform(-5.0, 5.0) for name in ("p", "q", "r")}
    point |= {f"R{i}": CHANCE.uniform(1.0, 40.0) for i in (1, 2, 3, 4)}
    point |= {name: CHANCE.uniform(-0.5, 0.5) for name in TORQUE_NAMES}
    point |= {f"d_{name}": CHANCE.uniform(-2.0, 2.0) for name in ("x", "y", "z", "phi", "theta", "psi")}
    point |= {f"tau_{name}": CHANCE.uniform(-0.3, 0.3) for name in "xyz"}
    point |= {f"dtau_A_{name}": CHANCE.uniform(-0.1, 0.1) for name in "xyz"}
    point |= {f"dI_{name}": CHANCE.uniform(-1e-3, 1e-3) for name in ("xx", "yy", "zz")}
    return point | {"F_T": CHANCE.uniform(4.0, 14.0), "dm": CHANCE.uniform(-0.2, 0.2)}


POINTS = [random_point() for _ in range(40)]
SIGNS = [pytest.param(DragSign.CORRECTED, id="corrected"), pytest.param(DragSign.PRINTED, id="printed")]
DRAG = {
    DragSign.CORRECTED: (eq.EQ5, eq.EQ9, eq.EQ16),
    DragSign.PRINTED: (eq.EQ5_PRINTED, eq.EQ9_PRINTED, eq.EQ16_PRINTED),
}
EQ1 = {sign: [evaluator(side) for side in eq.eq1(eq.tau, force, moment)] for sign, (force, moment, _) in DRAG.items()}
VIRTUAL = dict(zip((eq.U_x, eq.U_y, eq.U_z), eq.EQ15, strict=True))
EQ16 = {sign: evaluator(rates.xreplace(VIRTUAL)) for sign, (_, _, rates) in DRAG.items()}
eq3, eq4, eq8, eq13 = (evaluator(e) for e in (eq.EQ3, eq.EQ4, eq.EQ8, eq.EQ13))


def body(sign):
    return newton_euler.nominal_body(PlantParameters()._replace(drag_sign=sign), VEHICLE)


def vector(point, *names):
    return Vec3(*(point[name] for name in names))


def attitude(point):
    return quaternion_from_euler(vector(point, "x1", "x3", "x5"))


def speeds_to_thrusts(point):
    return Rotors(*(rotors.rotor_thrust(VEHICLE, point[f"R{i}"]) for i in (1, 2, 3, 4)))


def test_eq3_collective_thrust_and_its_inverse():
    for point in POINTS:
        thrusts = speeds_to_thrusts(point)
        assert rotors.wrench_from_rotors(VEHICLE, thrusts).thrust == pytest.approx(eq3(point)[0], **SAME)
        assert [rotors.rotor_speed(VEHICLE, f) for f in thrusts] == pytest.approx([point[f"R{i}"] for i in range(1, 5)])


def test_eq8_is_physical_torque_after_the_arm():
    for point in POINTS:
        wrench = rotors.wrench_from_rotors(VEHICLE, speeds_to_thrusts(point))
        u_phi, u_theta, u_psi = eq8(point)
        expected = (VEHICLE.arm_length * u_phi, VEHICLE.arm_length * u_theta, u_psi)
        assert wrench.torque_b == pytest.approx(expected, **SAME)


@pytest.mark.parametrize("sign", SIGNS)
def test_eq1_whole_right_hand_side_of_rigid_body(sign):
    for point in POINTS:
        q, omega = attitude(point), vector(point, "p", "q", "r")
        motion = VehicleState(Vec3(1.0, 2.0, 3.0), vector(point, "x8", "x10", "x12"), q, omega)
        moment = vector(point, "tau_x", "tau_y", "tau_z")
        around = rigid_body.surroundings(PlantParameters(drag_sign=sign), VEHICLE, CALM)
        rate = rigid_body.derivative(
            around, rotors.RotorWrench(point["F_T"], moment, 0.0, 0.0), rigid_body.flat(motion)
        )
        assert rate[:3] == (point["x8"], point["x10"], point["x12"])
        assert rate[3:6] == pytest.approx(EQ1[sign][0](point), **SAME)
        assert rate[10:] == pytest.approx(EQ1[sign][1](point), **SAME)


def test_eq13_quaternion_rate_turns_the_rotation_matrix_by_the_body_rates():
    """R' of Eq. 4 along Eq. 13 against the central difference of R along the quaternion rate."""
    for point in POINTS[:10]:
        q, omega = attitude(point), vector(point, "p", "q", "r")
        rate = newton_euler.quaternion_rate(q, omega)
        h = 1e-6
        ahead, behind = (Quat(*(a + sign * h * b for a, b in zip(q, rate, strict=True))) for sign in (1.0, -1.0))
        slope = [(a - b) / (2.0 * h) for a, b in zip(body_z(ahead), body_z(behind), strict=True)]
        angle_rates = dict(zip(("x1_dot", "x3_dot", "x5_dot"), eq13(point), strict=True))
        expected = EQ4_RATE(point | angle_rates)
        assert slope == pytest.approx(expected, abs=1e-8)


EQ4_RATE = evaluator(sp.Matrix(eq.EQ4.diff(eq.t)[2::3]))


@pytest.mark.parametrize("sign", SIGNS)
def test_eq16_whole_right_hand_side_of_paper(sign):
    inertia = (VEHICLE.inertia_xx, VEHICLE.inertia_yy, VEHICLE.inertia_zz)
    for point in POINTS:
        state = paper.State(*(point[f"x{i}"] for i in range(1, 13)))
        force = Vec3(*(VEHICLE.mass * point[f"d_{axis}"] for axis in "xyz"))
        arms = (VEHICLE.arm_length, VEHICLE.arm_length, 1.0)
        names = ("phi", "theta", "psi")
        moment = Vec3(*(arms[i] * point[f"U_{n}"] + inertia[i] * point[f"d_{n}"] for i, n in enumerate(names)))
        rate = paper.derivative(body(sign), paper.Acting(point["F_T"], force, moment), (*state, 0.0))
        assert rate[:12] == pytest.approx(EQ16[sign](point), rel=1e-11, abs=1e-11)


def test_eq13_paper_plant_publishes_the_body_rates_of_its_euler_rates():
    for point in POINTS:
        state = paper.State(*(point[f"x{i}"] for i in range(1, 13)))
        seen = paper.observe(PlantParameters(), VEHICLE, state)
        rates = euler_rates(vector(point, "x1", "x3", "x5"), seen.omega_b)
        assert rates == pytest.approx(vector(point, "x2", "x4", "x6"), rel=1e-10, abs=1e-10)
        assert eq13(point | dict(zip("pqr", seen.omega_b, strict=True))) == pytest.approx(
            vector(point, "x2", "x4", "x6"), rel=1e-10, abs=1e-10
        )


@pytest.mark.parametrize("sign", SIGNS)
def test_eq11_lumped_uncertainty(sign):
    """D_P and D_A of Eq. 11 with effectiveness loss as dF_A, dtau_A and outer force and torque in them too."""
    lumped_p, lumped_a = (evaluator(side) for side in eq.eq11(*DRAG[sign][:2]))
    vehicle = VEHICLE._replace(thrust_to_weight=20.0, torque_coefficient=0.9)
    for original in POINTS:
        point = dict(original)
        moment = vector(point, "tau_x", "tau_y", "tau_z")
        loss = Effectiveness(0.8, 0.9, 0.7, 0.6)
        parameters = PlantParameters(
            drag_sign=sign,
            mass_error=point["dm"],
            inertia_error=InertiaError(point["dI_xx"], point["dI_yy"], point["dI_zz"]),
            effectiveness=loss,
        )
        outer_force, outer_torque = vector(point, "d_x", "d_y", "d_z"), Vec3(0.03, -0.05, 0.07)
        axis = eq4(point)[2::3]
        for i, name in enumerate("xyz"):
            point[f"dF_A_{name}"] = (loss.thrust - 1.0) * point["F_T"] * axis[i] + outer_force[i]
            point[f"dtau_A_{name}"] = (loss[1 + i] - 1.0) * moment[i] + outer_torque[i]
        speed, omega = vector(point, "x8", "x10", "x12"), vector(point, "p", "q", "r")
        state = rigid_body.State(VehicleState(Vec3(0.0, 0.0, 0.0), speed, attitude(point), omega))
        wrench = Wrench(point["F_T"], moment)
        outer = CALM._replace(force_w=outer_force, torque_b=outer_torque)
        found = rigid_body.lumped(parameters, vehicle, state, wrench, outer)
        assert found.lumped_acceleration_w == pytest.approx(lumped_p(point), rel=1e-9, abs=1e-9)
        assert found.lumped_angular_acceleration_b == pytest.approx(lumped_a(point), rel=1e-9, abs=1e-9)
        assert (found.force_w, found.torque_b) == (outer_force, outer_torque)
