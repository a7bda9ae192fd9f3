"""Metrics against numbers worked out by hand, or by another way than the code's own."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_flight_log import arrays, estimates, metrics

SECOND = 1_000_000_000


def table(stamps, **columns):
    count = len(stamps)
    forms = [("stamp_ns", np.int64)]
    for name, values in columns.items():
        forms.append((name, np.asarray(values).dtype, np.asarray(values).shape[1:]))
    out = np.zeros(count, forms)
    out["stamp_ns"] = stamps
    for name, values in columns.items():
        out[name] = values
    return out


def seconds(*times):
    return [round(time * SECOND) for time in times]


def test_a_flight_of_four_references_by_hand():
    # Errors 3-4-0 = 5 m during the approach (not counted), then 0.3, 0.4, 0 and 0.05 m, half a second apart.
    stamps = seconds(0.0, 0.5, 1.0, 1.5, 2.0)
    reference = table(stamps, p_w=np.zeros((5, 3)), trajectory_time=[-0.5, 0.0, 0.5, 1.0, 1.5])
    position = [[3.0, 4.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.0, 0.03, 0.04]]
    truth = table(stamps, p_w=position, q_wb=[[0.0, 0.0, 0.0, 1.0]] * 5)
    found = metrics.flight_metrics({"reference": reference, "truth": truth})
    assert found.duration == 1.5
    assert found.position_rmse == pytest.approx(math.sqrt((0.09 + 0.16 + 0.0 + 0.0025) / 4), rel=1e-12)
    assert found.position_max == pytest.approx(0.4)
    assert found.position_final == pytest.approx(0.05)
    assert found.position_iae == pytest.approx(0.5 * (0.35 + 0.2 + 0.025))
    assert found.position_itae == pytest.approx(0.5 * ((0.0 + 0.2) / 2 + (0.2 + 0.0) / 2 + (0.0 + 0.075) / 2))
    assert found.settling_time == 1.0
    assert found.attitude_rmse is None
    assert found.torque_effort is None


def test_commands_by_hand():
    stamps = seconds(0.0, 0.1, 0.2, 0.3)
    reference = table(seconds(0.0, 0.3), p_w=np.zeros((2, 3)), trajectory_time=[0.0, 0.3])
    wrench = table(
        stamps, thrust=[1.0, 2.0, 2.0, 0.0], torque_b=[[0.1, 0.0, 0.0], [-0.1, 0.0, 0.2], [0.1, 0.0, 0.2], [0.1, 0, 0]]
    )
    flags = {f"{name}_limited": [False] * 4 for name in ("roll", "pitch")} | {"thrust_low": [False] * 4}
    actuation = table(
        stamps, **{**flags, "thrust_high": [True, False, False, False], "yaw_limited": [True, True, 0, 0]}
    )
    found = metrics.flight_metrics({"reference": reference, "wrench_setpoint": wrench, "actuation": actuation})
    assert found.thrust_effort == pytest.approx(0.1 * (1.0 + 4.0 + 4.0 + 0.0))
    assert found.torque_effort == pytest.approx(0.1 * (0.01 + 0.05 + 0.05 + 0.01))
    assert found.torque_total_variation == pytest.approx((0.2 + 0.2) + 0.2 + 0.2)
    assert found.saturation_time == pytest.approx(0.2)
    assert found.chattering_index == 0.0


def test_the_chattering_index_is_the_share_of_a_fast_sine():
    # 2 N m at 5 Hz and 1 N m at 40 Hz over a whole second: energies 4/2 and 1/2, the mean of 7 N m does not count.
    time = np.arange(500) * 0.002
    slow, fast = 2.0 * np.sin(2 * np.pi * 5 * time), np.sin(2 * np.pi * 40 * time)
    torque = np.stack([slow + fast + 7.0, 0 * time, 0 * time], axis=1)
    high, whole = metrics.band_energy(torque, 0.002)
    assert high == pytest.approx(0.5, rel=1e-9)
    assert whole == pytest.approx(2.5, rel=1e-9)
    assert whole == pytest.approx(0.002 * np.sum((torque - torque.mean(axis=0)) ** 2), rel=1e-9)
    odd, odd_whole = metrics.band_energy(torque[:-1], 0.002)
    assert odd_whole == pytest.approx(0.002 * np.sum((torque[:-1] - torque[:-1].mean(axis=0)) ** 2), rel=1e-9)
    assert odd == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ([0.0, 0.05, -0.05], 0.0),
        ([0.2, 0.05, 0.2, 0.05, 0.05], 3.0),
        ([0.05, 0.05, 0.2], None),
        ([0.05, math.nan, 0.05], 2.0),
        ([0.1, 0.05], 1.0),
    ],
)
def test_settling_is_for_good(errors, expected):
    assert metrics.settling_time(np.arange(float(len(errors))), np.array(errors), 0.1) == expected


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([0.0, 0.0, 0.0, 0.0], 0.0),
        ([1.0, 0.2, 0.2, 1.0, 0.2, 0.2, 0.2, 1.0], 4.0),
        ([1.0, 0.2, 0.2, 0.2], 1.0),
        ([1.0, 0.2, 0.2], None),
        ([0.3, 0.3, 0.3, 0.3], None),
    ],
)
def test_reaching_needs_its_dwell_and_may_be_left_later(values, expected):
    s = np.zeros((len(values), 3))
    s[:, 1] = -np.array(values)
    assert estimates.reaching_time(np.arange(float(len(values))), s, bound=0.3, dwell=2.0) == expected


def test_every_axis_must_be_below_the_bound_at_once():
    s = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert estimates.reaching_time(np.arange(4.0), s, bound=0.3, dwell=1.0) == 2.0


def beliefs(**changes):
    angles = [[0.0, 0.0, 0.0], [0.3, -0.2, 1.0]]
    omega = [[0.0, 0.0, 0.0], [0.5, -0.4, 0.2]]
    quaternions = Rotation.from_euler("ZYX", [angle[::-1] for angle in angles]).as_quat()
    inside = {
        "adaptive_constant": [[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]],
        "adaptive_angle": [[2.0, 2.0, 2.0]] * 2,
        "adaptive_rate": [[4.0, 4.0, 4.0]] * 2,
        "sliding_variable": [[0.4, 0.0, 0.0], [0.1, 0.0, 0.0]],
        **changes,
    }
    stamps = seconds(0.0, 2.0)
    return {
        "attitude_controller/internals": table(stamps, **inside),
        "truth": table(stamps, q_wb=quaternions, omega_b=omega),
        "disturbance": table(stamps, lumped_angular_acceleration_b=[[-2.0, 0, 0], [2.0, 0, 0]]),
    }


def test_the_adaptive_bound_is_that_of_equation_60():
    found = estimates.adaptive_bound(beliefs())
    assert found is not None
    phi, theta, (p, q, r) = 0.3, -0.2, (0.5, -0.4, 0.2)
    rates = [
        p + (q * math.sin(phi) + r * math.cos(phi)) * math.tan(theta),
        q * math.cos(phi) - r * math.sin(phi),
        (q * math.sin(phi) + r * math.cos(phi)) / math.cos(theta),
    ]
    expected = [0.5 + 2.0 * abs(angle) + 4.0 * abs(rate) for angle, rate in zip((phi, theta, 1.0), rates, strict=True)]
    np.testing.assert_allclose(found.estimate, [[1.0, 1.0, 1.0], expected], rtol=1e-12)
    np.testing.assert_array_equal(found.truth, [[2.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    told = estimates.belief_metrics(beliefs(), 0)
    assert told["adaptive_bound_shortfall"] == 0.5  # 2.0 > 1.0 at first, 2.0 < 0.5 + 0.6 + 4 * 0.44 later
    assert told["surface_reaching_time"] is None


def test_what_a_law_has_not_is_not_available():
    nothing = np.zeros((2, 3))
    tables = beliefs(adaptive_constant=nothing, adaptive_angle=nothing, adaptive_rate=nothing, sliding_variable=nothing)
    assert estimates.belief_metrics(tables, 0) == {}
    assert metrics.flight_metrics({}) == metrics.FlightMetrics()


def test_the_disturbance_estimate_is_held_against_what_acted():
    stamps = seconds(0.0, 1.0)
    tables = {
        "position_controller/internals": table(stamps, disturbance_estimate=[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]),
        "disturbance": table(seconds(0.0, 0.5, 1.0), lumped_acceleration_w=[[0.0, 0, 0], [9.0, 0, 0], [0, 0, 2.0]]),
    }
    told = estimates.belief_metrics(tables, 0)
    assert told == {"disturbance_estimate_rmse": pytest.approx(math.sqrt((1.0 + 8.0) / 2))}


def test_angles_agree_with_scipy_and_rates_with_differences():
    rng = np.random.default_rng(4)
    angles = rng.uniform([-3.0, -1.4, -3.0], [3.0, 1.4, 3.0], size=(200, 3))
    rotations = Rotation.from_euler("ZYX", angles[:, ::-1])
    np.testing.assert_allclose(arrays.euler_angles(rotations.as_quat()), angles, atol=1e-9)
    omega = rng.normal(size=(200, 3))
    step = 1e-6
    later = (rotations * Rotation.from_rotvec(omega * step)).as_euler("ZYX")[:, ::-1]
    earlier = (rotations * Rotation.from_rotvec(-omega * step)).as_euler("ZYX")[:, ::-1]
    slope = arrays.wrapped(later - earlier) / (2 * step)
    np.testing.assert_allclose(arrays.euler_rates(angles, omega), slope, atol=1e-5)


def test_wrapping_keeps_plus_pi():
    found = arrays.wrapped(np.array([math.pi, -math.pi, 3 * math.pi, 0.5, 2 * math.pi + 0.5]))
    np.testing.assert_allclose(found, [math.pi, math.pi, math.pi, 0.5, 0.5], atol=1e-12)


def test_alignment_takes_equal_stamps_only_and_the_first_of_repeats():
    rows = arrays.by_stamp(table([30, 10, 10, 20], value=[3.0, 1.0, 9.0, 2.0]))
    assert rows["value"].tolist() == [1.0, 2.0, 3.0]
    match = arrays.aligned(rows["stamp_ns"], np.array([5, 20, 30, 40]))
    assert (match.stamp_ns.tolist(), match.left.tolist(), match.right.tolist()) == ([20, 30], [1, 2], [1, 2])
