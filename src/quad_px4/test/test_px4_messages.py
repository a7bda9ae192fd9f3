"""What stands in the messages to and from PX4, field by field, whatever px4_msgs the user has."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from frames_oracle import ned_frd
from scipy.spatial.transform import Rotation

from quad_autopilot.autopilot import Ack, Request
from quad_core.types import Quat, Vec3
from quad_px4 import messages
from quad_px4.mapping import ThrustTorque
from quad_px4.parameters import Mode

NOW, SAMPLED = 5_000_700, 5_000_000
THRUST = Vec3(0.0, 0.0, -0.5)


class Message:
    def __init__(self, **fields):
        self.__dict__.update(fields)


PX4 = SimpleNamespace(**{name: type(name, (Message,), {}) for name in messages.NEEDED})


@pytest.mark.parametrize(
    ("mode", "level"),
    [(Mode.WRENCH, "thrust_and_torque"), (Mode.MOTORS, "direct_actuator"), (Mode.ATTITUDE, "attitude")],
)
def test_the_heartbeat_names_one_level_and_px4s_time(mode, level):
    assert vars(messages.heartbeat(PX4, mode, NOW)) == {"timestamp": NOW, level: True}


def test_a_command_goes_to_the_vehicle_that_is_meant_and_comes_from_outside():
    found = vars(messages.command(PX4, Request(176, 1.0, 4.0, 3.0, attempt=257), 7, NOW))
    assert (found["command"], found["confirmation"]) == (176, 1)
    assert (found["param1"], found["param2"], found["param3"]) == (1.0, 4.0, 3.0)
    assert (found["target_system"], found["target_component"], found["timestamp"]) == (7, 1, NOW)
    assert found["from_external"] is True


def test_thrust_and_torque_stand_in_their_own_messages_with_both_stamps():
    thrust, torque = messages.thrust_torque(PX4, ThrustTorque(THRUST, Vec3(0.1, 0.2, 0.3)), NOW, SAMPLED)
    stamps = {"timestamp": NOW, "timestamp_sample": SAMPLED}
    assert vars(thrust) == {**stamps, "xyz": [0.0, 0.0, -0.5]}
    assert vars(torque) == {**stamps, "xyz": [0.1, 0.2, 0.3]}
    assert vars(messages.motors(PX4, [0.1, 0.2], NOW, SAMPLED)) == {**stamps, "control": [0.1, 0.2]}


def test_an_attitude_goes_out_as_wxyz_of_frd_in_ned_without_a_yaw_rate():
    q = Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]).as_quat()
    found = messages.attitude(PX4, Quat(*q.tolist()), THRUST, NOW)
    x, y, z, w = ned_frd(q).as_quat(canonical=True)
    assert found.q_d == pytest.approx([w, x, y, z])
    assert (found.thrust_body, found.timestamp) == ([0.0, 0.0, -0.5], NOW)
    assert math.isnan(found.yaw_sp_move_rate)


def test_odometry_keeps_both_stamps_and_frames_apart():
    arrays = {name: np.arange(3.0) for name in ("position", "velocity", "angular_velocity")}
    frames = {"pose_frame": 1, "velocity_frame": 3, "reset_counter": 9}
    found = messages.sample(Message(timestamp=NOW, timestamp_sample=SAMPLED, q=np.arange(4.0), **frames, **arrays))
    assert (found.timestamp, found.timestamp_sample, found.pose_frame, found.velocity_frame) == (NOW, SAMPLED, 1, 3)
    assert (found.q, found.reset_counter) == ((0.0, 1.0, 2.0, 3.0), 9)


@pytest.mark.parametrize(("target", "known"), [((7, 1), True), ((255, 190), False), ((7, 0), False), ((1, 1), False)])
def test_an_answer_to_the_command_of_another_is_none_of_ours(target, known):
    system, component = target
    found = messages.ack(Message(command=400, result=1, target_system=system, target_component=component), 7)
    assert found == (Ack(400, 1) if known else None)


@pytest.mark.parametrize(
    ("version", "topic"),
    [(0, "/fmu/out/vehicle_status"), (1, "/fmu/out/vehicle_status_v1"), (4, "/fmu/out/vehicle_status_v4")],
)
def test_a_topic_ends_with_the_version_of_its_message(version, topic):
    kind = type("VehicleStatus", (), {"MESSAGE_VERSION": version})
    assert messages.topic("", "out", kind) == topic
    assert messages.topic("/uav1/", "out", kind) == f"/uav1{topic}"
