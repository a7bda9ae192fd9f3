"""What is asked of cflib, and whose the vehicle is, without a Crazyflie."""

from unittest.mock import Mock, call

import pytest

from quad_autopilot.autopilot import ARM_DISARM, DO_SET_MODE, NAV_LAND, Control, Request
from quad_crazyflie import vehicle as module
from quad_crazyflie.parameters import CrazyflieBridgeParameters
from quad_crazyflie.setpoints import Manual

ARMED, FLYING, TUMBLED, HIGH_LEVEL = 2, 16, 32, 256


@pytest.fixture
def vehicle(monkeypatch):
    cflib = Mock()
    monkeypatch.setattr(module, "load", lambda: (Mock(CLASSES=[1]), lambda: cflib, Mock()))
    made = module.CrazyflieVehicle(CrazyflieBridgeParameters(max_rotor_thrust=0.15, landing_speed=0.5), lambda: None)
    made.cflib = cflib
    return made


def block(info, height=1.0):
    return {"pm.vbatMV": 4000.0, "supervisor.info": info, "stateEstimateZ.z": 1000.0 * height}


def flying(vehicle):
    vehicle.request(Request(DO_SET_MODE), 0.0)
    vehicle.request(Request(ARM_DISARM, 1.0), 0.0)
    vehicle.note(block(ARMED | FLYING), 1.0)
    return vehicle


def test_arming_is_the_supervisors_and_setpoints_are_ours(vehicle):
    assert vehicle.autopilot is None
    found = flying(vehicle).autopilot
    assert vehicle.cflib.supervisor.send_arming_request.mock_calls == [call(True)]
    assert (found.control, found.armed, found.mode) == (Control.OURS, True, "SETPOINTS")


def test_the_zero_setpoint_stands_the_rotors_and_a_manual_one_holds_angles(vehicle):
    vehicle.idle()
    vehicle.fly(Manual(1.0, 2.0, 3.0, 40.0))
    assert vehicle.cflib.commander.mock_calls == [
        call.send_setpoint(0.0, 0.0, 0.0, 0),
        call.send_setpoint_manual(1.0, 2.0, 3.0, 40.0, rate=False),
    ]


def test_setpoints_are_ended_before_the_landing_that_takes_its_time(vehicle):
    flying(vehicle).request(Request(NAV_LAND), 2.0)
    names = [name for name, *_ in vehicle.cflib.mock_calls]
    assert names[-2:] == ["commander.send_notify_setpoint_stop", "high_level_commander.land"]
    assert vehicle.cflib.high_level_commander.land.mock_calls == [call(0.0, 4.0, yaw=None)]
    vehicle.request(Request(NAV_LAND), 0.01)
    assert vehicle.cflib.high_level_commander.land.call_args == call(0.0, 1.0, yaw=None)
    assert vehicle.autopilot.control == Control.LANDING


def test_another_commander_has_the_vehicle_and_a_fault_disarms(vehicle):
    flying(vehicle).note(block(ARMED | FLYING | HIGH_LEVEL), 2.0)
    assert vehicle.autopilot.control == Control.OTHER
    vehicle.note(block(ARMED | TUMBLED), 3.0)
    found = vehicle.autopilot
    assert (found.armed, found.failsafe, found.reasons) == (False, True, ("tumbled",))


def test_it_is_disarmed_once_it_has_landed_and_never_before(vehicle):
    flying(vehicle).request(Request(NAV_LAND), 1.0)
    vehicle.note(block(ARMED | FLYING, 0.5), 2.0)
    vehicle.note(block(ARMED, 0.01), 2.4)
    assert call(False) not in vehicle.cflib.supervisor.send_arming_request.mock_calls
    vehicle.note(block(ARMED, 0.01), 2.6)
    assert vehicle.cflib.supervisor.send_arming_request.mock_calls[-1] == call(False)
    assert vehicle.cflib.high_level_commander.stop.called


def test_the_link_is_closed_without_a_setpoint_that_would_drop_it(vehicle):
    link = vehicle.cflib.link
    vehicle.close()
    assert link.close.called
    assert not vehicle.cflib.close_link.called


@pytest.mark.parametrize(("version", "is_flown"), [(9, False), (10, True), (12, True)])
def test_firmware_that_drops_manual_setpoints_is_refused_by_name(vehicle, version, is_flown):
    vehicle.cflib.platform.get_protocol_version.return_value = version
    vehicle._on_connected("radio://0")
    assert vehicle.cflib.log.add_config.called == is_flown
    assert ("firmware 2025.09" in vehicle.problem) != is_flown
