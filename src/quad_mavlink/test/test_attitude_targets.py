"""What SET_ATTITUDE_TARGET carries is what was asked for; of each planted mistake it is not."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from frames_oracle import ned_frd
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_autopilot.autopilot import Stamps
from quad_core.types import AttitudeThrust, Quat
from quad_mavlink.parameters import MavlinkBridgeParameters
from quad_mavlink.vehicle import MavlinkVehicle, fraction

TM = 5.0
SETTINGS = MavlinkBridgeParameters(max_rotor_thrust=TM)
attitudes = st.builds(
    lambda x, y, z: Rotation.from_rotvec([x, y, z]), st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(-3, 3)
)


def asked(rotation, newtons):
    return AttitudeThrust(q_wb=Quat(*rotation.as_quat().tolist()), thrust=newtons)


def sent(setpoint):
    """Return type_mask, q, body rates and thrust of the message."""
    found = []
    pack = SimpleNamespace(MAVLink_set_attitude_target_message=lambda *fields: fields)
    MavlinkVehicle(SimpleNamespace(mavlink=pack, send=found.append), SETTINGS).fly(setpoint, Stamps())
    return [found[0][3], found[0][4], found[0][5:8], found[0][8]]


def obeyed(q, thrust):
    """Return the attitude (FRD in NED) and the thrust in N that an autopilot makes of a target."""
    w, x, y, z = q
    return Rotation.from_quat([x, y, z, w]), 4.0 * TM * thrust


@given(attitudes, st.floats(0.0, 20.0))
def test_attitude_and_thrust_arrive_and_rates_are_ignored(rotation, newtons):
    mask, q, rates, thrust = sent(asked(rotation, newtons))
    found, made = obeyed(q, thrust)
    assert (found.inv() * ned_frd(rotation.as_quat())).magnitude() == pytest.approx(0.0, abs=1e-7)
    assert made == pytest.approx(newtons)
    assert (mask, rates) == (0b111, (0.0, 0.0, 0.0))


MISTAKES = {
    "quaternion as xyzw": lambda q, u: ((q[1], q[2], q[3], q[0]), u),
    "FLU in ENU sent as it is": lambda q, u: ((0.9, 0.1, -0.2, math.sqrt(1 - 0.86)), u),
    "conjugate": lambda q, u: ((q[0], -q[1], -q[2], -q[3]), u),
    "N instead of normalised": lambda q, u: (q, u * 4.0 * TM),
    "one rotor's thrust for four": lambda q, u: (q, u * 4.0),
    "thrust down": lambda q, u: (q, -u),
}


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_each_planted_mistake_is_seen(mistake):
    rotation = Rotation.from_quat([0.1, -0.2, math.sqrt(1 - 0.86), 0.9])
    _, q, _, thrust = sent(asked(rotation, 9.8))
    found, made = obeyed(*mistake(q, thrust))
    angle = (found.inv() * ned_frd(rotation.as_quat())).magnitude()
    assert max(angle, abs(made - 9.8) / 9.8) > 0.2


@given(attitudes)
def test_where_the_autopilot_divides_by_the_tilt_the_thrust_is_right_all_the_same(rotation):
    upright = rotation.as_matrix()[2, 2]
    boosted = fraction(SETTINGS, asked(rotation, 7.0), True) / min(max(upright, 0.1), 1.0)
    assert 4.0 * TM * boosted == pytest.approx(7.0 if upright > 0.1 else 4.0 * TM * boosted)


@given(st.floats(0.05, 0.95), st.floats(0.05, 1.0), st.floats(0.05, 1.0))
def test_the_motors_give_the_thrust_whatever_curve_the_autopilot_believes_in(share, believed, true):
    settings = SETTINGS._replace(autopilot_curve=believed, thrust_curve=true)
    command = fraction(settings, asked(Rotation.identity(), share * 4.0 * TM), False)
    u = float(max(np.roots([believed, 1.0 - believed, -command]).real))
    assert true * u * u + (1.0 - true) * u == pytest.approx(share, abs=1e-9)
