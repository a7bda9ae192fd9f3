"""ABFNITSM on SO(3): the paper's law near level, no singularity, no long way round, its proof's first step."""

import math
import random

import numpy as np
import pytest
import sympy as sp
from attitude_cases import VEHICLE, any_inputs, numbers
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_attitude_ctrl import abfnitsm, abfnitsm_so3
from quad_attitude_ctrl.abfnitsm_so3 import chosen_side, doubled
from quad_attitude_ctrl.rotation_filter import Goal
from quad_attitude_ctrl.torque import inverse_dynamics
from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Quat, Vec3, VehicleState
from quad_core.vehicle import DragSign

DT = 0.002
ZERO = Vec3(0.0, 0.0, 0.0)
FED = build(abfnitsm_so3.Parameters, {"command": "feed_forward"})
UNLIMITED = FED._replace(**{axis: getattr(FED, axis)._replace(max_torque=1e3) for axis in ("roll", "pitch", "yaw")})
EULER = build(abfnitsm.Parameters, {"command": "feed_forward"})


def quaternion(rotation):
    return Quat(*map(float, rotation.as_quat()))


def inputs(angles, omega, goal=ZERO, rates=ZERO, accelerations=ZERO):
    setpoint = AttitudeThrust(goal, rates, accelerations, quaternion_from_euler(goal), 5.0, 0.3)
    return AttitudeInputs(VehicleState(ZERO, ZERO, quaternion_from_euler(angles), omega), setpoint, Actuation())


def vector(rng, size):
    return Vec3(*(rng.uniform(-size, size) for _ in range(3)))


def test_near_level_it_is_the_paper_s_law():
    rng = random.Random(4)
    for _ in range(200):
        # angles in the middle of the surface's layer, where the law is all but linear
        small = 1e-4
        given_ = inputs(
            vector(rng, small), vector(rng, small), vector(rng, small), vector(rng, small), vector(rng, 1.0)
        )
        memory, other = abfnitsm_so3.init(FED, VEHICLE), abfnitsm.init(EULER, VEHICLE)
        mine, _, shown = abfnitsm_so3.step(FED, VEHICLE, memory, given_, DT)
        theirs, _, expected = abfnitsm.step(EULER, VEHICLE, other, given_, DT)
        # but for products of angle and acceleration
        assert list(mine.torque_b) == pytest.approx(list(theirs.torque_b), rel=1e-3, abs=1e-5)
        assert list(shown.angle_error) == pytest.approx(list(expected.angle_error), abs=1e-7)
        assert list(shown.rate_error) == pytest.approx(list(expected.rate_error), abs=1e-7)
        assert list(shown.sliding_variable) == pytest.approx(list(expected.sliding_variable), abs=1e-7)


def test_near_level_its_error_is_that_of_equation_40_as_sympy_has_it():
    size = sp.Symbol("size")
    phi, theta, psi, phi_d, theta_d, psi_d = sp.symbols("phi theta psi phi_d theta_d psi_d")

    def turn(axis, angle):
        parts = [0, 0, 0]
        parts[axis] = 1
        return sp.Quaternion.from_axis_angle(parts, size * angle)

    def attitude(x, y, z):
        return turn(2, z) * turn(1, y) * turn(0, x)

    error = attitude(phi_d, theta_d, psi_d).inverse() * attitude(phi, theta, psi)
    parts = [2 * part for part in (error.b, error.c, error.d)]
    assert [part.subs(size, 0) for part in parts] == [0] * 3
    first = [sp.diff(part, size).subs(size, 0) for part in parts]
    assert [sp.simplify(a - b) for a, b in zip(first, (phi - phi_d, theta - theta_d, psi - psi_d), strict=True)] == [
        0
    ] * 3


def test_the_rate_of_four_times_one_less_q_w_is_error_times_rate_error():
    rng = np.random.default_rng(7)
    for _ in range(50):
        q, omega, h = Rotation.random(random_state=rng), rng.normal(size=3), 1e-6
        side = math.copysign(1.0, q.as_quat()[3])
        before, after = ((q * Rotation.from_rotvec(sign * h * omega)).as_quat()[3] * side for sign in (-1, 1))
        slope = -4.0 * (after - before) / (2.0 * h)
        assert slope == pytest.approx(np.dot(doubled(quaternion(q), side), omega), abs=1e-5)


def test_its_rate_error_is_that_of_the_goal_s_rates_turned_into_the_body_s_axes():
    rng = random.Random(12)
    for _ in range(50):
        angles, goal, omega, rates = vector(rng, 1.0), vector(rng, 1.0), vector(rng, 3.0), vector(rng, 3.0)
        _, _, shown = abfnitsm_so3.step(
            FED, VEHICLE, abfnitsm_so3.init(FED, VEHICLE), inputs(angles, omega, goal, rates), DT
        )
        # omega_d from d/dt of the rotation matrix, by differences
        step = 1e-6
        before, after = (
            Rotation.from_euler("ZYX", [g + sign * step * r for g, r in zip(goal[::-1], rates[::-1], strict=True)])
            for sign in (-1, 1)
        )
        omega_d = (before.inv() * after).as_rotvec() / (2.0 * step)
        middle = Rotation.from_euler("ZYX", goal[::-1])
        relative = middle.inv() * Rotation.from_euler("ZYX", angles[::-1])
        expected = np.array(omega) - relative.inv().apply(omega_d)
        assert list(shown.rate_error) == pytest.approx(expected.tolist(), abs=1e-6)


def asked(angles, omega, goal, rates):
    """Return the angular acceleration that the first step asks for."""
    memory = abfnitsm_so3.init(UNLIMITED, VEHICLE)
    wrench, _, _ = abfnitsm_so3.step(UNLIMITED, VEHICLE, memory, inputs(angles, omega, goal, rates), DT)
    free = inverse_dynamics(VEHICLE, omega, ZERO, DragSign.CORRECTED)
    inertia = (VEHICLE.inertia_xx, VEHICLE.inertia_yy, VEHICLE.inertia_zz)
    return (np.array(wrench.torque_b) - np.array(free)) / np.array(inertia)


def test_it_adds_how_the_goal_s_rates_change_in_axes_that_turn_with_the_body():
    rng, step, h = random.Random(5), 1e-3, 1e-5
    for _ in range(20):
        angles, goal, omega, rates = vector(rng, 0.3), vector(rng, 0.3), vector(rng, 1.0), vector(rng, 1.0)

        def goal_at(time, goal=goal, rates=rates):
            return Rotation.from_euler("ZYX", [g + time * r for g, r in zip(goal[::-1], rates[::-1], strict=True)])

        def seen(time, angles=angles, omega=omega, goal_at=goal_at):
            omega_d = (goal_at(time - h).inv() * goal_at(time + h)).as_rotvec() / (2.0 * h)
            body = Rotation.from_euler("ZYX", angles[::-1]) * Rotation.from_rotvec(time * np.array(omega))
            return (body.inv() * goal_at(time)).apply(omega_d)

        change = (seen(step) - seen(-step)) / (2.0 * step)
        # the same errors with a goal that rests: only what the goal carries is gone
        resting = asked(angles, Vec3(*(np.array(omega) - seen(0.0)).tolist()), goal, ZERO)
        assert asked(angles, omega, goal, rates) - resting == pytest.approx(change, abs=1e-4)


def test_it_turns_the_short_way():
    for degrees, sign in ((170.0, -1.0), (190.0, 1.0), (-170.0, 1.0), (-190.0, -1.0)):
        given_ = inputs(Vec3(math.radians(degrees), 0.0, 0.0), ZERO)
        wrench, _, _ = abfnitsm_so3.step(FED, VEHICLE, abfnitsm_so3.init(FED, VEHICLE), given_, DT)
        assert math.copysign(1.0, wrench.torque_b.x) == sign, degrees


def test_the_side_changes_only_beyond_the_margin():
    memory = abfnitsm_so3.init(FED, VEHICLE)
    assert [chosen_side(memory, scalar, 0.05) for scalar in (0.0, 0.1, -0.01)] == [1.0, 1.0, -1.0]
    flown = memory._replace(initialised=True)
    assert [chosen_side(flown, scalar, 0.05) for scalar in (0.1, -0.04, -0.06)] == [1.0, 1.0, -1.0]
    assert chosen_side(flown._replace(side=-1.0), 0.06, 0.05) == 1.0


@given(any_inputs())
def test_it_answers_any_flyable_input(given_):
    parameters = abfnitsm_so3.Parameters()
    memory = abfnitsm_so3.init(parameters, VEHICLE)
    for _ in range(3):
        wrench, memory, internals = abfnitsm_so3.step(parameters, VEHICLE, memory, given_, DT)
        assert all(map(math.isfinite, (*numbers(wrench), *numbers(memory), *numbers(internals))))
        assert max(map(abs, wrench.torque_b)) <= 0.5


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, -0.8, 0.0), (0.0, 0.0, 1.0)])
def test_exactly_turned_over_it_comes_back(axis):
    parameters, inertia = abfnitsm_so3.Parameters(), np.array([0.011, 0.017, 0.026])
    memory, attitude, omega = (
        abfnitsm_so3.init(parameters, VEHICLE),
        Rotation.from_rotvec(np.pi * np.array(axis)),
        np.zeros(3),
    )
    for _ in range(1500):
        state = VehicleState(ZERO, ZERO, quaternion(attitude), Vec3(*map(float, omega)))
        given_ = AttitudeInputs(state, AttitudeThrust(thrust=5.0), Actuation())
        wrench, memory, _ = abfnitsm_so3.step(parameters, VEHICLE, memory, given_, DT)
        omega = omega + DT * (np.array(wrench.torque_b) - np.cross(omega, inertia * omega)) / inertia
        attitude = attitude * Rotation.from_rotvec(DT * omega)
    assert attitude.magnitude() < (0.05 if axis[2] == 0.0 else 0.6)


def test_a_spinning_vehicle_s_thrust_points_up_before_it_has_stopped_to_spin():
    # x500, whose rotors give 0.15 N m about z: 9 rad/s of spin need 3 s
    inertia, largest = np.array([0.0236, 0.0236, 0.0439]), np.array([2.0, 2.0, 0.15])
    parameters = build(abfnitsm_so3.Parameters, {f"{axis}.max_torque": 2.0 for axis in ("roll", "pitch")})
    parameters = parameters._replace(yaw=parameters.yaw._replace(max_torque=0.15))
    x500 = VEHICLE._replace(inertia_xx=0.0236, inertia_yy=0.0236, inertia_zz=0.0439)
    memory, omega = abfnitsm_so3.init(parameters, x500), np.array([-5.0, -2.5, 9.7])
    attitude = Rotation.from_euler("ZYX", [2.0, 0.6, 2.4])
    for _ in range(500):
        state = VehicleState(ZERO, ZERO, quaternion(attitude), Vec3(*map(float, omega)))
        given_ = AttitudeInputs(state, AttitudeThrust(thrust=5.0), Actuation())
        wrench, memory, _ = abfnitsm_so3.step(parameters, x500, memory, given_, DT)
        assert (np.abs(wrench.torque_b) <= largest).all()
        omega = omega + DT * (np.array(wrench.torque_b) - np.cross(omega, inertia * omega)) / inertia
        attitude = attitude * Rotation.from_rotvec(DT * omega)
    assert attitude.apply([0.0, 0.0, 1.0])[2] > math.cos(0.2)
    assert abs(omega[2]) > 4.0


@given(st.integers(0, 10**6), st.floats(0.05, 3.0))
def test_only_the_goal_s_heading_gives_way_to_the_vehicle_s(seed, widest):
    rng = np.random.default_rng(seed)
    vehicle, goal = Rotation.random(random_state=rng), Rotation.random(random_state=rng)
    rates, accelerations = (Vec3(*map(float, rng.normal(size=3))) for _ in range(2))
    given_ = Goal(quaternion(goal), rates, accelerations)
    near = abfnitsm_so3.with_heading_near(given_, quaternion(vehicle), widest)
    turned_goal = Rotation.from_quat(near.attitude)
    # thrust axis and what the goal does are the same in the world
    assert turned_goal.apply([0.0, 0.0, 1.0]) == pytest.approx(goal.apply([0.0, 0.0, 1.0]), abs=1e-9)
    for mine, theirs in ((near.rates, rates), (near.accelerations, accelerations)):
        assert turned_goal.apply(mine) == pytest.approx(goal.apply(theirs), abs=1e-9)
    # what is left to turn is the angle about the goal's thrust axis after the shortest tilt
    _, _, z, w = (vehicle.inv() * turned_goal).as_quat()
    left = 2.0 * np.arctan2(z, w)
    assert abs((left + np.pi) % (2.0 * np.pi) - np.pi) <= widest + 1e-6
