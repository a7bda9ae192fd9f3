"""What the controllers see of the truth: nothing changed by default, stated noise, exact delay, faults."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import welch
from scipy.spatial.transform import Rotation

from quad_core.types import Quat, SensorFault, Vec3, VehicleState
from quad_dynamics import sensor
from quad_dynamics.sensor import Parameters

FINE = SensorFault()
PERIOD = 2_000_000
TILTED = Rotation.from_euler("ZYX", [0.7, -0.3, 0.4])
HERE = VehicleState(Vec3(1.0, -2.0, 3.0), Vec3(0.5, 0.25, -1.0), Quat(*TILTED.as_quat()), Vec3(0.1, -0.2, 0.3))
NOISY = Parameters(position_noise=0.01, velocity_noise=0.02, attitude_noise=0.0035, rate_noise=0.0087, delay=0.004)


def seen(parameters, truths, seed=1, faults=None, period=PERIOD, step=sensor.step):
    table = sensor.draw(parameters, seed, len(truths))
    (line, memory), readings = sensor.init(parameters, period), []
    for k, truth in enumerate(truths):
        reading, memory = step(parameters, table, line, memory, truth, faults[k] if faults else FINE, k)
        readings.append(reading)
    return readings


def moving(count):
    return [HERE._replace(p_w=Vec3(float(k), 0.0, 0.0)) for k in range(count)]


def test_by_default_the_state_is_the_truth_itself():
    truths = moving(20)
    assert all(reading is truth for reading, truth in zip(seen(Parameters(), truths), truths, strict=True))


@pytest.mark.parametrize(("period", "every"), [(2_000_000, 1), (1_000_000, 4)])
def test_noise_has_its_standard_deviation_and_its_density_at_two_step_sizes(period, every):
    count = 40_000
    parameters = Parameters(
        period_steps=every, position_noise=0.01, velocity_noise=0.02, attitude_noise=0.0035, rate_noise=0.0087
    )
    readings = seen(parameters, [HERE] * count, seed=4, period=period)
    p, v, rates = (np.array([getattr(r, name) for r in readings]) for name in ("p_w", "v_w", "omega_b"))
    turned = (TILTED.inv() * Rotation.from_quat([r.q_wb for r in readings])).as_rotvec()
    samples = count // every
    for values, truth, sd in (
        (p, HERE.p_w, 0.01),
        (v, HERE.v_w, 0.02),
        (turned, (0.0, 0.0, 0.0), 0.0035),
        (rates, HERE.omega_b, 0.0087),
    ):
        assert values.std(axis=0) == pytest.approx([sd] * 3, rel=4.0 / np.sqrt(2 * samples))
        assert values.mean(axis=0) == pytest.approx(truth, abs=4.0 * sd / np.sqrt(samples))
    # no number of any channel knows of another's
    together = np.hstack([p, v, turned, rates])[::every]
    assert np.abs(np.corrcoef(together.T) - np.eye(12)).max() < 4.5 / np.sqrt(samples)
    # far below the rate of sampling a held white sequence has the one-sided density sd^2 2 T
    spacing = every * period * 1e-9
    frequencies, density = welch(p[:, 0], fs=1e9 / period, nperseg=2000)
    low = density[(frequencies > 0.0) & (frequencies < 0.08 / spacing)]
    assert low.mean() == pytest.approx(0.01**2 * 2.0 * spacing, rel=0.12)


def test_a_longer_table_begins_like_a_shorter_one():
    short, long = (sensor.draw(NOISY, 3, steps) for steps in (100, 1000))
    assert np.array_equal(short, long[: len(short)])
    assert not np.array_equal(short, sensor.draw(NOISY, 4, 100))


@pytest.mark.parametrize(("delay", "steps"), [(0.01, 5), (0.0109, 5), (0.0111, 6), (1.0, 500)])
def test_delay_is_that_many_steps_exactly(delay, steps):
    truths = moving(1200)
    readings = seen(Parameters(delay=delay), truths)
    assert [r.p_w.x for r in readings] == [float(max(k - steps, 0)) for k in range(1200)]


@pytest.mark.parametrize("period", [PERIOD, 3_000_000])
def test_a_delay_that_is_no_whole_step_is_told_as_it_is_flown(period):
    delays = {"position_delay": 0.045, "velocity_delay": 0.0051, "attitude_delay": 0.0, "rate_delay": 0.02}
    reading = seen(Parameters(**delays), moving(100), period=period)[-1]
    flown = 99.0 - reading.p_w.x
    assert reading.position_age == pytest.approx(flown * period * 1e-9, abs=1e-12)
    told = (reading.velocity_age, reading.attitude_age, reading.rate_age)
    assert told == pytest.approx((0.006, 0.0, 0.02 if period == PERIOD else 0.021), abs=1e-12)
    for error in (0.004, -0.01):
        wrong = seen(Parameters(**delays, age_error=error), moving(100), period=period)[-1]
        assert wrong[:4] == reading[:4]
        assert wrong[4:8] == pytest.approx([max(0.0, age + error) for age in reading[4:8]], abs=1e-12)


def turning(count):
    """Return states of which every number tells its plant step."""
    turns = Rotation.from_euler("ZYX", [[1e-3 * k, 2e-3 * k, 0.1] for k in range(count)]).as_quat()
    return [
        VehicleState(Vec3(k, 2.0 * k, 3.0 * k), Vec3(4.0 * k, 5.0 * k, 6.0 * k), Quat(*turns[k]), Vec3(7.0 * k, k, k))
        for k in range(count)
    ]


PERIODS = st.integers(1, 7)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 60), st.tuples(*[st.integers(0, 200)] * 4), st.tuples(*[st.integers(1, 30)] * 3), PERIODS)
def test_every_channel_is_the_truth_of_its_own_age_and_rate(common, extra, every, period):
    truths = turning(300)
    named = dict(zip(("position", "velocity", "attitude", "rate"), extra, strict=True))
    delays = {f"{name}_delay": 0.002 * steps for name, steps in named.items()}
    held = dict(zip(("position_every", "attitude_every", "rate_every"), every, strict=True))
    readings = seen(Parameters(delay=0.002 * common, period_steps=period, **delays, **held), truths)
    channels = (("p_w", extra[0], every[0]), ("v_w", extra[1], every[0]), ("q_wb", extra[2], every[1]))
    for name, age, share in (*channels, ("omega_b", extra[3], every[2])):
        taken = np.maximum(np.arange(300) - common - age, 0)
        newest = taken - taken % (period * share)
        truth = np.array([getattr(one, name) for one in truths])
        assert np.array_equal(np.array([getattr(one, name) for one in readings]), truth[newest]), name


def test_a_channel_that_is_too_late_is_named():
    with pytest.raises(ValueError, match="delay and velocity_delay: found 550 plant steps, expected at most 511"):
        sensor.init(Parameters(delay=0.1, velocity_delay=1.0), PERIOD)


def test_each_sample_has_a_noise_of_its_own():
    readings = seen(Parameters(period_steps=4, position_noise=1.0), [HERE] * 9)
    assert len({readings[k].p_w for k in range(9)}) == 3
    assert [readings[k] == readings[k - k % 4] for k in range(9)] == [True] * 9


def test_the_noise_of_the_first_sample_is_not_the_bias_again():
    biased, noisy = (seen(Parameters(**{name: 1.0}), [HERE])[0] for name in ("position_bias", "position_noise"))
    assert np.abs(np.subtract(biased.p_w, noisy.p_w)).min() > 1e-6


def test_what_is_delayed_is_the_reading_with_its_noise():
    noise = {"position_noise": 0.1, "period_steps": 2}
    late, prompt = (seen(Parameters(delay=delay, **noise), moving(40)) for delay in (0.01, 0.0))
    assert [state[:4] for state in late[5:]] == [state[:4] for state in prompt[:-5]]
    assert {state[4:8] for state in late} == {(0.01,) * 4}
    assert {state[4:8] for state in prompt} == {(0.0,) * 4}


def test_a_bias_stays_for_a_flight_and_differs_between_flights():
    parameters = Parameters(position_bias=0.5, attitude_bias=0.02, rate_bias=0.1, velocity_bias=0.3)
    readings = seen(parameters, [HERE] * 5)
    assert all(reading == readings[0] for reading in readings)
    biases = [np.subtract(seen(parameters, [HERE], seed)[0].p_w, HERE.p_w) for seed in range(400)]
    assert np.std(biases, axis=0) == pytest.approx([0.5] * 3, rel=4.0 / np.sqrt(800))


def test_frozen_sensors_repeat_the_reading_of_the_first_frozen_step():
    faults = [SensorFault(frozen=3 <= k < 6) for k in range(9)]
    readings = seen(Parameters(), moving(9), faults=faults)
    assert [r.p_w.x for r in readings] == [0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 6.0, 7.0, 8.0]


def test_a_jump_is_not_seen_while_the_sensors_are_frozen():
    faults = [SensorFault(frozen=k >= 1, offset_w=Vec3(1.0, 0.0, 0.0) if k >= 2 else Vec3()) for k in range(5)]
    readings = seen(Parameters(), moving(5), faults=faults)
    assert [r.p_w.x for r in readings] == [0.0, 1.0, 1.0, 1.0, 1.0]
