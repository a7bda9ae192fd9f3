"""Whether the spacing of PX4's states fits what the controllers compute with."""

import pytest

from quad_autopilot.spacing import age_report, misfit

MS = 1_000_000
PX4 = [8 * MS, 12 * MS] * 50


def test_the_pair_that_flew_fits_and_the_one_that_tumbled_is_refused_with_its_numbers():
    assert misfit(4 * MS, {"attitude_controller": 2, "position_controller": 5}, PX4) == ""
    text = misfit(2 * MS, {"attitude_controller": 1, "position_controller": 5}, PX4)
    assert "8 ms to 12 ms" in text
    assert "attitude_controller" in text
    assert "1 x 2 ms = 2 ms" in text


def test_too_few_states_say_nothing():
    assert "10 states so far" in misfit(4 * MS, {}, [8 * MS] * 10)


def test_two_states_in_one_period_are_refused():
    assert "at most one state" in misfit(10 * MS, {"attitude_controller": 1}, PX4)


def test_one_lost_state_is_no_other_rate():
    assert misfit(4 * MS, {"attitude_controller": 2}, [*PX4, *[20 * MS] * 8]) == ""
    assert misfit(4 * MS, {"attitude_controller": 2}, [20 * MS] * 50) != ""


@pytest.mark.parametrize("steps", range(1, 12))
def test_what_is_said_is_what_a_controller_would_compute(steps):
    # a controller answers the first state that is at least its period after the last
    longest, last, now = 0, 0, 0
    for gap in [8, 8, 12, 12, 8, 12] * 60:
        now += gap
        if now - last >= 4 * steps:
            longest, last = max(longest, now - last), now
    fits = misfit(4 * MS, {"attitude_controller": steps}, PX4) == ""
    assert fits <= (longest <= 8 * steps)
    if steps in (1, 2, 4):
        assert fits == (longest <= 8 * steps)


def test_the_age_of_states_is_their_middle_and_what_one_in_ten_exceeds():
    text = age_report([3 * MS] * 80 + [7 * MS] * 15 + [40 * MS] * 5, "ODOMETRY")
    assert text.startswith("ODOMETRY: states are 3 ms old when they are sent (one in ten over 7 ms)")
    assert "states are 0 ms old" in age_report([], "ODOMETRY")
