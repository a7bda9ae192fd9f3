"""What SET_ATTITUDE_TARGET carries is what was asked for; of each planted mistake it is not."""

import math

import numpy as np
import pytest
from frames_oracle import BODY, ned_frd
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_core.types import AttitudeThrust, Quat, Vec3, VehicleState
from quad_mavlink import setpoints
from quad_mavlink.parameters import MavlinkBridgeParameters, MavlinkMode

TM = 5.0
SETTINGS = MavlinkBridgeParameters(max_rotor_thrust=TM)
RATES = SETTINGS._replace(mode=MavlinkMode.RATES.value, rate_gain=2.0, rate_limit=50.0)
attitudes = st.builds(
    lambda x, y, z: Rotation.from_rotvec([x, y, z]), st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(-3, 3)
)


def quaternion(rotation):
    return Quat(*rotation.as_quat().tolist())


def at(rotation):
    return VehicleState(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), quaternion(rotation), Vec3(0.0, 0.0, 0.0))


def obeyed(target):
    """Return the attitude (FLU in ENU) and the thrust in N that an autopilot makes of a target."""
    w, x, y, z = target.q
    return Rotation.from_quat([x, y, z, w]), 4.0 * TM * target.thrust


@given(attitudes, st.floats(0.0, 20.0))
def test_attitude_and_thrust_arrive_and_rates_are_ignored(rotation, newtons):
    setpoint = AttitudeThrust(q_wb=quaternion(rotation), thrust=newtons)
    target = setpoints.target(SETTINGS, setpoint, at(Rotation.identity()), False)
    found, thrust = obeyed(target)
    assert (found.inv() * ned_frd(rotation.as_quat())).magnitude() == pytest.approx(0.0, abs=1e-7)
    assert thrust == pytest.approx(newtons)
    assert (target.type_mask, target.rates) == (0b111, (0.0, 0.0, 0.0))


@given(attitudes, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_rates_turn_towards_the_setpoint_in_frd_and_the_attitude_is_ignored(rotation, x, y, z):
    desired = rotation * Rotation.from_rotvec([x, y, z])
    target = setpoints.target(RATES, AttitudeThrust(q_wb=quaternion(desired), thrust=9.8), at(rotation), False)
    angle = np.linalg.norm([x, y, z])
    expected = BODY @ np.array([x, y, z]) * (4.0 * math.sin(angle / 2) / angle if angle else 0.0)
    assert np.array(target.rates) == pytest.approx(expected, abs=1e-9)
    assert target.type_mask == 0b1000_0000
    assert math.hypot(*target.q) == pytest.approx(1.0)


MISTAKES = {
    "quaternion as xyzw": lambda t: t._replace(q=(t.q[1], t.q[2], t.q[3], t.q[0])),
    "FLU in ENU sent as it is": lambda t: t._replace(q=(0.9, 0.1, -0.2, math.sqrt(1 - 0.86))),
    "conjugate": lambda t: t._replace(q=(t.q[0], -t.q[1], -t.q[2], -t.q[3])),
    "N instead of normalised": lambda t: t._replace(thrust=t.thrust * 4.0 * TM),
    "one rotor's thrust for four": lambda t: t._replace(thrust=t.thrust * 4.0),
    "thrust down": lambda t: t._replace(thrust=-t.thrust),
}


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_each_planted_mistake_is_seen(mistake):
    rotation = Rotation.from_quat([0.1, -0.2, math.sqrt(1 - 0.86), 0.9])
    right = setpoints.target(
        SETTINGS, AttitudeThrust(q_wb=quaternion(rotation), thrust=9.8), at(Rotation.identity()), False
    )
    found, thrust = obeyed(mistake(right))
    angle = (found.inv() * ned_frd(rotation.as_quat())).magnitude()
    assert max(angle, abs(thrust - 9.8) / 9.8) > 0.2


@given(attitudes, st.sampled_from([SETTINGS, RATES]))
def test_where_the_autopilot_divides_by_the_tilt_the_thrust_is_right_all_the_same(rotation, settings):
    setpoint = AttitudeThrust(q_wb=quaternion(rotation), thrust=7.0)
    target = setpoints.target(settings, setpoint, at(rotation), True)
    boosted = target.thrust / min(max(rotation.as_matrix()[2, 2], 0.1), 1.0)
    assert 4.0 * TM * boosted == pytest.approx(7.0 if rotation.as_matrix()[2, 2] > 0.1 else 4.0 * TM * boosted)


@given(st.floats(0.05, 0.95), st.floats(0.05, 1.0), st.floats(0.05, 1.0))
def test_the_motors_give_the_thrust_whatever_curve_the_autopilot_believes_in(share, believed, true):
    settings = SETTINGS._replace(autopilot_curve=believed, thrust_curve=true)
    command = setpoints.fraction(settings, share * 4.0 * TM)
    u = float(max(np.roots([believed, 1.0 - believed, -command]).real))
    assert true * u * u + (1.0 - true) * u == pytest.approx(share, abs=1e-9)
