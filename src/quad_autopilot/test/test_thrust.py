"""From newtons to an autopilot's 0..1."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_autopilot import thrust
from quad_core.parameters import ParameterError
from quad_core.vehicle import Vehicle

shares = st.floats(0.05, 0.95)
curves = st.just(0.0) | st.floats(0.05, 1.0)


@given(shares, curves, curves)
def test_what_the_autopilot_undoes_is_the_curve_it_believes_in(share, believed, true):
    command = thrust.compensated(believed, true, share)
    u = command if believed == 0.0 else float(max(np.roots([believed, 1.0 - believed, -command]).real))
    assert true * u * u + (1.0 - true) * u == pytest.approx(share, abs=1e-6)


def test_a_curve_that_both_have_changes_nothing_and_another_does():
    assert thrust.compensated(0.3, 0.3, 0.5) == 0.5
    assert thrust.compensated(0.0, 0.6, 0.5) == pytest.approx((math.sqrt(0.16 + 1.2) - 0.4) / 1.2)


def test_a_thrust_that_was_not_given_names_its_key_and_the_page_of_its_bridge():
    thrust.require(0.1, "docs/how_to/crazyflie.md")
    with pytest.raises(ParameterError, match=r"^a\.b: found 0\.0, .*; docs/how_to/crazyflie\.md$"):
        thrust.require(0.0, "docs/how_to/crazyflie.md", "a.b")


def test_rotors_that_cannot_lift_it_are_named():
    vehicle = Vehicle(mass=2.0, gravity=10.0)
    assert thrust.weakness(vehicle, 5.3, "max_rotor_thrust") == ""
    assert "max_rotor_thrust: four rotors give 20.8 N" in thrust.weakness(vehicle, 5.2, "max_rotor_thrust")


def test_the_prediction_says_what_the_rotors_cannot_give():
    assert thrust.predicted(9.8, 5.0).thrust == pytest.approx(9.8)
    cut = thrust.predicted(25.0, 5.0)
    assert (cut.thrust, cut.thrust_high, cut.thrust_low) == (20.0, True, False)
    assert thrust.predicted(-1.0, 5.0).thrust_low
    assert sum(cut.rotor_thrust) == pytest.approx(20.0)
