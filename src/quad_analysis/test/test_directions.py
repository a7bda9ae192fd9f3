"""A bench by hand with one thing wrong: the axis is named."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_analysis.directions import wrong_directions

TIMES = np.arange(0.0, 12.0, 0.01)


class Bench:
    """Topics of a bag in which the vehicle is tilted about x, y, z by ``sizes`` degrees from 1, 4 and 7 s on."""

    def __init__(self, sizes=(20.0, 20.0, 20.0), stiffness=(1.0, 1.0, 1.0), begins=(1.0, 4.0, 7.0)):
        inside = [(begin <= TIMES) & (begin + 3.0 > TIMES) for begin in begins]
        phases = np.stack([np.where(here, TIMES - begin, 0.0) for here, begin in zip(inside, begins, strict=True)], 1)
        vectors = np.radians(sizes) * np.sin(np.pi * phases / 3.0)
        rates = np.radians(sizes) * np.pi / 3.0 * np.cos(np.pi * phases / 3.0) * np.stack(inside, 1)
        stamps = np.round(1e9 * TIMES).astype(np.int64)
        kind = [("stamp_ns", "i8"), ("omega_b", "f8", 3), ("q_wb", "f8", 4)]
        self.topics = {"state": np.zeros(len(TIMES), dtype=kind)}
        self.topics["state"]["stamp_ns"], self.topics["state"]["omega_b"] = stamps, rates
        self.topics["state"]["q_wb"] = Rotation.from_rotvec(vectors).as_quat()
        axes = [(axis, "f8") for axis in "xyz"]
        kind = [("stamp_ns", "i8"), ("wrench", [("torque", axes)])]
        wrench = self.topics["wrench_setpoint"] = np.zeros(len(TIMES), dtype=kind)
        wrench["stamp_ns"] = stamps
        for number, axis in enumerate("xyz"):
            wrench["wrench"]["torque"][axis] = -stiffness[number] * (vectors + 0.5 * rates)[:, number]

    def has(self, topic):
        return topic in self.topics

    def array(self, topic):
        return self.topics[topic]


@pytest.mark.parametrize(
    ("how", "fault"),
    [
        ({}, ""),
        ({"stiffness": (-1.0, 1.0, 1.0)}, "roll: wrong sign of the torque: it opposes the tilt in 0 % of its time"),
        ({"stiffness": (1.0, -1.0, 1.0)}, "pitch: wrong sign of the torque: it opposes the tilt in 0 % of its time"),
        ({"stiffness": (1.0, 1.0, -1.0)}, "yaw: wrong sign of the torque: it opposes the tilt in 0 % of its time"),
        ({"stiffness": (0.0, 0.0, 0.0)}, ""),  # the autopilot makes the torque
        ({"sizes": (-20.0, 20.0, 20.0)}, "roll: wrong sign of the state: right side down came as the opposite"),
        ({"sizes": (20.0, -20.0, 20.0)}, "pitch: wrong sign of the state: nose down came as the opposite"),
        ({"sizes": (20.0, 20.0, -20.0)}, "yaw: wrong sign of the state: a turn to the left came as the opposite"),
        ({"sizes": (20.0, 20.0, 5.0)}, "yaw: a turn to the left is not in the state, expected 10 deg of it"),
        ({"begins": (4.0, 1.0, 7.0)}, "axes: found the tilts in the order pitch, roll, yaw, expected roll, pitch, yaw"),
    ],
)
def test_what_is_wrong_with_an_axis_is_named(how, fault):
    assert wrong_directions(Bench(**how)) == fault


def test_without_torque_the_state_alone_is_told():
    bench = Bench(sizes=(20.0, -20.0, 20.0))
    del bench.topics["wrench_setpoint"]
    assert wrong_directions(bench) == "pitch: wrong sign of the state: nose down came as the opposite"
