"""No motor stops in the air: contact needs a low height and a state that changes, whatever pushes, freezes or jumps."""

import pytest
from commanded_flights import PERFECT, hovering, landed

from quad_core.enumerations import GuardMode, Mode
from quad_core.types import Conditions, SensorFault, Vec3

pytestmark = pytest.mark.unit

LOW = 0.3  # m
STEPS = 500  # a second


@pytest.fixture(scope="module")
def hover():
    return hovering(2.0, settled=1.0)


def test_a_landing_in_calm_air_ends_on_the_ground(hover):
    flight = landed(hover.fork())
    assert flight.mode == Mode.DISARMED
    ((height, speed, tilt),) = flight.disarmed
    assert abs(height) < 0.01
    assert (speed < 0.1, tilt < 0.01) == (True, True)


@pytest.mark.parametrize(
    "acts",
    [Conditions(force_w=Vec3(0.5, 0.0, 4.0)), Conditions(wind_w=Vec3(0.0, 2.0, 5.0))],
    ids=["push of 4 N upward", "rising wind"],
)
def test_neither_wind_nor_a_push_upward_is_contact(hover, acts):
    flight = landed(hover.fork(acts=lambda k: acts), longest=15.0)
    assert all(height <= LOW for height, _, _ in flight.disarmed)
    assert flight.memory.mode != GuardMode.KILL


@pytest.mark.parametrize("after", [0.0, 2.0])
@pytest.mark.parametrize("lasts", [0.8, 100.0])
def test_a_state_that_freezes_in_a_landing_is_no_contact(hover, after, lasts):
    begin = hover.k + round(after * STEPS)
    end = begin + round(lasts * STEPS)
    flight = landed(hover.fork(fault=lambda k: SensorFault(frozen=True) if begin <= k < end else PERFECT), longest=15.0)
    assert all(height <= LOW for height, _, _ in flight.disarmed)
    # frozen for good nothing is known any more: the guard comes down blind and stops the motors
    assert flight.mode == (Mode.DISARMED if lasts < 1.0 else Mode.KILL)
    assert flight.truth.p_w.z < LOW


@pytest.mark.parametrize("jump", [-3.0, -0.5, 0.9])
def test_an_estimate_that_jumps_in_height_is_no_contact(hover, jump):
    begin = hover.k + STEPS
    jumped = SensorFault(offset_w=Vec3(0.0, 0.0, jump))
    flight = landed(hover.fork(fault=lambda k: jumped if k >= begin else PERFECT), longest=12.0)
    assert all(height <= LOW for height, _, _ in flight.disarmed)
    # one that believes to be higher stands on the ground, its motors idling, until it is disarmed by hand
    assert flight.mode == (Mode.DESCEND if jump > LOW else Mode.DISARMED)
    assert flight.truth.p_w.z < 0.01
