"""ITSM, PID, SE(3) and geometric PID: torques against the formulas of their sources, memory, limits."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_attitude_ctrl import geometric_pid, indi, itsm, pid, se3
from quad_attitude_ctrl.command import CommandSource, FilterState, FilterStates, Shaping, desired
from quad_attitude_ctrl.rotation_filter import NO_ROTATION
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle

DT = 0.002
VEHICLE = Vehicle(inertia_xx=3e-3, inertia_yy=4e-3, inertia_zz=7e-3, drag_torque_coefficient=0.0)
J = np.diag([3e-3, 4e-3, 7e-3])
FREE = {f"torque.{axis}": 1e6 for axis in ("roll", "pitch", "yaw")}
FED = FREE | {"shaping.command": "feed_forward"}
ANGLES, OMEGA = np.array([0.3, -0.4, 1.1]), np.array([0.7, -0.5, 0.9])
GOAL, GOAL_RATES, GOAL_ACC = np.array([0.1, 0.2, 0.8]), np.array([0.4, -0.3, 0.6]), np.array([1.5, 0.7, -0.9])
ZERO = Vec3(0.0, 0.0, 0.0)


def matrix(angles):
    return Rotation.from_euler("ZYX", np.asarray(angles)[::-1]).as_matrix()


def vec(values):
    return Vec3(*map(float, values))


def inputs(angles=ANGLES, omega=OMEGA, goal=GOAL, rates=GOAL_RATES, accelerations=GOAL_ACC, actuation=None):
    q, q_d = (Quat(*map(float, Rotation.from_euler("ZYX", np.asarray(of)[::-1]).as_quat())) for of in (angles, goal))
    state = VehicleState(Vec3(), Vec3(), q, vec(omega))
    setpoint = AttitudeThrust(vec(goal), vec(rates), vec(accelerations), q_d, 5.0, 0.3)
    return AttitudeInputs(state, setpoint, actuation or Actuation())


def hat(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def vee(m):
    return np.array([m[2, 1], m[0, 2], m[1, 0]])


def moving(angles, rates, accelerations):
    """Body rates and their derivative of Euler angles in motion, from differences of rotation matrices."""

    def omega(t, h=1e-4):
        def at(s):
            return matrix(angles + rates * s + 0.5 * accelerations * s * s)

        return vee(at(t).T @ (at(t + h) - at(t - h)) / (2.0 * h))

    return omega(0.0), (omega(1e-4) - omega(-1e-4)) / 2e-4


def euler_rates_of(angles, omega):
    columns = np.column_stack([moving(angles, row, np.zeros(3))[0] for row in np.eye(3)])
    return np.linalg.solve(columns, omega)


def test_se3_is_its_formula():
    gains = {
        f"{axis}.{name}": value
        for axis, pair in zip(("roll", "pitch", "yaw"), [(90.0, 8.0), (110.0, 9.0), (50.0, 6.0)], strict=True)
        for name, value in zip(("angle", "rate"), pair, strict=True)
    }
    parameters = build(se3.Parameters, FED | gains)
    wrench, _, seen = se3.step(parameters, VEHICLE, se3.init(parameters, VEHICLE), inputs(), DT)
    r, r_d = matrix(ANGLES), matrix(GOAL)
    omega_d, omega_d_rate = moving(GOAL, GOAL_RATES, GOAL_ACC)
    e_r = 0.5 * vee(r_d.T @ r - r.T @ r_d)
    e_omega = OMEGA - r.T @ r_d @ omega_d
    k_r, k_omega = J @ np.diag([90.0, 110.0, 50.0]), J @ np.diag([8.0, 9.0, 6.0])
    torque = -k_r @ e_r - k_omega @ e_omega + np.cross(OMEGA, J @ OMEGA)
    torque -= J @ (hat(OMEGA) @ r.T @ r_d @ omega_d - r.T @ r_d @ omega_d_rate)
    assert seen.angle_error == pytest.approx(e_r, abs=1e-12)
    assert seen.rate_error == pytest.approx(e_omega, abs=1e-6)
    assert wrench.torque_b == pytest.approx(torque, abs=1e-7)
    assert wrench.thrust == 5.0


def test_geometric_pid_is_its_formula():
    names = ("angle", "rate", "integral", "mixing")
    rows = [(90.0, 8.0, 30.0, 2.0), (110.0, 9.0, 40.0, 3.0), (50.0, 6.0, 20.0, 1.0)]
    gains = {
        f"{axis}.{name}": value
        for axis, row in zip(("roll", "pitch", "yaw"), rows, strict=True)
        for name, value in zip(names, row, strict=True)
    }
    parameters, e_i = build(geometric_pid.Parameters, FED | gains), np.array([0.02, -0.03, 0.05])
    memory = geometric_pid.Memory(NO_ROTATION, vec(e_i), True)
    wrench, after, seen = geometric_pid.step(parameters, VEHICLE, memory, inputs(), DT)
    r, r_d = matrix(ANGLES), matrix(GOAL)
    omega_d, omega_d_rate = moving(GOAL, GOAL_RATES, GOAL_ACC)
    e_r, w_d = 0.5 * vee(r_d.T @ r - r.T @ r_d), r.T @ r_d @ omega_d
    e_omega, k = OMEGA - w_d, np.array(rows)
    torque = (
        -J @ (k[:, 0] * e_r + k[:, 1] * e_omega + k[:, 2] * e_i) + hat(w_d) @ J @ w_d + J @ r.T @ r_d @ omega_d_rate
    )
    assert wrench.torque_b == pytest.approx(torque, abs=1e-7)
    assert seen.surface_integral == tuple(e_i)
    assert after.integral == pytest.approx(e_i + DT * (e_omega + k[:, 3] * e_r), abs=1e-8)


def test_pid_is_its_formula():
    gains = {
        f"{axis}.{name}": value
        for axis, values in zip(
            ("roll", "pitch", "yaw"),
            [(6.0, 20.0, 30.0, 0.1), (7.0, 25.0, 40.0, 0.2), (3.0, 9.0, 10.0, 0.3)],
            strict=True,
        )
        for name, value in zip(("angle", "rate", "integral", "derivative"), values, strict=True)
    }
    parameters = build(pid.Parameters, FED | gains | {"derivative_bandwidth": 100.0, "acceleration_feed_forward": 0.6})
    part, filtered, before = np.array([0.5, -0.7, 0.9]), np.array([3.0, -4.0, 1.0]), OMEGA - [0.02, -0.01, 0.03]
    memory = pid.Memory(NO_ROTATION, vec(part), vec(filtered), vec(before), True)
    wrench, next_memory, seen = pid.step(parameters, VEHICLE, memory, inputs(), DT)
    p, k = np.array([6.0, 7.0, 3.0]), np.array([20.0, 25.0, 9.0])
    r, r_d = matrix(ANGLES), matrix(GOAL)
    # the shortest turn that points the thrust, in body axes, and the turn about the thrust that is left
    to = r.T @ r_d[:, 2]
    tilt = np.arccos(to[2]) * np.cross([0.0, 0.0, 1.0], to) / np.hypot(*to[:2])
    left = Rotation.from_rotvec(-tilt).as_matrix() @ r.T @ r_d
    way = np.array([*tilt[:2], np.arctan2(left[1, 0], left[0, 0])])
    goal_omega, goal_ahead = moving(GOAL, GOAL_RATES, GOAL_ACC)
    omega_d, ahead = r.T @ r_d @ goal_omega + p * way, r.T @ r_d @ goal_ahead
    measured = filtered + (1.0 - math.exp(-0.2)) * (np.array([10.0, -5.0, 15.0]) - filtered)
    torque = J @ (0.6 * ahead + k * (omega_d - OMEGA) + part - [0.1, 0.2, 0.3] * measured)
    assert wrench.torque_b == pytest.approx(torque, abs=1e-6)
    assert seen.angle_error == pytest.approx(-way, abs=1e-12)
    assert next_memory.acceleration == pytest.approx(measured)
    assert next_memory.integral == pytest.approx(part + [30.0, 40.0, 10.0] * (omega_d - OMEGA) * DT, abs=1e-7)


def test_itsm_is_its_formula():
    gains = {
        f"{axis}.{name}": value
        for axis, values in zip(
            ("roll", "pitch", "yaw"),
            [(60.0, 9.0, 0.6, 2.0), (70.0, 11.0, 0.7, 3.0), (20.0, 5.0, 0.8, 4.0)],
            strict=True,
        )
        for name, value in zip(("angle_gain", "rate_gain", "exponent", "switching_gain"), values, strict=True)
    }
    parameters = build(itsm.Parameters, FED | gains)
    integral = np.array([0.4, -2.0, 0.3])
    memory = itsm.Memory(FilterStates(), vec(integral), True)
    wrench, next_memory, seen = itsm.step(parameters, VEHICLE, memory, inputs(), DT)
    e = ANGLES - GOAL
    e_rate = euler_rates_of(ANGLES, OMEGA) - GOAL_RATES
    a = np.array([0.6, 0.7, 0.8])
    integrand = [60.0, 70.0, 20.0] * np.sign(e) * np.abs(e) ** a
    integrand += [9.0, 11.0, 5.0] * np.sign(e_rate) * np.abs(e_rate) ** (2.0 * a / (1.0 + a))
    s = e_rate + integral
    control = GOAL_ACC - integrand - [2.0, 3.0, 4.0] * np.sign(s)
    # the torque that gives these Euler accelerations
    _, turned = moving(ANGLES, euler_rates_of(ANGLES, OMEGA), control)
    assert wrench.torque_b == pytest.approx(J @ turned + np.cross(OMEGA, J @ OMEGA), abs=1e-6)
    assert seen.sliding_variable == pytest.approx(s, abs=1e-7)
    assert seen.surface_exponent == tuple(a)
    assert next_memory.integral == pytest.approx(integral + DT * integrand, abs=1e-7)


def glide(parameters, disturbance, seconds):
    """Roll of a body that starts 0.3 rad off under a constant angular acceleration; errors by step."""
    memory, angle, rate, angles, torques = itsm.init(parameters, VEHICLE), 0.3, 0.0, [], []
    for _ in range(round(seconds / DT)):
        given = inputs([angle, 0.0, 0.0], [rate, 0.0, 0.0], np.zeros(3), np.zeros(3), np.zeros(3))
        wrench, memory, _ = itsm.step(parameters, VEHICLE, memory, given, DT)
        rate += DT * (wrench.torque_b.x / VEHICLE.inertia_xx + disturbance)
        angle += DT * rate
        angles.append(angle)
        torques.append(wrench.torque_b.x)
    return np.array(angles), np.array(torques)


def test_itsm_rejects_what_its_switching_gain_exceeds_and_a_layer_quiets_it():
    hard = build(itsm.Parameters, FREE | {"shaping.command": "raw", "roll.switching_gain": 3.0})
    soft = build(itsm.Parameters, FREE | {"shaping.command": "raw", "roll.switching_gain": 3.0, "switching": "layer"})
    for parameters in (hard, soft):
        angles, _ = glide(parameters, 2.0, 4.0)
        assert np.abs(angles[-500:]).max() < 2e-4
    noisy, quiet = (np.abs(np.diff(glide(parameters, 2.0, 4.0)[1][-500:])).sum() for parameters in (hard, soft))
    assert quiet < 0.02 * noisy
    weak = build(itsm.Parameters, FREE | {"shaping.command": "raw", "roll.switching_gain": 1.0})
    # what is left over, 1 rad/s^2, is held by k_1 |e|^a_1 alone
    assert glide(weak, 2.0, 4.0)[0][-1] == pytest.approx(0.01 ** (1.0 / 0.7), rel=1e-3)


@pytest.mark.parametrize("law", [itsm, pid, geometric_pid])
def test_integrals_rest_while_the_torque_is_limited(law):
    for limit, flags, rests in (
        (1e6, Actuation(), (False, False, False)),
        (1e-4, Actuation(), (True, True, True)),
        (1e6, Actuation(pitch_limited=True), (False, True, False)),
    ):
        parameters = build(law.Parameters, FED | {f"torque.{axis}": limit for axis in ("roll", "pitch", "yaw")})
        start = law.init(parameters, VEHICLE)._replace(integral=vec([0.01, -0.02, 0.03]))
        wrench, next_memory, seen = law.step(parameters, VEHICLE, start, inputs(actuation=flags), DT)
        assert tuple(seen.adaptation_frozen) == rests
        assert tuple(a == b for a, b in zip(next_memory.integral, start.integral, strict=True)) == rests
        assert all(abs(torque) <= limit for torque in wrench.torque_b)
        loose = build(law.Parameters, FED | {"anti_windup": False})
        _, next_memory, seen = law.step(loose, VEHICLE, start, inputs(actuation=flags), DT)
        assert not any(seen.adaptation_frozen)


@pytest.mark.parametrize("law", [itsm, pid, geometric_pid])
def test_integrals_are_bounded(law):
    bounds = {
        f"{axis}.max_integral": bound for axis, bound in zip(("roll", "pitch", "yaw"), (0.3, 0.4, 0.5), strict=True)
    }
    parameters = build(law.Parameters, FED | bounds)
    memory = law.init(parameters, VEHICLE)
    for _ in range(1000):
        _, memory, _ = law.step(parameters, VEHICLE, memory, inputs(), DT)
    assert np.abs(memory.integral) == pytest.approx([0.3, 0.4, 0.5])


def test_commands_come_from_the_chosen_source():
    filters = FilterStates(
        FilterState(0.1, 0.2, 0.3, 0.9), FilterState(0.4, 0.5, 0.6, 0.9), FilterState(0.7, 0.8, 0.9, 0.9)
    )
    given = inputs().setpoint
    assert [build(Shaping, {"command": name}).command for name in ("filter", "feed_forward", "raw")] == [0, 1, 2]
    assert desired(CommandSource.FILTER, filters, given) == ((0.1, 0.4, 0.7), (0.2, 0.5, 0.8), (0.3, 0.6, 0.9))
    assert desired(CommandSource.FEED_FORWARD, filters, given) == (vec(GOAL), vec(GOAL_RATES), vec(GOAL_ACC))
    assert desired(CommandSource.RAW, filters, given) == (vec(GOAL), ZERO, ZERO)


@pytest.mark.parametrize("law", [itsm, pid, se3, indi, geometric_pid])
def test_filters_start_at_the_attitude_and_end_at_the_setpoint(law):
    parameters = law.Parameters()
    memory = law.init(parameters, VEHICLE)
    _, memory, seen = law.step(parameters, VEHICLE, memory, inputs(), DT)
    assert seen.desired_angles == pytest.approx(ANGLES)
    assert seen.desired_rates == (0.0, 0.0, 0.0)
    for _ in range(2000):
        _, memory, seen = law.step(parameters, VEHICLE, memory, inputs(), DT)
    assert seen.desired_angles == pytest.approx(GOAL, abs=1e-6)


@pytest.mark.parametrize("law", [pid, se3, indi, geometric_pid])
def test_the_attitude_of_the_setpoint_is_flown_and_not_its_angles(law):
    """With yaw 2 rad off, thrust tilted in the measured heading: angles and set yaw make another thrust axis."""
    parameters, memory = law.Parameters(), law.init(law.Parameters(), VEHICLE)
    heading, goal = 2.0, Vec3(0.3, -0.4, 0.0)
    tilted = Rotation.from_euler("ZYX", [heading, goal.y, goal.x]) * Rotation.from_euler("z", -heading)
    setpoint = AttitudeThrust(goal, ZERO, ZERO, Quat(*map(float, tilted.as_quat())), 5.0, 0.3)
    state = VehicleState(Vec3(), Vec3(), Quat(*map(float, Rotation.from_euler("z", heading).as_quat())), ZERO)
    for _ in range(2500):
        _, memory, _ = law.step(parameters, VEHICLE, memory, AttitudeInputs(state, setpoint, Actuation()), DT)
    goal_axis = Rotation.from_quat(memory.filter.attitude).apply([0.0, 0.0, 1.0])
    assert goal_axis == pytest.approx(tilted.apply([0.0, 0.0, 1.0]), abs=1e-6)
