"""Rows of a flight and the step topics that are made from them."""

from typing import NamedTuple

import numpy as np
import pytest

from quad_core.types import Actuation, AttitudeThrust, Disturbance, TrajectoryPoint, Vec3, VehicleState, Wrench
from quad_flight import rows
from quad_flight.loop import Row, Schedule
from quad_flight.stages import PerStage, Signals


class Internals(NamedTuple):
    """What a stand-in shows."""

    number: float = 0.0
    flag: bool = False
    vector: Vec3 = Vec3()


class Law:
    """A stand-in of a module."""

    Internals = Internals


STAGES = PerStage(position_controller=Law, attitude_controller=Law)
SCHEDULE = Schedule(2_000_000, 3, PerStage(position_controller=4, attitude_controller=2), 0.0)


def row(k):
    """Return what a flight logs at step k; what is held holds its step."""
    held = {period: float(k - k % period) for period in (2, 3, 4)}
    return Row(
        truth=VehicleState(p_w=Vec3(float(k), 0.0, 0.0)),
        state=VehicleState(p_w=Vec3(0.0, float(k), 0.0)),
        disturbance=Disturbance(payload_mass=float(k)),
        actuation=Actuation(thrust=float(k), yaw_limited=k % 2 == 1),
        reference=TrajectoryPoint(held[3]),
        signals=Signals(AttitudeThrust(thrust=held[4]), Wrench(held[2], Vec3(1.0, 2.0, 3.0))),
        internals=PerStage(Internals(held[4], True), Internals(held[2], False, Vec3(4.0, 5.0, 6.0))),
    )


def flown(count, cut, write):
    blocks = []
    for first, last in ((0, cut), (cut, count)):
        block = np.full((last - first, len(rows.names(STAGES))), np.nan)
        for k in range(first, last):
            write(block, k - first, row(k))
        blocks.append((first, block))
    return blocks


@pytest.mark.parametrize("cut", [1, 4, 5, 6, 7])
def test_each_topic_has_the_steps_of_its_publisher(cut):
    topics = rows.split(STAGES, SCHEDULE, flown(11, cut, rows.writer(STAGES)), 0)
    periods = {"truth": 1, "state": 1, "disturbance": 1, "actuation": 1, "reference": 3, "attitude_setpoint": 4}
    periods |= {"position_controller/internals": 4, "wrench_setpoint": 2, "attitude_controller/internals": 2}
    assert set(topics) == set(periods)
    for name, period in periods.items():
        assert topics[name]["step"].tolist() == list(range(0, 11, period)), name
        assert topics[name]["next_step"].tolist() == [step + period for step in range(0, 11, period)], name
        assert topics[name]["stamp_ns"].tolist() == [2_000_000 * step for step in range(0, 11, period)], name
    assert topics["truth"]["p_w"][:, 0].tolist() == list(range(11))
    assert topics["state"]["p_w"][:, 1].tolist() == list(range(11))
    assert topics["actuation"]["yaw_limited"].tolist() == [False, True] * 5 + [False]
    assert topics["reference"]["trajectory_time"].tolist() == [0.0, 3.0, 6.0, 9.0]
    assert topics["attitude_setpoint"]["thrust"].tolist() == [0.0, 4.0, 8.0]
    assert topics["wrench_setpoint"]["thrust"].tolist() == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    assert topics["position_controller/internals"]["number"].tolist() == [0.0, 4.0, 8.0]
    assert topics["position_controller/internals"]["flag"].tolist() == [True] * 3
    assert topics["attitude_controller/internals"]["vector"].tolist() == [[4.0, 5.0, 6.0]] * 6
