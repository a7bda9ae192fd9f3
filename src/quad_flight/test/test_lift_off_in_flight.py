"""A flight that begins on the ground: straight up, level and without memory until the vehicle is clear of it."""

import numpy as np
import pytest

from quad_flight.flight import fly, from_names

STANDS = 0.099
GROUND = ["simulator.rigid_body.ground.enabled=true", f"simulator.rigid_body.initial.p.z={STANDS}"]


def tilt(q):
    """Return the angle in deg between body z and the vertical of quaternions (n, 4)."""
    return np.degrees(np.arccos(np.clip(1.0 - 2.0 * (q[:, 0] ** 2 + q[:, 1] ** 2), -1.0, 1.0)))


@pytest.fixture(scope="module")
def flown():
    """Return a hover from the ground in the paper's disturbance."""
    return fly(from_names("hover", duration=2.0, settings=GROUND)).topics


def test_it_is_level_until_it_is_clear(flown):
    state, truth = flown["state"], flown["truth"]
    clear = np.flatnonzero(~state["on_ground"])[0]
    assert state["on_ground"][:clear].all()
    assert not state["on_ground"][clear:].any()
    assert (state["ground_z"] == STANDS).all()
    assert state["p_w"][clear, 2] - STANDS == pytest.approx(0.7, abs=0.01)
    assert tilt(truth["q_wb"][:clear]).max() < 2.0
    # and comes back from where the wind took it without a lurch
    assert tilt(truth["q_wb"]).max() < 40.0
    assert np.linalg.norm(truth["p_w"][-1] - flown["reference"]["p_w"][-1]) < 0.05


def test_setpoint_and_memory_rest_meanwhile(flown):
    clear = np.flatnonzero(~flown["state"]["on_ground"])[0] * 2_000_000
    before = flown["position_controller/internals"]["stamp_ns"] < clear
    assert np.ptp(flown["position_controller/internals"]["error_integral"][before], axis=0) == pytest.approx(0.0, abs=0)
    angles = flown["attitude_setpoint"]["angles"][flown["attitude_setpoint"]["stamp_ns"] < clear]
    assert np.degrees(np.abs(angles[:, :2])).max() < 0.5


def test_the_reference_begins_where_the_vehicle_stands_and_rises_alone(flown):
    reference = flown["reference"]
    lift = reference[reference["p_w"][:, 2] < STANDS + 1.49]
    lift = lift[lift["stamp_ns"] < 3e9]
    assert reference["p_w"][0] == pytest.approx([0.0, 0.0, STANDS])
    assert np.abs(lift["p_w"][:, :2]).max() == 0.0
    assert (np.diff(lift["p_w"][:, 2]) >= 0.0).all()


def test_in_the_air_nothing_is_marked():
    state = fly(from_names("hover", duration=0.5)).topics["state"]
    assert not state["on_ground"].any()
    assert (state["ground_z"] == 0.0).all()


def test_a_flight_above_a_ground_begins_in_the_air():
    high = [GROUND[0], "simulator.rigid_body.initial.p.z=2.0"]
    assert not fly(from_names("hover", duration=0.5, settings=high)).topics["state"]["on_ground"].any()
