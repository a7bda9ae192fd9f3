"""Metrics against numbers worked out by hand, or by another way than the code's own."""

import math

import numpy as np
import pytest
from metric_tables import seconds, table

from quad_analysis import metrics


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
    times = 2.0 + np.arange(float(len(errors)))
    assert metrics.settling_time(times, np.array(errors), 0.1) == expected


def turned(*yaws):
    return [[0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)] for yaw in yaws]


def test_only_what_is_after_the_approach_counts_and_only_truth():
    # The trajectory starts at 1 s (trajectory time 0.25 s). Before it every error is huge; `state` is wrong throughout.
    stamps = seconds(0.0, 1.0, 2.0, 3.0)
    reference = table(stamps, p_w=[[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [3.0, 0, 0]],
                      trajectory_time=[-0.75, 0.25, 1.25, 2.25])  # fmt: skip
    more = seconds(0.0, 0.5, 1.0, 2.0, 3.0, 4.0)
    setpoints = [0.0, -math.pi + 0.05, 1.0, 2.0]
    yaws = [2.0, 0.0, math.pi - 0.05, 0.9, 1.9, 0.0]
    flown = [[9.0, 9, 9], [9.0, 0, 0], [1.0, 0.4, 0], [2.0, 0.2, 0], [3.0, 0.2, 0], [9.0, 0, 0]]
    found = metrics.flight_metrics(
        {
            "reference": reference,
            "truth": table(more, p_w=flown, q_wb=turned(*yaws)),
            "state": table(more, p_w=np.full((6, 3), 7.0), q_wb=turned(*yaws)),
            "attitude_setpoint": table(stamps, angles=[[0.0, 0.0, yaw] for yaw in setpoints]),
            "wrench_setpoint": table(stamps, thrust=[9.0, 1.0, 1.0, 1.0], torque_b=[[9.0, 0, 0], *[[0.0, 0, 0]] * 3]),
            "actuation": table(
                stamps,
                thrust_low=[True, True, False, False],
                **{name: [False] * 4 for name in ("thrust_high", "roll_limited", "pitch_limited", "yaw_limited")},
            ),
        }
    )
    assert found.duration == 3.0
    assert found.position_max == pytest.approx(0.4)
    assert found.position_iae == pytest.approx(0.3 + 0.2)
    assert found.position_itae == pytest.approx((0.1 + 0.25) / 2 + (0.25 + 0.45) / 2)
    assert found.attitude_rmse == pytest.approx(0.1)  # across half a turn, and not divided by the three axes
    assert (found.thrust_effort, found.torque_total_variation) == (pytest.approx(3.0), 0.0)
    assert found.saturation_time == 1.0


def test_each_command_counts_for_as_long_as_it_holds():
    assert metrics.effort(np.array([1.0, 2.0]), np.array([3.0, 1.0])) == 11.0
    stamps = seconds(0.0, 1.0, 2.0, 4.0)
    wrench = table(stamps, thrust=[1.0, 1.0, 1.0, 2.0], torque_b=np.zeros((4, 3)))
    found = metrics.flight_metrics(
        {"reference": table(stamps, p_w=np.zeros((4, 3)), trajectory_time=[0.0, 1, 2, 4]), "wrench_setpoint": wrench}
    )
    assert found.thrust_effort == pytest.approx(1.0 + 1.0 + 2.0 + 4.0)
    assert found.torque_high_frequency is None  # no spectrum of uneven steps


def test_a_constant_command_does_not_vary():
    assert metrics.total_variation(np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])) == 0.0
    assert metrics.total_variation(np.array([[0.0, 0.0, 0.0], [1.0, -2.0, 4.0]])) == 7.0


@pytest.mark.parametrize("count", [500, 499])
def test_fast_torque_is_that_of_all_axes_above_the_limit_without_the_mean(count):
    # 2 N m at 15 Hz and 1 N m at 40 Hz over a whole second: energies 4/2 and 1/2, the mean of 7 N m does not count.
    time = np.arange(count) * 0.002
    torque = np.stack([2.0 * np.sin(2 * np.pi * 15 * time) + 7.0, 0 * time, np.sin(2 * np.pi * 40 * time)], axis=1)
    stamps = [step * 2_000_000 for step in range(count)]
    reference = table(stamps, p_w=np.zeros((count, 3)), trajectory_time=time)
    wrench = table(stamps, thrust=np.zeros(count), torque_b=torque)
    found = metrics.flight_metrics({"reference": reference, "wrench_setpoint": wrench})
    assert found.torque_high_frequency == pytest.approx(0.5, rel=1e-9 if count == 500 else 0.02)
    assert found.chattering_index == pytest.approx(0.5 / 2.5, rel=1e-9 if count == 500 else 0.02)
    whole = metrics.band_energy(torque, 0.002)[1]
    assert whole == pytest.approx(0.002 * np.sum((torque - torque.mean(axis=0)) ** 2), rel=1e-9)


def test_a_wrench_message_gives_force_along_z_and_the_three_torques():
    vector = [(axis, "f8") for axis in "xyz"]
    row = np.array([(((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)),)], [("wrench", [("force", vector), ("torque", vector)])])
    thrust, torque = metrics.thrust_and_torque(row)
    assert thrust.tolist() == [3.0]
    assert torque.tolist() == [[4.0, 5.0, 6.0]]


def test_with_modes_only_what_was_flown_in_mission_counts():
    # TAKEOFF and HOLD 9 m off, MISSION from 1.0 s to before 2.0 s: 0.3 and 0.4 m; its approach (t < 0) is not counted
    stamps = seconds(0.0, 0.5, 1.0, 1.5, 1.75, 2.0)
    reference = table(stamps, p_w=np.zeros((6, 3)), trajectory_time=[0.0, 0.0, -0.5, 0.0, 0.25, 0.0])
    position = [[9.0, 0, 0], [9.0, 0, 0], [7.0, 0, 0], [0.3, 0, 0], [0.4, 0, 0], [9.0, 0, 0]]
    truth = table(stamps, p_w=position, q_wb=[[0.0, 0.0, 0.0, 1.0]] * 6)
    modes = table(seconds(0.0, 0.5, 1.0, 1.25, 2.0), mode=np.array([2, 4, 3, 3, 4], dtype=np.uint8))
    found = metrics.flight_metrics({"reference": reference, "truth": truth, "flight/mode": modes})
    assert found.position_rmse == pytest.approx(math.sqrt((0.09 + 0.16) / 2), rel=1e-12)
    assert found.position_max == pytest.approx(0.4)
    assert found.duration == pytest.approx(0.25)
    without = metrics.flight_metrics({"reference": reference, "truth": truth})
    assert without.position_max == pytest.approx(9.0)


def test_a_flight_that_was_never_in_mission_has_no_metrics():
    reference = table(seconds(0.0), p_w=np.zeros((1, 3)), trajectory_time=[0.0])
    modes = table(seconds(0.0), mode=np.array([4], dtype=np.uint8))
    assert metrics.flight_metrics({"reference": reference, "flight/mode": modes}) == metrics.FlightMetrics()
