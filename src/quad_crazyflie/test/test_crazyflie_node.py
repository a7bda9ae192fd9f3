"""What is asked of cflib, and whose the vehicle is, without a Crazyflie."""

from unittest.mock import Mock, call

import pytest

from quad_autopilot.arming import Output, Setpoint
from quad_autopilot.autopilot import ARM_DISARM, DO_SET_MODE, NAV_LAND, Control, Request
from quad_autopilot.evidence import Phase
from quad_core.parameters import ParameterError
from quad_core.types import AttitudeThrust, Vec3, VehicleState
from quad_crazyflie import node as module
from quad_crazyflie import setpoints
from quad_crazyflie.parameters import CrazyflieBridgeParameters

ARMED, FLYING, TUMBLED, HIGH_LEVEL = 2, 16, 32, 256
SETTINGS = CrazyflieBridgeParameters(max_rotor_thrust=0.15, landing_speed=0.5)


@pytest.fixture
def vehicle(monkeypatch):
    cflib = Mock()
    monkeypatch.setattr(module, "load", lambda: (Mock(CLASSES=[1]), lambda: cflib, Mock()))
    flight = Mock(settings=SETTINGS, state=VehicleState(), said=None, stop="", **{"clock.return_value": 0.0})
    flight.lift.ground_z = 0.0
    monkeypatch.setattr(module, "AutopilotFlight", lambda *_, **__: flight)
    made = module.CrazyflieBridge()
    made.cflib = cflib
    return made


def test_a_thrust_that_was_not_measured_is_refused_with_the_page_of_a_crazyflie(monkeypatch):
    flight = Mock(settings=CrazyflieBridgeParameters())
    monkeypatch.setattr(module, "AutopilotFlight", lambda *_, **__: flight)
    with pytest.raises(ParameterError, match=r"^max_rotor_thrust: found 0\.0, .*; docs/how_to/crazyflie\.md$"):
        module.CrazyflieBridge()


def block(info, height=1.0):
    return {"pm.vbatMV": 4000.0, "supervisor.info": info, "stateEstimateZ.z": 1000.0 * height}


def note(vehicle, now, *given):
    """Take a block at ``now`` s."""
    vehicle.flight.clock = lambda: now
    vehicle.note(block(*given))


def land(vehicle, height):
    vehicle.flight.state = VehicleState(p_w=Vec3(0.0, 0.0, height))
    vehicle.request(Request(NAV_LAND))


def flying(vehicle):
    vehicle.request(Request(DO_SET_MODE))
    vehicle.request(Request(ARM_DISARM, 1.0))
    note(vehicle, 1.0, ARMED | FLYING)
    return vehicle


def test_arming_is_the_supervisors_and_setpoints_are_ours(vehicle):
    assert vehicle.flight.said is None
    found = flying(vehicle).flight.said
    assert vehicle.cflib.supervisor.send_arming_request.mock_calls == [call(True)]
    assert (found.control, found.armed, found.mode) == (Control.OURS, True, "SETPOINTS")


def test_the_zero_setpoint_stands_the_rotors_and_a_manual_one_holds_angles(vehicle):
    asked = AttitudeThrust(thrust=0.3)
    vehicle.flight.step.return_value = Output(Phase.ARM, True, Setpoint.IDLE, None, "")
    vehicle.step()
    vehicle.send_attitude(asked, VehicleState())
    assert vehicle.cflib.commander.mock_calls == [
        call.send_setpoint(0.0, 0.0, 0.0, 0),
        call.send_setpoint_manual(*setpoints.manual(SETTINGS, asked, VehicleState()), rate=False),
    ]


def test_setpoints_are_ended_before_the_landing_that_takes_its_time(vehicle):
    land(flying(vehicle), 2.0)
    names = [name for name, *_ in vehicle.cflib.mock_calls]
    assert names[-2:] == ["commander.send_notify_setpoint_stop", "high_level_commander.land"]
    assert vehicle.cflib.high_level_commander.land.mock_calls == [call(0.0, 4.0, yaw=None)]
    land(vehicle, 0.01)
    assert vehicle.cflib.high_level_commander.land.call_args == call(0.0, 1.0, yaw=None)
    assert vehicle.flight.said.control == Control.LANDING


def test_another_commander_has_the_vehicle_and_a_fault_disarms(vehicle):
    note(flying(vehicle), 2.0, ARMED | FLYING | HIGH_LEVEL)
    assert vehicle.flight.said.control == Control.OTHER
    note(vehicle, 3.0, ARMED | TUMBLED)
    found = vehicle.flight.said
    assert (found.armed, found.failsafe, found.reasons) == (False, True, ("tumbled",))


def test_the_stamps_of_its_blocks_begin_again_and_those_of_its_states_do_not(vehicle):
    stamps = [(1 << 24) - 20, (1 << 24) - 10, 0, 10]
    vehicle.blocks.extend((stamp, {**dict.fromkeys(setpoints.BLOCK, 0.0), **block(ARMED)}) for stamp in stamps)
    vehicle.read()
    taken = [given.args[0].timestamp_sample for given in vehicle.flight.take.mock_calls]
    assert [later - taken[0] for later in taken] == [0, 10_000, 20_000, 30_000]
    assert taken[0] > 0


def test_it_is_disarmed_once_it_has_landed_and_never_before(vehicle):
    land(flying(vehicle), 1.0)
    note(vehicle, 2.0, ARMED | FLYING, 0.5)
    note(vehicle, 2.4, ARMED, 0.01)
    assert call(False) not in vehicle.cflib.supervisor.send_arming_request.mock_calls
    note(vehicle, 2.6, ARMED, 0.01)
    assert vehicle.cflib.supervisor.send_arming_request.mock_calls[-1] == call(False)
    assert vehicle.cflib.high_level_commander.stop.called


def test_the_link_is_closed_without_a_setpoint_that_would_drop_it(vehicle):
    link = vehicle.cflib.link
    vehicle.shut_down()
    assert link.close.called
    assert not vehicle.cflib.close_link.called


@pytest.mark.parametrize(("version", "is_flown"), [(9, False), (10, True), (12, True)])
def test_firmware_that_drops_manual_setpoints_is_refused_by_name(vehicle, version, is_flown):
    vehicle.cflib.platform.get_protocol_version.return_value = version
    vehicle._on_connected("radio://0")
    assert vehicle.cflib.log.add_config.called == is_flown
    assert ("firmware 2025.09" in vehicle.problem) != is_flown
