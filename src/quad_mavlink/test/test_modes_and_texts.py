"""Modes, reasons and estimates as PX4 and ArduPilot send them, written from MAVLink's definitions."""

from types import SimpleNamespace

import numpy as np
import pytest
from frames_oracle import BODY, WORLD
from scipy.spatial.transform import Rotation

from quad_autopilot import odometry
from quad_autopilot.autopilot import Control
from quad_core.parameters import ParameterError
from quad_mavlink import link, modes_and_texts

PX4, ARDUPILOT = 12, 3


def heartbeat(*values):
    return SimpleNamespace(**dict(zip(("autopilot", "base_mode", "custom_mode", "system_status"), values, strict=True)))


@pytest.mark.parametrize(("autopilot", "custom_mode", "name", "control"), [
    (PX4, 6 << 16, "OFFBOARD", Control.OURS),
    (PX4, 3 << 16, "POSCTL", Control.OTHER),
    (PX4, 4 << 16 | 6 << 24, "AUTO_LAND", Control.LANDING),
    (PX4, 4 << 16 | 9 << 24, "AUTO_PRECLAND", Control.LANDING),
    (PX4, 4 << 16 | 5 << 24, "AUTO_RTL", Control.OTHER),
    (PX4, 4 << 16 | 10 << 24, "AUTO_VTOL_TAKEOFF", Control.OTHER),
    (PX4, 99 << 16, "mode 99", Control.OTHER),
    (PX4, 6, "mode 0", Control.OTHER),
    (ARDUPILOT, 4, "GUIDED", Control.OURS),
    (ARDUPILOT, 9, "LAND", Control.LANDING),
    (ARDUPILOT, 5, "LOITER", Control.OTHER),
    (ARDUPILOT, 20, "GUIDED_NOGPS", Control.OTHER),
    (ARDUPILOT, 77, "mode 77", Control.OTHER),
])  # fmt: skip
def test_a_mode_is_ours_a_landing_or_somebody_else_s(autopilot, custom_mode, name, control):
    found = modes_and_texts.said(heartbeat(autopilot, 1, custom_mode, 4), True, "")
    assert (found.mode, found.control, found.armed, found.failsafe) == (name, control, False, False)
    assert modes_and_texts.said(heartbeat(autopilot, 129, custom_mode, 5), True, "")[2:4] == (True, True)


def test_the_mode_is_asked_for_by_each_autopilot_s_number():
    assert modes_and_texts.PROFILES[PX4].mode[:3] == (176, 1.0, 6.0)
    assert modes_and_texts.PROFILES[ARDUPILOT].mode[:3] == (176, 1.0, 4.0)
    assert modes_and_texts.PROFILES[PX4].hold[:4] == (176, 1.0, 4.0, 3.0)  # AUTO, LOITER
    assert modes_and_texts.PROFILES[ARDUPILOT].hold[:3] == (176, 1.0, 17.0)  # BRAKE
    assert modes_and_texts.PROFILES[PX4].land.command == modes_and_texts.PROFILES[ARDUPILOT].land.command == 21


def test_texts_are_put_together_shown_once_and_forgotten():
    first = "Preflight Fail: Compass Sensor 0 missing and nothi"
    texts = modes_and_texts.heard((), 1.0, 3, first, 5)
    texts = modes_and_texts.heard(texts, 1.0, 3, "ng else", 5)
    texts = modes_and_texts.heard(texts, 2.0, 6, "takeoff detected", 0)  # no reason: information
    for _ in range(3):
        texts = modes_and_texts.heard(texts, 3.0, 2, "battery low", 0)
    assert modes_and_texts.newest(texts, 4.0) == (first + "ng else", "battery low")
    assert modes_and_texts.newest(texts, 12.0) == ("battery low",)
    for now in range(4, 20, 4):  # a reason that persists does not drop out and come back
        texts = modes_and_texts.heard(texts, float(now), 2, "battery low", 0)
    assert modes_and_texts.newest(texts, 20.0) == ("battery low",)
    assert modes_and_texts.heard(texts, 30.0, 7, "quiet", 0) == ()


Q = Rotation.from_euler("ZYX", [0.7, 0.2, -0.3])
WXYZ = tuple(np.roll(Q.as_quat(), 1).tolist())


def numbered(names, values):
    return dict(zip(names, map(float, values), strict=True))


def odometry_of(frames, velocity, rates=(0.0, 0.0, 0.0), resets=0):
    motion = numbered(("vx", "vy", "vz"), velocity) | numbered(("rollspeed", "pitchspeed", "yawspeed"), rates)
    frame, child = frames
    return modes_and_texts.of_odometry(
        SimpleNamespace(
            time_usec=5_000_000, frame_id=frame, child_frame_id=child, x=1.0, y=2.0, z=-3.0, q=list(WXYZ),
            reset_counter=resets, **motion,
        )
    )  # fmt: skip


def pair_of(time_boot_ms, position):
    attitude = numbered(("q1", "q2", "q3", "q4"), WXYZ) | numbered(("rollspeed", "pitchspeed", "yawspeed"), (0, 0, 0))
    return modes_and_texts.of_pair(SimpleNamespace(time_boot_ms=time_boot_ms, **attitude), position)


def position_of(time_boot_ms, p, v):
    motion = numbered(("x", "y", "z"), p) | numbered(("vx", "vy", "vz"), v)
    return SimpleNamespace(time_boot_ms=time_boot_ms, **motion)


@pytest.mark.parametrize("child", [1, 12])
def test_the_velocity_of_odometry_is_in_the_frame_that_it_names(child):
    ned = np.array([1.0, -2.0, 0.5])
    sent = ned if child == 1 else Q.as_matrix().T @ ned
    sample = odometry_of((1, child), sent, (0.1, 0.2, 0.3), 4)
    assert odometry.refusal(sample, -1) == ""
    state = odometry.state(sample)
    assert state.p_w == pytest.approx(WORLD @ [1.0, 2.0, -3.0])
    assert state.v_w == pytest.approx(WORLD @ ned)
    assert state.omega_b == pytest.approx(BODY @ [0.1, 0.2, 0.3])
    assert sample.reset_counter == 4


@pytest.mark.parametrize("frames", [(20, 1), (1, 20), (0, 0)])
def test_odometry_in_another_frame_is_refused(frames):
    sample = odometry_of(frames, (0.0, 0.0, 0.0))
    assert "NED" in odometry.refusal(sample, -1)


def test_a_pair_stands_at_the_attitude_s_time_and_an_old_position_makes_none():
    position = position_of(1000, (1.0, 2.0, -3.0), (10.0, 0.0, -1.0))
    sample = pair_of(1010, position)
    assert sample.timestamp_sample == 1_010_000
    assert sample.position == pytest.approx((1.1, 2.0, -3.01))
    assert pair_of(1031, position) is None
    assert pair_of(1010, None) is None


@pytest.mark.parametrize(
    "text",
    ["", "14540", ":14540", "host:", "host:x", "host:70000", "host:²", "host:٣", f"host:{9:05000}", "a\0b:1", "..:1"],
)
def test_an_address_that_is_none_is_refused_by_name(text):
    with pytest.raises(ParameterError, match="listen: found"):
        link.address(text, "listen")
