"""The estimates of the laws, against numbers worked out by hand."""

import math

import numpy as np
import pytest
from metric_tables import seconds, table
from scipy.spatial.transform import Rotation

from quad_flight_log.analysis import estimates, metrics


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


def estimated(**changes):
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
    found = estimates.adaptive_bound(estimated())
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
    answer = estimates.estimate_metrics(estimated(), 0)
    assert answer["adaptive_bound_shortfall"] == 0.5  # 2.0 > 1.0 at first, 2.0 < 0.5 + 0.6 + 4 * 0.44 later
    assert answer["surface_reaching_time"] is None


def test_what_a_law_has_not_is_not_available():
    nothing = np.zeros((2, 3))
    tables = estimated(
        adaptive_constant=nothing, adaptive_angle=nothing, adaptive_rate=nothing, sliding_variable=nothing
    )
    assert estimates.estimate_metrics(tables, 0) == {}
    assert metrics.flight_metrics({}) == metrics.FlightMetrics()


def test_the_disturbance_estimate_is_held_against_what_acted():
    stamps = seconds(0.0, 1.0)
    tables = {
        "position_controller/internals": table(stamps, disturbance_estimate=[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]),
        "disturbance": table(seconds(0.0, 0.5, 1.0), lumped_acceleration_w=[[0.0, 0, 0], [9.0, 0, 0], [0, 0, 2.0]]),
    }
    answer = estimates.estimate_metrics(tables, 0)
    assert answer == {"disturbance_estimate_rmse": pytest.approx(math.sqrt((1.0 + 8.0) / 2))}


def test_estimates_are_compared_at_equal_stamps_from_the_start_on():
    tables = estimated()
    # at 1 s the truth has a sample of its own, at 2 s a bound far above what acts; the start is at 2 s
    omega, still = [[9.0, 9.0, 9.0]] * 3, [[0.0, 0.0, 0.0, 1.0]] * 3
    tables["truth"] = table(seconds(0.0, 1.0, 2.0), q_wb=still, omega_b=[[0.0, 0, 0], omega[1], [0.0, 0, 0]])
    bound = estimates.adaptive_bound(tables)
    assert bound is not None
    np.testing.assert_allclose(bound.estimate, [[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]])
    assert estimates.estimate_metrics(estimated(), seconds(2.0)[0])["adaptive_bound_shortfall"] == 0.0


def test_what_is_before_the_start_is_not_counted():
    stamps = seconds(0.0, 1.0, 2.0, 3.0)
    tables = {
        "position_controller/internals": table(stamps, disturbance_estimate=[[9.0, 0, 0], *[[1.0, 0, 0]] * 3]),
        "disturbance": table(stamps, lumped_acceleration_w=np.zeros((4, 3))),
        "attitude_controller/internals": table(
            stamps, sliding_variable=[[9.0, 0.0, 0.0], [0.1, 0, 0], [0.1, 0, 0], [0.1, 0, 0]]
        ),
    }
    answer = estimates.estimate_metrics(tables, seconds(1.0)[0])
    assert answer == {"disturbance_estimate_rmse": 1.0, "surface_reaching_time": 0.0}


def test_reaching_is_counted_from_the_first_time():
    s = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert estimates.reaching_time(np.array([5.0, 6.0, 7.0]), s, bound=0.3, dwell=1.0) == 1.0
