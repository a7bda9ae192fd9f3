"""The command filter against the three poles it stands for, by formula and by SciPy."""

import math

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from quad_attitude_ctrl.command import (
    CommandFilter,
    CommandSource,
    FilterState,
    Shaping,
    filters_at_rest,
    next_filter_state,
    next_filters,
    next_target,
)
from quad_core.types import AttitudeThrust, Quat, Vec3

A = 8.0
REST = FilterState(0.0, 0.0, 0.0, 0.0)


def run(raws, dt, max_rate=1e6, start=REST):
    seen = [start]
    for raw in raws:
        seen.append(next_filter_state(seen[-1], raw, A, max_rate, dt))
    return seen[1:]


@pytest.mark.parametrize("dt", [0.002, 0.05, 1.0])
def test_step_response_of_three_equal_poles(dt):
    """1 - exp(-at) (1 + at + (at)^2 / 2), exact at any rate."""
    for k, command in enumerate(run([0.5] * 20, dt), start=1):
        at = A * k * dt
        fade = math.exp(-at)
        assert command.angle == pytest.approx(0.5 * (1.0 - fade * (1.0 + at + at * at / 2.0)), abs=1e-13)
        assert command.rate == pytest.approx(0.5 * A * fade * at * at / 2.0, abs=1e-12)
        assert command.acceleration == pytest.approx(0.5 * A * A * fade * (at - at * at / 2.0), abs=1e-11)


def test_held_random_input_against_scipy():
    rng = np.random.default_rng(41)
    raws = np.repeat(rng.uniform(-1.0, 1.0, 40), 5)
    matrix = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-(A**3), -3.0 * A * A, -3.0 * A]]
    system = StateSpace(matrix, [[0.0], [0.0], [A**3]], np.eye(3), np.zeros((3, 1)))
    dt = 0.01
    _, states, _ = lsim(system, np.append(raws, raws[-1]), np.arange(len(raws) + 1) * dt, interp=False)
    found = np.array([command[:3] for command in run(raws.tolist(), dt)])
    assert found == pytest.approx(states[1:], abs=1e-9)


def test_every_axis_is_filtered_with_its_own_bandwidth_and_rate():
    dt, steps, bandwidths = 0.01, 12, (6.0, 9.0, 14.0)
    shaping = Shaping(CommandSource.FILTER, *(CommandFilter(bandwidth, 1e6) for bandwidth in bandwidths))
    filters = filters_at_rest(Vec3())
    for _ in range(steps):
        filters = next_filters(shaping, filters, AttitudeThrust(Vec3(0.1, 0.2, 0.3)), dt)
    for command, bandwidth, goal in zip(filters, bandwidths, (0.1, 0.2, 0.3), strict=True):
        at = bandwidth * steps * dt
        assert command.angle == pytest.approx(goal * (1.0 - math.exp(-at) * (1.0 + at + at * at / 2.0)), abs=1e-13)
    rates = (0.5, 1.0, 2.0)
    shaping = Shaping(CommandSource.FILTER, *(CommandFilter(9.0, rate) for rate in rates))
    far = AttitudeThrust(Vec3(1.0, 1.0, 1.0))
    limited = next_filters(shaping, filters_at_rest(Vec3()), far, dt)
    assert [axis.target for axis in limited] == pytest.approx([rate * dt for rate in rates])


def test_target_goes_the_short_way_round():
    assert next_target(3.0, -3.0, 1e6, 0.1) == pytest.approx(2.0 * math.pi - 3.0)
    assert next_target(3.0, -3.0, 1.0, 0.1) == pytest.approx(3.1)


def test_limited_rate_and_acceleration_of_the_output():
    """A turn by pi and back: the rate stays within its limit, the acceleration within 4 exp(-2) max_rate a."""
    seen = run([3.1] * 700 + [0.0] * 700, 0.002, max_rate=1.5)
    assert max(abs(c.rate) for c in seen) == pytest.approx(1.5, rel=1e-2)
    assert max(abs(c.rate) for c in seen) <= 1.5 + 1e-9
    assert max(abs(c.acceleration) for c in seen) <= 4.0 * math.exp(-2.0) * 1.5 * A + 1e-9


def test_output_is_continuous_over_the_seam():
    """Turning through pi: angle and target jump by a whole turn together, the rate does not notice."""
    steady = FilterState(3.0 - 3.0 * 1.0 / A, 1.0, 0.0, 3.0)
    raws = [3.0 + 0.01 * k for k in range(1, 60)]
    seen = run(raws, 0.01, start=steady)
    for k, command in enumerate(seen, start=1):
        assert command.rate == pytest.approx(1.0, abs=0.02)
        gap = command.angle - (3.0 - 3.0 / A + 0.01 * k)
        assert gap - 2.0 * math.pi * round(gap / (2.0 * math.pi)) == pytest.approx(0.0, abs=0.02)
        assert -math.pi < command.target <= math.pi
    assert seen[-1].angle < 0.0


def test_a_led_filter_follows_the_angle_whose_derivatives_it_is_given():
    bandwidth, step, speed = 40.0, 0.002, 3.0
    axis = CommandFilter(bandwidth=bandwidth, max_rate=1e6)
    errors = {}
    for source in (CommandSource.FILTER.value, CommandSource.LED.value):
        filters = filters_at_rest(Vec3(0.0, 0.0, 0.0))
        worst = 0.0
        for k in range(2000):
            t = k * step
            angle, rate, acceleration = (
                0.4 * math.sin(speed * t),
                0.4 * speed * math.cos(speed * t),
                -0.4 * speed * speed * math.sin(speed * t),
            )
            if k > 500:
                worst = max(worst, abs(filters.roll.angle - angle))
            setpoint = AttitudeThrust(
                Vec3(angle, 0.0, 0.0), Vec3(rate, 0.0, 0.0), Vec3(acceleration, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0)
            )
            filters = next_filters(Shaping(source, axis, axis, axis), filters, setpoint, step)
        errors[source] = worst
    # 3/b of the rate is what three equal poles are behind
    assert errors[CommandSource.FILTER] == pytest.approx(0.4 * speed * 3.0 / bandwidth, rel=0.05)
    # one step of the rate, and the third derivative over b^3
    assert errors[CommandSource.LED] < 0.4 * speed * step * 1.5
