"""What SET_ATTITUDE_TARGET carries is what was asked for."""

import numpy as np
import pytest
from frames_oracle import ned_frd
from hypothesis import given
from hypothesis import strategies as st
from mavlink_without_link import bridge
from scipy.spatial.transform import Rotation

from quad_core.types import AttitudeThrust, Quat
from quad_mavlink.node import fraction
from quad_mavlink.parameters import MavlinkBridgeParameters

pytestmark = pytest.mark.unit
TM = 5.0
SETTINGS = MavlinkBridgeParameters(max_rotor_thrust=TM)
attitudes = st.builds(
    lambda x, y, z: Rotation.from_rotvec([x, y, z]), st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(-3, 3)
)


def asked(rotation, newtons):
    return AttitudeThrust(q_wb=Quat(*rotation.as_quat().tolist()), thrust=newtons)


def sent(setpoint):
    """Return type_mask, q, body rates and thrust of the message."""
    made = bridge(SETTINGS)
    made.send_attitude(setpoint)
    (found,) = made.sent
    return [found[4], found[5], found[6:9], found[9]]


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
