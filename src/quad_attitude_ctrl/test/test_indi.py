"""INDI: one step against the formulas of its source, what its increments reject."""

import math

import numpy as np
import pytest
import sympy
from scipy.spatial.transform import Rotation

from quad_attitude_ctrl import indi
from quad_attitude_ctrl.rotation_filter import NO_ROTATION
from quad_core.geometry import TwoLags
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle

DT = 0.002
VEHICLE = Vehicle(inertia_xx=3e-3, inertia_yy=4e-3, inertia_zz=7e-3, drag_torque_coefficient=0.0)
J = np.diag([3e-3, 4e-3, 7e-3])
FREE = {f"torque.{axis}": 1e6 for axis in ("roll", "pitch", "yaw")}
FED = FREE | {"shaping.command": "feed_forward", "bandwidth": 70.0}
GAINS = {
    f"{axis}.{name}": value
    for axis, pair in zip(("roll", "pitch", "yaw"), [(90.0, 8.0), (110.0, 9.0), (50.0, 6.0)], strict=True)
    for name, value in zip(("angle", "rate"), pair, strict=True)
}


def vec(values):
    return Vec3(*map(float, values))


def inputs(angles, omega, goal, rates=(0.0, 0.0, 0.0), accelerations=(0.0, 0.0, 0.0), actuation=None):
    q, q_d = (Quat(*map(float, Rotation.from_euler("ZYX", np.asarray(of)[::-1]).as_quat())) for of in (angles, goal))
    setpoint = AttitudeThrust(vec(goal), vec(rates), vec(accelerations), q_d, 5.0, 0.3)
    return AttitudeInputs(VehicleState(Vec3(), Vec3(), q, vec(omega)), setpoint, actuation or Actuation())


def goal_in_motion(angles, rates, accelerations):
    """Return R_d, Omega_d and Omega_d' of Z-Y-X angles in motion: SymPy differentiates the matrix."""
    t = sympy.Symbol("t")
    phi, theta, psi = (
        sympy.Float(a) + sympy.Float(r) * t + sympy.Float(c) * t**2 / 2
        for a, r, c in zip(angles, rates, accelerations, strict=True)
    )
    turn = sympy.rot_ccw_axis3(psi) * sympy.rot_ccw_axis2(theta) * sympy.rot_ccw_axis1(phi)
    skew = turn.T * turn.diff(t)
    omega = sympy.Matrix([skew[2, 1], skew[0, 2], skew[1, 0]])
    return tuple(np.array(part.subs(t, 0).evalf(), dtype=float) for part in (turn, omega, omega.diff(t)))


def test_one_step_is_the_formula_of_its_source():
    parameters = build(indi.Parameters, FED | GAINS)
    angles, omega, before = np.array([0.3, -0.4, 1.1]), np.array([0.7, -0.5, 0.9]), np.array([0.68, -0.49, 0.93])
    a1, a2 = np.array([3.0, -2.0, 1.0]), np.array([2.5, -1.0, 0.5])
    t1, t2 = np.array([0.02, 0.01, -0.03]), np.array([0.03, -0.02, 0.01])
    torque_given = np.array([0.05, -0.04, 0.02])
    memory = indi.Memory(NO_ROTATION, vec(before), TwoLags(vec(a1), vec(a2)), TwoLags(vec(t1), vec(t2)), True)
    goal, rates, accelerations = (0.1, 0.2, 0.8), (0.4, -0.3, 0.6), (1.5, 0.7, -0.9)
    given = inputs(angles, omega, goal, rates, accelerations, Actuation(torque_b=vec(torque_given)))
    wrench, after, seen = indi.step(parameters, VEHICLE, memory, given, DT)

    r = Rotation.from_euler("ZYX", angles[::-1]).as_matrix()
    r_d, omega_d, omega_d_rate = goal_in_motion(goal, rates, accelerations)
    twice = r_d.T @ r - r.T @ r_d
    e_r = 0.5 * np.array([twice[2, 1], twice[0, 2], twice[1, 0]])
    e_omega = omega - r.T @ r_d @ omega_d.ravel()
    ahead = r.T @ r_d @ omega_d_rate.ravel() - np.cross(omega, r.T @ r_d @ omega_d.ravel())
    nu = ahead - [90.0, 110.0, 50.0] * e_r - [8.0, 9.0, 6.0] * e_omega
    gain = 1.0 - math.exp(-70.0 * DT)
    a1 = a1 + gain * ((omega - before) / DT - a1)
    a2 = a2 + gain * (a1 - a2)
    t1 = t1 + gain * (torque_given - t1)
    t2 = t2 + gain * (t1 - t2)
    assert wrench.torque_b == pytest.approx(t2 + J @ (nu - a2), abs=1e-12)
    assert wrench.thrust == 5.0
    assert seen.angle_error == pytest.approx(e_r, abs=1e-12)
    assert seen.rate_error == pytest.approx(e_omega, abs=1e-12)
    assert seen.equivalent_control == pytest.approx(ahead, abs=1e-12)
    assert after.acceleration.second == pytest.approx(a2)
    assert after.torque.second == pytest.approx(t2)
    assert after.omega_b == pytest.approx(omega)


def settled(parameters, effectiveness, disturbance, seconds=3.0):
    """Return the roll in rad of a body whose rotors give a share of the nominal torque, under a steady push."""
    memory, angle, rate, effective = indi.init(parameters, VEHICLE), 0.0, 0.0, 0.0
    for _ in range(round(seconds / DT)):
        # what rotors gave is known as the nominal model has it
        known = Actuation(torque_b=Vec3(effective, 0.0, 0.0))
        wrench, memory, _ = indi.step(
            parameters, VEHICLE, memory, inputs([angle, 0, 0], [rate, 0, 0], (0.2, 0, 0), actuation=known), DT
        )
        effective = wrench.torque_b.x
        rate += DT * (effectiveness * effective / VEHICLE.inertia_xx + disturbance)
        angle += DT * rate
    return angle


@pytest.mark.parametrize(("effectiveness", "disturbance"), [(1.0, 4.0), (0.6, 0.0), (0.5, -4.0)])
def test_a_steady_push_and_weak_rotors_leave_no_error(effectiveness, disturbance):
    """Increments act as an integral: where the model is wrong the next step adds what was missing."""
    parameters = build(indi.Parameters, FREE | {"shaping.command": "raw"})
    assert settled(parameters, effectiveness, disturbance) == pytest.approx(0.2, abs=1e-6)
