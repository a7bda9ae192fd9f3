"""What stands in the messages to and from PX4, whatever px4_msgs the user has; whose the vehicle is by two of them."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from frames_oracle import ned_frd
from scipy.spatial.transform import Rotation

from quad_autopilot.autopilot import Ack, Control, Request
from quad_core.types import Quat, Vec3
from quad_px4 import messages
from quad_px4.mapping import ThrustTorque
from quad_px4.messages import Flags, autopilot, control, mode_name
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


OFFBOARD, POSCTL, AUTO_LAND = 14, 2, 18


def status(nav_state, armed=True, timestamp=1000, failsafe=False):
    return SimpleNamespace(
        timestamp=timestamp,
        nav_state=nav_state,
        arming_state=2 if armed else 1,
        failsafe=failsafe,
        pre_flight_checks_pass=True,
    )


def control_mode(timestamp, armed, ours, source_id=0):
    return SimpleNamespace(
        timestamp=timestamp, flag_armed=armed, flag_control_offboard_enabled=ours, source_id=source_id
    )


@pytest.mark.parametrize(
    ("nav_state", "offboard", "later", "whose"),
    [
        (OFFBOARD, True, 500, Control.OURS),
        (OFFBOARD, False, 500, Control.UNSAID),  # taken away, the status that names the mode is still to come
        (OFFBOARD, False, -500, Control.OURS),  # an older message says nothing any more
        (POSCTL, True, -500, Control.OTHER),
        (POSCTL, False, 500, Control.OTHER),
        (POSCTL, True, 500, Control.OURS),
        (AUTO_LAND, False, 500, Control.LANDING),
        (AUTO_LAND, True, -3, Control.LANDING),
        (OFFBOARD, False, 0, Control.OURS),
    ],
)
def test_the_newer_message_says_whose_the_vehicle_is(nav_state, offboard, later, whose):
    found = autopilot(status(nav_state), control_mode(1000 + later, True, offboard), Flags())
    assert found.control == whose
    assert found.armed
    assert found.mode == {Control.OURS: "OFFBOARD", Control.UNSAID: "not said yet"}.get(whose, mode_name(nav_state))


@pytest.mark.parametrize(("source_id", "whose"), [(23, Control.OURS), (0, Control.UNSAID)])
def test_an_external_mode_is_ours_while_its_own_configuration_is_shown(source_id, whose):
    mode = control_mode(1500, True, False, source_id)
    assert autopilot(status(23), mode, Flags(), external=23).control == whose


@pytest.mark.parametrize(("later", "armed"), [(500, False), (-500, True)])
def test_the_newer_message_says_whether_it_is_armed(later, armed):
    assert autopilot(status(OFFBOARD), control_mode(1000 + later, False, True), Flags()).armed == armed
    disarmed = autopilot(status(OFFBOARD, armed=False), control_mode(1000 + later, True, True), Flags())
    assert disarmed.armed != armed


def test_the_status_says_why():
    found = autopilot(status(AUTO_LAND, failsafe=True), control_mode(2000, True, False), Flags(("battery_low",)))
    assert (found.mode, found.failsafe, found.checks_pass, found.reasons) == ("AUTO_LAND", True, True, ("battery_low",))
    assert autopilot(status(POSCTL), None, Flags()).control == Control.OTHER


@pytest.mark.parametrize(
    ("nav_state", "whose"),
    [
        *((14, Control.OURS), (18, Control.LANDING), (12, Control.LANDING), (20, Control.LANDING)),
        *((4, Control.WAITING), (17, Control.CLIMBING), (2, Control.OTHER), (5, Control.OTHER)),
    ],
)
def test_modes_by_their_numbers(nav_state, whose):
    assert control(nav_state) == whose
