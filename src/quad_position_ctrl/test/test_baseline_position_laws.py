"""IBS, PID, SE(3), geometric PID, INDI and L1: commands against the formulas of their sources, memory, limits."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.geometry import TwoLags
from quad_core.parameters import build
from quad_core.types import Actuation, PositionInputs, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_position_ctrl import geometric_pid, ibs, indi, l1, pid, se3
from quad_position_ctrl.setpoint import LiftLimits, ThrustForm, integrals_frozen, thrust_command
from quad_position_ctrl.speed_limit import SpeedLimits, correction_vector, is_speed_limited, proportional_correction

DT = 0.01
VEHICLE = Vehicle(mass=0.8, gravity=9.7, drag_coefficient=0.016)
WIDE = {
    "limits.acceleration_xy": 1e6,
    "limits.acceleration_z": 1e6,
    "limits.min_lift": -1e6,
    "limits.tilt": 1.58,
    "limits.thrust": 1e6,
    "limits.min_thrust": 0.0,
    "speed.max_xy": 1e6,
    "speed.max_z": 1e6,
    "speed.braking_xy": 1e6,
    "speed.braking_z": 1e6,
}
P, V = np.array([0.31, -0.22, 1.4]), np.array([0.5, 0.7, -0.3])
P_D, V_D, A_D = np.array([0.2, 0.1, 1.2]), np.array([0.4, 0.9, 0.1]), np.array([1.1, -0.6, 0.8])
YAW = 0.9
GRAVITY = np.array([0.0, 0.0, 9.7])
ANGLES = (0.2, -0.15, 0.4)


def quaternion(angles):
    x, y, z, w = Rotation.from_euler("ZYX", angles[::-1]).as_quat()
    return Quat(float(x), float(y), float(z), float(w))


def vec(values):
    return Vec3(*map(float, values))


def inputs(position=P, velocity=V, angles=ANGLES, actuation=None):
    state = VehicleState(vec(position), vec(velocity), quaternion(angles), Vec3(0.1, -0.2, 0.3))
    reference = TrajectoryPoint(0.0, vec(P_D), vec(V_D), vec(A_D), Vec3(), Vec3(), YAW, 0.05, -0.02)
    return PositionInputs(state, reference, actuation or Actuation())


def thrust_of(command, angles=ANGLES):
    """The lift projected on the actual body z axis, in N."""
    axis = Rotation.from_euler("ZYX", angles[::-1]).as_matrix()[:, 2]
    return VEHICLE.mass * float((np.asarray(command) + GRAVITY) @ axis)


def test_ibs_is_eq_30_with_a_constant_gain():
    gains = {
        f"{axis}.{name}": value
        for axis, values in zip("xyz", [(3.0, 5.0, 0.2), (4.0, 6.0, 0.3), (2.5, 7.0, 0.1)], strict=True)
        for name, value in zip(("position_gain", "velocity_gain", "integral_gain"), values, strict=True)
    }
    parameters = build(ibs.Parameters, WIDE | gains)
    integral = np.array([0.4, -0.6, 0.8])
    memory = ibs.init(parameters, VEHICLE)._replace(error_integral=vec(integral))
    answer, next_memory, seen = ibs.step(parameters, VEHICLE, memory, inputs(), DT)
    xi, xi8, k = np.array([3.0, 4.0, 2.5]), np.array([5.0, 6.0, 7.0]), np.array([0.2, 0.3, 0.1])
    e = P - P_D
    virtual = -xi * e + V_D - k * integral
    e8 = V - virtual
    command = A_D + (xi * xi - 1.0 - k) * e - (xi + xi8) * e8 + 0.02 * V + xi * k * integral
    assert seen.acceleration_command == pytest.approx(command, abs=1e-12)
    assert answer.thrust == pytest.approx(thrust_of(command), rel=1e-12)
    assert seen.adaptive_gain == tuple(xi8)
    assert next_memory.error_integral == pytest.approx(integral + DT * e)
    for _ in range(200):
        _, memory, seen = ibs.step(parameters, VEHICLE, memory, inputs(), DT)
    assert seen.adaptive_gain == tuple(xi8)
    assert seen.disturbance_estimate == (0.0, 0.0, 0.0)


PID_GAINS = {
    "xy.position": 2.0, "xy.velocity": 5.0, "xy.integral": 1.5, "xy.derivative": 0.3,
    "z.position": 3.0, "z.velocity": 7.0, "z.integral": 0.5, "z.derivative": 0.2, "derivative_bandwidth": 20.0,
}  # fmt: skip


def test_pid_is_its_formula():
    parameters = build(pid.Parameters, WIDE | PID_GAINS)
    part, filtered, before = np.array([0.3, -0.4, 0.5]), np.array([1.0, -2.0, 0.5]), V - [0.02, 0.01, -0.03]
    memory = pid.Memory(vec(part), vec(filtered), vec(before), True)
    answer, next_memory, seen = pid.step(parameters, VEHICLE, memory, inputs(), DT)
    gain, p_gain = np.array([5.0, 5.0, 7.0]), np.array([2.0, 2.0, 3.0])
    measured = filtered + (1.0 - math.exp(-0.2)) * (np.array([2.0, 1.0, -3.0]) - filtered)
    virtual = V_D + p_gain * (P_D - P)
    command = A_D + gain * (virtual - V) + part - [0.3, 0.3, 0.2] * measured + 0.02 * V
    assert seen.acceleration_command == pytest.approx(command, abs=1e-12)
    assert seen.virtual_velocity == pytest.approx(virtual)
    assert seen.disturbance_estimate == pytest.approx(-part)
    assert next_memory.acceleration == pytest.approx(measured)
    assert next_memory.integral == pytest.approx(part + [1.5, 1.5, 0.5] * (virtual - V) * DT)
    assert answer.thrust == pytest.approx(thrust_of(command), rel=1e-12)
    # thrust along +lift in the frame of the measured heading; the setpoint's own yaw is the reference's
    tilted = Rotation.from_euler("ZYX", [ANGLES[2], answer.angles.y, answer.angles.x]).as_matrix()[:, 2]
    lift = command + GRAVITY
    assert tilted == pytest.approx(lift / np.linalg.norm(lift), abs=1e-12)
    assert answer.angles.z == YAW
    assert (answer.rates.z, answer.accelerations.z) == (0.05, -0.02)


def test_pid_knows_no_acceleration_at_its_first_step():
    parameters = build(pid.Parameters, WIDE | PID_GAINS)
    _, next_memory, _ = pid.step(parameters, VEHICLE, pid.init(parameters, VEHICLE), inputs(), DT)
    assert next_memory.acceleration == (0.0, 0.0, 0.0)
    assert next_memory.velocity == vec(V)


@pytest.mark.parametrize("case", ["free", "vehicle", "law", "speed", "off"])
def test_pid_integral_rests_while_a_limit_is_met(case):
    changes = {"law": {"limits.tilt": 0.05}, "speed": {"speed.max_xy": 0.05}, "off": {"anti_windup": False}}
    parameters = build(pid.Parameters, WIDE | PID_GAINS | changes.get(case, {}))
    actuation = Actuation(thrust_high=case in ("vehicle", "off"))
    start = pid.init(parameters, VEHICLE)
    _, next_memory, seen = pid.step(parameters, VEHICLE, start, inputs(actuation=actuation), DT)
    rests = case in ("vehicle", "law", "speed")
    assert seen.adaptation_frozen is rests
    assert (next_memory.integral == start.integral) is rests


def test_pid_integral_is_bounded():
    parameters = build(pid.Parameters, WIDE | PID_GAINS | {"xy.max_integral": 0.7, "z.max_integral": 0.2})
    memory = pid.init(parameters, VEHICLE)
    for _ in range(2000):
        _, memory, _ = pid.step(parameters, VEHICLE, memory, inputs(), DT)
    virtual = V_D + np.array([2.0, 2.0, 3.0]) * (P_D - P)
    assert memory.integral == pytest.approx(np.sign(virtual - V) * [0.7, 0.7, 0.2])


def lee_axes(lift, yaw):
    b3 = lift / np.linalg.norm(lift)
    b2 = np.cross(b3, [math.cos(yaw), math.sin(yaw), 0.0])
    b2 /= np.linalg.norm(b2)
    return np.column_stack([np.cross(b2, b3), b2, b3])


@pytest.mark.parametrize("seed", range(20))
def test_se3_desired_attitude_is_that_of_the_source(seed):
    draw = np.random.default_rng(seed)
    lift, yaw = draw.normal(size=3) * 4.0 + [0.0, 0.0, 9.0], draw.uniform(-3.1, 3.1)
    angles = se3.desired_attitude(vec(lift), float(yaw))
    flown = Rotation.from_euler("ZYX", angles[::-1]).as_matrix()
    assert flown == pytest.approx(lee_axes(lift, yaw), abs=1e-12)


def test_se3_desired_attitude_where_it_is_not_defined():
    assert se3.desired_attitude(Vec3(0.0, 0.0, 0.0), 0.3) == (0.0, 0.0, 0.3)
    assert se3.desired_attitude(Vec3(3.0 * math.cos(0.3), 3.0 * math.sin(0.3), 0.0), 0.3) == (0.0, 0.0, 0.3)


def test_se3_is_its_formula():
    gains = {"xy.position": 9.0, "xy.velocity": 4.0, "z.position": 12.0, "z.velocity": 5.0}
    parameters = build(se3.Parameters, WIDE | gains)
    answer, _, seen = se3.step(parameters, VEHICLE, se3.init(parameters, VEHICLE), inputs(), DT)
    command = -np.array([9.0, 9.0, 12.0]) * (P - P_D) - np.array([4.0, 4.0, 5.0]) * (V - V_D) + A_D + 0.02 * V
    lift = command + GRAVITY
    assert seen.acceleration_command == pytest.approx(command, abs=1e-12)
    assert answer.thrust == pytest.approx(thrust_of(command), rel=1e-12)
    q = answer.q_wb
    assert Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix() == pytest.approx(lee_axes(lift, YAW), abs=1e-12)


def lee_command(k_x, k_v):
    return -np.array(k_x) * (P - P_D) - np.array(k_v) * (V - V_D) + A_D + 0.02 * V


def is_flown_as_lee_says(answer, command):
    """Whether thrust and axes are those of the source for ``command`` in m/s^2."""
    q = answer.q_wb
    axes = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    return answer.thrust == pytest.approx(thrust_of(command), rel=1e-12) and axes == pytest.approx(
        lee_axes(command + GRAVITY, YAW), abs=1e-12
    )


@pytest.mark.parametrize("e_i", [[0.5, -0.4, 0.3], [-0.2, 0.1, 0.15]], ids=["saturated", "free"])
def test_geometric_pid_is_its_formula(e_i):
    names = ("position", "velocity", "integral", "mixing", "max_integral")
    gains = {f"xy.{name}": value for name, value in zip(names, (9.0, 4.0, 3.0, 1.5, 0.3), strict=True)}
    gains |= {f"z.{name}": value for name, value in zip(names, (12.0, 5.0, 4.0, 0.5, 0.2), strict=True)}
    parameters, e_i = build(geometric_pid.Parameters, WIDE | gains), np.array(e_i)
    answer, after, seen = geometric_pid.step(parameters, VEHICLE, geometric_pid.Memory(vec(e_i)), inputs(), DT)
    part = np.array([3.0, 3.0, 4.0]) * np.clip(e_i, [-0.3, -0.3, -0.2], [0.3, 0.3, 0.2])
    command = lee_command([9.0, 9.0, 12.0], [4.0, 4.0, 5.0]) - part
    assert seen.acceleration_command == pytest.approx(command, abs=1e-12)
    assert is_flown_as_lee_says(answer, command)
    assert seen.disturbance_estimate == pytest.approx(part)
    assert after.integral == pytest.approx(e_i + DT * (V - V_D + [1.5, 1.5, 0.5] * (P - P_D)))
    resting = inputs(actuation=Actuation(thrust_high=True))
    _, after, seen = geometric_pid.step(parameters, VEHICLE, geometric_pid.Memory(vec(e_i)), resting, DT)
    assert seen.adaptation_frozen
    assert after.integral == tuple(e_i)


AXIS_BEFORE = np.array([0.1, -0.2, 0.97])
V_BEFORE = V - [0.03, -0.02, 0.01]
GIVEN = 9.3
"""Body z axis and velocity of the last step, and the thrust in N that the rotors gave since."""


def explained():
    """What thrust, gravity and drag explain of the last step, m/s^2."""
    axis = 0.5 * (AXIS_BEFORE + Rotation.from_euler("ZYX", ANGLES[::-1]).as_matrix()[:, 2])
    return GIVEN / 0.8 * axis - GRAVITY - 0.02 * V


def test_indi_of_the_acceleration_is_its_formula():
    gains = {"xy.position": 9.0, "xy.velocity": 4.0, "z.position": 12.0, "z.velocity": 5.0, "bandwidth": 30.0}
    gains |= {"xy.acceleration": 0.5, "z.acceleration": 0.3}
    parameters = build(indi.Parameters, WIDE | gains)
    a1, a2 = np.array([1.0, -2.0, 0.5]), np.array([0.8, -1.5, 0.7])
    k1, k2 = np.array([0.6, -1.0, 0.4]), np.array([0.5, -1.2, 0.2])
    memory = indi.Memory(vec(V_BEFORE), vec(AXIS_BEFORE), TwoLags(vec(a1), vec(a2)), TwoLags(vec(k1), vec(k2)), True)
    answer, after, seen = indi.step(parameters, VEHICLE, memory, inputs(actuation=Actuation(thrust=GIVEN)), DT)
    gain = 1.0 - math.exp(-30.0 * DT)
    a1 = a1 + gain * (np.array([3.0, -2.0, 1.0]) - a1)
    k1 = k1 + gain * (explained() - k1)
    a2, k2 = a2 + gain * (a1 - a2), k2 + gain * (k1 - k2)
    command = lee_command([9.0, 9.0, 12.0], [4.0, 4.0, 5.0]) - [0.5, 0.5, 0.3] * (a2 - A_D) - (a2 - k2)
    assert seen.acceleration_command == pytest.approx(command, abs=1e-12)
    assert seen.disturbance_estimate == pytest.approx(a2 - k2, abs=1e-12)
    assert is_flown_as_lee_says(answer, command)
    assert after.acceleration == (pytest.approx(a1), pytest.approx(a2))
    assert after.explained == (pytest.approx(k1), pytest.approx(k2))


def test_l1_is_its_formula():
    gains = {"xy.position": 9.0, "xy.velocity": 4.0, "z.position": 12.0, "z.velocity": 5.0, "bandwidth": 15.0}
    parameters = build(l1.Parameters, WIDE | gains | {"predictor_pole": 4.0, "max_estimate": 2.0})
    predicted, miss = np.array([0.45, 0.74, -0.33]), np.array([0.02, -0.01, 0.03])
    estimate, compensated = np.array([0.5, -0.7, 0.9]), np.array([0.3, -0.4, 0.6])
    memory = l1.Memory(vec(predicted), vec(miss), vec(estimate), vec(compensated), vec(AXIS_BEFORE), True)
    answer, after, seen = l1.step(parameters, VEHICLE, memory, inputs(actuation=Actuation(thrust=GIVEN)), DT)
    predicted = predicted + DT * (explained() + estimate - 4.0 * miss)
    miss = predicted - V
    # -Phi^-1 mu with Phi = A^-1 (e^(A T) - 1), mu = e^(A T) miss, A = -4 1/s
    phi = (math.exp(-4.0 * DT) - 1.0) / -4.0
    raw = -math.exp(-4.0 * DT) * miss / phi
    estimate = np.clip(raw, -2.0, 2.0)
    assert list(estimate != raw) == [True, False, False]
    compensated = compensated + (1.0 - math.exp(-15.0 * DT)) * (estimate - compensated)
    command = lee_command([9.0, 9.0, 12.0], [4.0, 4.0, 5.0]) - compensated
    assert seen.acceleration_command == pytest.approx(command, abs=1e-12)
    assert is_flown_as_lee_says(answer, command)
    assert after.predicted == pytest.approx(predicted)
    assert after.miss == pytest.approx(miss)
    assert after.estimate == pytest.approx(estimate)
    assert after.compensated == pytest.approx(compensated)


@pytest.mark.parametrize("law", [indi, l1])
def test_a_steady_push_is_found(law):
    """Level, with the thrust of hover, the velocity grows as the push has it."""
    still = VEHICLE._replace(drag_coefficient=0.0)
    parameters, push = law.Parameters(), np.array([0.4, -0.3, 0.2])
    memory, hover = law.init(parameters, still), Actuation(thrust=still.mass * still.gravity)
    for k in range(300):
        moving = inputs(velocity=push * k * DT, angles=(0.0, 0.0, 0.0), actuation=hover)
        _, memory, seen = law.step(parameters, still, memory, moving, DT)
    assert seen.disturbance_estimate == pytest.approx(push, abs=0.02)


def test_proportional_correction_keeps_direction_and_speed():
    speed = SpeedLimits(max_xy=2.0, max_z=1.0, braking_xy=1e6, braking_z=1e6)
    near = proportional_correction(Vec3(0.3, -0.4, 0.1), 2.0, 3.0, speed)
    assert correction_vector(near) == pytest.approx((-0.6, 0.8, -0.3))
    assert not is_speed_limited(near)
    far = proportional_correction(Vec3(30.0, -40.0, -5.0), 2.0, 3.0, speed)
    assert correction_vector(far) == pytest.approx((-1.2, 1.6, 1.0))
    assert is_speed_limited(far)
    assert is_speed_limited(proportional_correction(Vec3(0.0, 0.0, -5.0), 2.0, 3.0, speed))
    assert is_speed_limited(proportional_correction(Vec3(5.0, 0.0, 0.0), 2.0, 3.0, speed))


def test_thrust_command_says_what_was_limited():
    limits = LiftLimits(acceleration_xy=1e6, acceleration_z=1e6, min_lift=-1e6, tilt=1.58, thrust=0.5, min_thrust=0.1)
    up, max_thrust = Vec3(0.0, 0.0, 1.0), VEHICLE.thrust_to_weight * VEHICLE.mass * VEHICLE.gravity
    near = proportional_correction(Vec3(), 1.0, 1.0, SpeedLimits())
    far = proportional_correction(Vec3(99.0, 0.0, 0.0), 1.0, 1.0, SpeedLimits())

    def commanded(z):
        return thrust_command(Vec3(0.0, 0.0, z), VEHICLE, limits, up, ThrustForm.PROJECTED)

    free = commanded(1.0)
    assert free.thrust == pytest.approx(VEHICLE.mass * (VEHICLE.gravity + 1.0))
    assert not integrals_frozen(True, near, free, Actuation())
    assert integrals_frozen(True, far, free, Actuation())
    assert integrals_frozen(True, near, free, Actuation(thrust_low=True))
    assert not integrals_frozen(False, far, free, Actuation(thrust_low=True))
    high, low = commanded(30.0), commanded(-9.0)
    assert high.thrust == pytest.approx(0.5 * max_thrust)
    assert low.thrust == pytest.approx(0.1 * max_thrust)
    assert high.thrust_limited
    assert low.thrust_limited
