"""What goes to one autopilot and what is made of its words, without a link."""

from types import SimpleNamespace

import pytest

from quad_autopilot.autopilot import Request, Stamps
from quad_autopilot.odometry import Sample
from quad_core.types import AttitudeThrust
from quad_mavlink.parameters import MavlinkBridgeParameters
from quad_mavlink.vehicle import MavlinkVehicle

PX4, ARDUPILOT = 12, 3
SYSTEM, OURS = 7, 255
SAMPLE = Sample(5_000_000, 5_000_000, 1, 1, (0.0,) * 3, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3, 0)


class Words:
    """Stands for pymavlink: each message is its name and its arguments."""

    def __getattr__(self, name):
        return lambda *fields, **_: (name.removeprefix("MAVLink_").removesuffix("_message"), *fields)


@pytest.fixture
def vehicle():
    sent = []
    made = MavlinkVehicle(
        SimpleNamespace(mavlink=Words(), send=sent.append),
        MavlinkBridgeParameters(max_rotor_thrust=5.0, target_system=SYSTEM, source_system=OURS),
    )
    made.sent = sent
    return made


def message(kind, **fields):
    return SimpleNamespace(get_type=lambda: kind, **fields)


def beat(vehicle, kind):
    vehicle.handle(message("HEARTBEAT", autopilot=kind, base_mode=1, custom_mode=0, system_status=4), 1.0)


def test_a_target_carries_the_ms_of_the_state_that_it_answers(vehicle):
    vehicle.fly(AttitudeThrust(thrust=8.0), Stamps(now=5_009_000, sampled=5_001_999))
    assert vehicle.sent[-1][:5] == ("set_attitude_target", 5001, SYSTEM, 1, 7)
    assert vehicle.sent[-1][6:] == (0.0, 0.0, 0.0, 0.4)
    vehicle.fly(AttitudeThrust(thrust=8.0), Stamps(sampled=1000 * (2**32 + 5)))
    assert vehicle.sent[-1][1] == 5  # the field has 32 bits


def test_a_request_goes_to_the_vehicle_that_is_meant_with_numbers_alone(vehicle):
    vehicle.request(Request(21, attempt=258))
    assert vehicle.sent == [("command_long", SYSTEM, 1, 21, 2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]


def test_our_heartbeat_is_that_of_an_onboard_controller(vehicle):
    vehicle.every_second(1.0)
    assert vehicle.sent == [("heartbeat", 18, 8, 0, 0, 4), ("timesync", 0, 1_000_000_000)]


def test_answers_to_others_are_none(vehicle):
    vehicle.handle(message("COMMAND_ACK", command=400, result=2, target_system=42), 1.0)
    assert vehicle.ack is None
    vehicle.handle(message("COMMAND_ACK", command=400, result=2, target_system=OURS), 1.0)
    assert vehicle.ack == (400, 2)


def test_the_age_of_a_state_comes_from_half_the_way_of_a_timesync(vehicle):
    assert vehicle.stamped(SAMPLE, 2.0) == SAMPLE
    # asked at 2.000 s of ours, answered at 5.000 s of theirs, back at 2.020 s: 2.010 s is 5.000 s
    vehicle.handle(message("TIMESYNC", tc1=5_000_000_000, ts1=2_000_000_000), 2.02)
    vehicle.handle(message("TIMESYNC", tc1=0, ts1=1_999_000_000), 2.025)  # the autopilot's own question
    assert vehicle.stamped(SAMPLE, 2.03).timestamp == 5_020_000
    assert vehicle.stamped(SAMPLE, 1.0).timestamp == SAMPLE.timestamp_sample


@pytest.mark.parametrize(("kind", "options", "word"), [(ARDUPILOT, 0, "found 0"), (ARDUPILOT, 1, "found 1")])
def test_a_thrust_that_would_be_a_climb_rate_is_refused(vehicle, kind, options, word):
    beat(vehicle, kind)
    assert "not answered" in vehicle.refusal()
    vehicle.parameters = {"GUID_OPTIONS": float(options), "ATC_ANGLE_BOOST": 1.0}
    assert word in vehicle.refusal()
    vehicle.parameters["GUID_OPTIONS"] = 9.0
    assert vehicle.refusal() == ""
    assert vehicle.boosts


def test_px4_has_no_such_parameter(vehicle):
    beat(vehicle, PX4)
    assert (vehicle.refusal(), vehicle.boosts) == ("", False)
