"""The hand on the bench: right side down, nose down, a turn to the left, with rates and speeds that fit."""

import itertools
import math

import numpy as np
from scipy.spatial.transform import Rotation

from quad_core.types import NO_SENSOR_FAULT, VehicleState
from quad_dynamics import hand

PERIOD, DT = 2_000_000, 0.002


def shown():
    parameters = hand.Parameters()
    line, memory = hand.init(parameters, PERIOD)
    table = hand.draw(parameters, 1, 12_000)
    return [hand.step(parameters, table, line, memory, VehicleState(), NO_SENSOR_FAULT, k)[0] for k in range(12_000)]


def test_each_tilt_has_its_direction_and_its_rates():
    states = shown()
    turned = Rotation.from_quat([state.q_wb for state in states])
    rates = np.array([state.omega_b for state in states])
    found = (turned[:-1].inv() * turned[1:]).as_rotvec() / DT
    assert np.abs(found - rates[:-1]).max() < 0.01
    angles = np.degrees(turned.as_euler("xyz"))
    tops = angles.argmax(axis=0)
    assert list(tops) == sorted(tops)
    assert np.allclose(angles.max(axis=0), math.degrees(0.35), atol=0.01)
    assert angles.min() > -0.01
    height, speed = (np.array([getattr(state, name).z for state in states]) for name in ("p_w", "v_w"))
    assert np.abs(np.diff(height) / DT - speed[:-1]).max() < 0.05
    assert (height[0], height[-1]) == (0.0, 0.0)
    assert 0.49 < height.max() < 0.51


def test_what_is_lifted_never_repeats_itself():
    states = shown()[2100:9000]
    assert all(one.p_w != other.p_w for one, other in itertools.pairwise(states))
