"""The bounded virtual velocity against the motion it stands for, by hand and by difference quotients."""

import itertools
import math
import random

import pytest

from quad_position_ctrl.speed_limit import bounded_pair, speed_limit

GAIN, BRAKING = 2.0, 3.0


def test_near_the_reference_nothing_changes():
    # up to braking / gain = 1.5 m/s, that is 0.75 m away
    assert speed_limit(1.5, GAIN, BRAKING, 100.0) == (1.0, 1.0, False)
    assert speed_limit(0.0, GAIN, BRAKING, 100.0) == (1.0, 1.0, False)


def test_farther_out_the_speed_can_be_braked_with_the_deceleration():
    # 3 m away, of which 0.75 m are linear: v^2 = 1.5^2 + 2 * 3 * (3 - 0.75) = 15.75
    limit = speed_limit(6.0, GAIN, BRAKING, 100.0)
    assert limit.scale * 6.0 == pytest.approx(math.sqrt(15.75), rel=1e-15)
    assert limit.slope == pytest.approx(1.5 / math.sqrt(15.75), rel=1e-15)
    assert limit.limited


def test_speed_has_a_top():
    assert speed_limit(6.0, GAIN, BRAKING, 2.0) == (pytest.approx(1.0 / 3.0), 0.0, True)
    assert speed_limit(1.2, GAIN, BRAKING, 0.6) == (0.5, 0.0, True)


def test_flying_the_bounded_speed_decelerates_constantly():
    """Integrate d' = -v(d) from 10 m: the change of v over time is -braking until the linear part, 0.75 m away."""
    distance, dt = 10.0, 1e-4
    speeds = []
    while distance > 0.8:
        correction = GAIN * distance
        speeds.append(speed_limit(correction, GAIN, BRAKING, 100.0).scale * correction)
        distance -= speeds[-1] * dt
    decelerations = [(before - after) / dt for before, after in itertools.pairwise(speeds)]
    assert decelerations == pytest.approx([BRAKING] * len(decelerations), rel=1e-3)


def test_pair_is_shortened_in_its_direction():
    x, y = bounded_pair(3.0, 4.0, 0.0, 0.0, GAIN, BRAKING, 100.0)
    # length 5: bounded to sqrt(1.5 * (10 - 1.5))
    assert (x.velocity, y.velocity) == pytest.approx((0.6 * math.sqrt(12.75), 0.8 * math.sqrt(12.75)))
    assert x[2:] == y[2:] == (pytest.approx(math.sqrt(12.75) / 5.0), True)


def test_pair_within_the_bound_is_untouched():
    pair = bounded_pair(0.6, -0.8, 7.0, 8.0, GAIN, BRAKING, 100.0)
    assert pair == ((0.6, 7.0, 1.0, False), (-0.8, 8.0, 1.0, False))


@pytest.mark.parametrize("max_speed", [100.0, 4.0])
def test_rates_are_the_derivative_of_the_bounded_pair(max_speed):
    rng = random.Random(23)
    checked = 0
    for _ in range(200):
        x, y, rate_x, rate_y = (rng.uniform(-20.0, 20.0) for _ in range(4))
        h = 1e-6
        pair = bounded_pair(x, y, rate_x, rate_y, GAIN, BRAKING, max_speed)
        before, after = (
            bounded_pair(x + s * rate_x, y + s * rate_y, 0.0, 0.0, GAIN, BRAKING, max_speed) for s in (-h, h)
        )
        if before[0].limited != after[0].limited:
            continue
        checked += 1
        for axis, behind, ahead in zip(pair, before, after, strict=True):
            assert axis.rate == pytest.approx((ahead.velocity - behind.velocity) / (2.0 * h), rel=1e-5, abs=1e-5)
    assert checked > 180


def test_bound_is_continuous_where_its_pieces_meet():
    for edge in (1.5, (4.0 * 4.0 / 1.5 + 1.5) / 2.0):
        below, above = (speed_limit(edge + s, GAIN, BRAKING, 4.0).scale * (edge + s) for s in (-1e-9, 1e-9))
        assert above == pytest.approx(below, abs=1e-8)
