"""What goes to one autopilot and what is made of its words, without a link."""

from types import SimpleNamespace

import pytest
from mavlink_without_link import bridge

from quad_autopilot.autopilot import Request, Stamps
from quad_core.parameters import ParameterError
from quad_core.types import AttitudeThrust
from quad_mavlink.parameters import MavlinkBridgeParameters

PX4, ARDUPILOT = 12, 3
SYSTEM, OURS = 7, 255


@pytest.fixture
def vehicle():
    return bridge(MavlinkBridgeParameters(max_rotor_thrust=5.0, target_system=SYSTEM, source_system=OURS))


def message(kind, **fields):
    return SimpleNamespace(get_type=lambda: kind, **fields)


def beat(vehicle, kind):
    vehicle.handle(message("HEARTBEAT", autopilot=kind, base_mode=1, custom_mode=0, system_status=4))


def test_a_target_carries_the_ms_of_the_state_that_it_answers(vehicle):
    vehicle.flight.stamps.return_value = Stamps(now=5_009_000, sampled=5_001_999)
    vehicle.send_attitude(AttitudeThrust(thrust=8.0))
    assert vehicle.sent[-1][:5] == ("set_attitude_target", 5001, SYSTEM, 1, 7)
    assert vehicle.sent[-1][6:] == (0.0, 0.0, 0.0, 0.4)
    vehicle.flight.stamps.return_value = Stamps(sampled=1000 * (2**32 + 5))
    vehicle.send_attitude(AttitudeThrust(thrust=8.0))
    assert vehicle.sent[-1][1] == 5  # the field has 32 bits


@pytest.mark.parametrize(("landed_state", "landed"), [(0, False), (1, True), (2, False), (3, False), (4, False)])
def test_what_the_land_detector_says_is_contact(vehicle, landed_state, landed):
    vehicle.handle(message("EXTENDED_SYS_STATE", vtol_state=0, landed_state=landed_state))
    beat(vehicle, PX4)
    assert vehicle.flight.said.landed == landed


def test_a_request_goes_to_the_vehicle_that_is_meant_with_numbers_alone(vehicle):
    vehicle._request(Request(21, param3=3.0, attempt=258))
    assert vehicle.sent == [("command_long", SYSTEM, 1, 21, 2, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0)]


def test_a_thrust_that_was_not_measured_is_refused_with_the_page_of_mavlink():
    with pytest.raises(ParameterError, match=r"^max_rotor_thrust: found 0\.0, .*; docs/how_to/mavlink\.md$"):
        bridge(MavlinkBridgeParameters())


def test_our_heartbeat_is_that_of_an_onboard_controller(vehicle):
    vehicle.ask_for_more()
    assert vehicle.sent == [("heartbeat", 18, 8, 0, 0, 4)]


@pytest.mark.parametrize(("kind", "states"), [(PX4, {331}), (ARDUPILOT, {31, 32})])
def test_what_is_needed_is_asked_for_every_second_for_a_request_may_be_lost(vehicle, kind, states):
    beat(vehicle, kind)
    for _ in range(2):
        vehicle.sent.clear()
        vehicle.ask_for_more()
        asked = {found[5]: found[6] for found in vehicle.sent if found[0] == "command_long" and found[3] == 511}
        always = {0: 1e5, 1: 1e6, 245: 2e5}  # us; HEARTBEAT, SYS_STATUS, EXTENDED_SYS_STATE
        assert asked == {**dict.fromkeys(states, 1e4), **always}


def test_answers_to_others_are_none(vehicle):
    vehicle.handle(message("COMMAND_ACK", command=400, result=2, target_system=42))
    assert vehicle.flight.ack is None
    vehicle.handle(message("COMMAND_ACK", command=400, result=2, target_system=OURS))
    assert vehicle.flight.ack == (400, 2)


def test_a_heartbeat_that_names_no_autopilot_says_nothing_of_its_mode(vehicle):
    beat(vehicle, PX4)
    known = vehicle.flight.said
    beat(vehicle, 8)  # MAV_AUTOPILOT_INVALID, as other parts of a vehicle send it
    assert (vehicle.kind, vehicle.flight.said) == (PX4, known)


@pytest.mark.parametrize(("kind", "options", "word"), [(ARDUPILOT, 0, "found 0"), (ARDUPILOT, 1, "found 1")])
def test_a_thrust_that_would_be_a_climb_rate_is_refused(vehicle, kind, options, word):
    beat(vehicle, kind)
    assert "not answered" in vehicle._refusal()
    vehicle.parameters = {"GUID_OPTIONS": float(options), "ATC_ANGLE_BOOST": 1.0}
    assert word in vehicle._refusal()
    vehicle.parameters["GUID_OPTIONS"] = 9.0
    assert vehicle._refusal() == ""
    assert vehicle.boosts
