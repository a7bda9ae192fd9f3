"""The way to the flight and back, against an autopilot of a few lines that may refuse, be late, or be taken away."""

import math

import pytest

from quad_autopilot import arming
from quad_autopilot.arming import Inputs, Phase, Setpoint
from quad_autopilot.autopilot import COMMANDS, DO_SET_MODE, Ack, Autopilot, Control, Profile, Request
from quad_core.autopilot_parameters import ArmingParameters

TICK = 0.02
PARAMETERS = ArmingParameters()
MODE, ARM, LAND = 176, 400, 21
PROFILE = Profile(
    "PX4", "offboard", "vehicle_status", "vehicle_odometry", "where is its agent?", Request(DO_SET_MODE, 1.0, 6.0)
)
OURS = {14: Control.OURS, 18: Control.LANDING}
NAMES = {2: "POSCTL", 15: "STAB", 18: "AUTO_LAND"}


def said(nav_state, arming_state, failsafe=False, checks_pass=True, reasons=""):
    """Return what an autopilot in a mode says, by PX4's numbers."""
    name, control = NAMES.get(nav_state, f"mode {nav_state}"), OURS.get(nav_state, Control.OTHER)
    return Autopilot(name, control, arming_state == 2, failsafe, checks_pass, reasons)


class Flight:
    """Runs the sequence beside a simple autopilot, which obeys after two ticks unless told otherwise."""

    def __init__(self, **px4):
        self.now, self.autopilot_time = 100.0, 7.0
        self.nav_state, self.arming_state, self.silent = 4, 1, False
        self.results = {}  # {command: result}
        self.lost, self.deaf, self.reasons, self.failsafe = set(), set(), "", False
        self.inputs = {"command_age": 0.0, "state_age": 0.0}
        self.memory, self.output, self.requests, self.phases, self.due = arming.Memory(), None, [], [], []
        for name, value in px4.items():
            setattr(self, name, value)

    def obey(self, request):
        result = self.results.get(request.command, 0)
        if request.command in self.deaf:
            return None
        if result == 0:
            if request.command == MODE:
                self.nav_state = 14
            elif request.command == ARM:
                self.arming_state = 2
            else:
                self.nav_state = 18
        return None if request.command in self.lost else Ack(request.command, result)

    def tick(self, **inputs):
        told = said(self.nav_state, self.arming_state, self.failsafe, True, self.reasons)
        autopilot = None if self.silent else told
        ack = None
        if self.due and self.due[0][0] <= self.now:
            ack = self.obey(self.due.pop(0)[1])
        given = Inputs(self.now, self.autopilot_time, autopilot, ack, **{**self.inputs, **inputs})
        self.output, self.memory = arming.step(PROFILE, PARAMETERS, self.memory, given)
        if self.output.request:
            self.requests.append((self.now, self.output.request))
            self.due.append((self.now + 2 * TICK, self.output.request))
        if not self.phases or self.phases[-1] != self.output.phase:
            self.phases.append(self.output.phase)
        self.now += TICK
        self.autopilot_time += TICK
        return self.output

    def run(self, until, longest=30.0, **inputs):
        end = self.now + longest
        while self.tick(**inputs).phase != until:
            assert self.now < end, (self.output, self.memory)
        return self.output


def flying(**px4):
    flight = Flight(**px4)
    flight.run(Phase.FLY)
    return flight


def asked(flight):
    return [request.command for _, request in flight.requests]


def test_from_the_ground_to_the_ground():
    flight = Flight()
    began = flight.now
    flight.run(Phase.FLY)
    assert flight.phases == [Phase.STREAM, Phase.MODE, Phase.ARM, Phase.SPOOL_UP, Phase.FLY]
    first = flight.requests[0][0] - began
    assert first >= 20 * TICK - 1e-9  # PX4 wants a stream before it takes the mode
    assert flight.requests[0][1][:3] == (MODE, 1.0, 6.0)
    assert flight.requests[1][1][:2] == (ARM, 1.0)
    assert flight.now - flight.requests[1][0] >= 1.0  # COM_SPOOLUP_TIME
    for _ in range(50):
        output = flight.tick()
        assert (output.heartbeat, output.setpoint, output.request) == (True, Setpoint.COMMAND, None)
    flight.inputs["ended"] = True
    assert flight.tick().heartbeat  # until PX4 has taken over
    while flight.nav_state != 18:
        flight.tick()
    output = flight.tick()
    assert (output.phase, output.heartbeat, output.setpoint) == (Phase.LAND, False, Setpoint.NONE)
    flight.arming_state = 1
    output = flight.run(Phase.LANDED)
    assert (output.failed, output.reason) == (False, "")
    assert asked(flight) == [MODE, ARM, LAND]


def test_until_the_flight_the_rotors_are_told_to_idle():
    flight = Flight()
    while flight.tick().phase != Phase.FLY:
        assert (flight.output.heartbeat, flight.output.setpoint) == (True, Setpoint.IDLE)


@pytest.mark.parametrize("command", [MODE, ARM])
@pytest.mark.parametrize(("result", "word"), [(1, "temporarily rejected"), (2, "denied"), (9, "result 9")])
def test_a_denial_ends_with_its_reason(command, result, word):
    flight = Flight(results={command: result}, reasons="local_position_invalid")
    output = flight.run(Phase.RELEASED)
    assert output.failed
    assert word in output.reason
    assert "local_position_invalid" in output.reason
    assert COMMANDS[command] in output.reason
    assert not output.heartbeat
    assert asked(flight).count(command) > 5
    assert LAND not in asked(flight)


def test_a_denial_that_passes_is_overcome():
    flight = Flight(results={ARM: 1})
    flight.run(Phase.ARM)
    for _ in range(100):
        flight.tick()
    flight.results = {}
    flight.run(Phase.FLY)


def test_a_lost_answer_costs_nothing_for_the_state_counts():
    flight = Flight(lost={MODE, ARM})
    flight.run(Phase.FLY)
    assert asked(flight) == [MODE, ARM]


def test_no_answer_names_the_target():
    output = Flight(deaf={MODE}).run(Phase.RELEASED)
    assert "never acknowledged" in output.reason
    assert "target_system" in output.reason


def test_an_answer_in_progress_or_to_another_command_is_none():
    flight = Flight()
    flight.run(Phase.MODE)
    flight.due.clear()
    for ack in (Ack(MODE, 5), Ack(LAND, 2)):
        given = Inputs(flight.now, flight.autopilot_time, said(4, 1), ack, 0.0, 0.0)
        assert arming.step(PROFILE, PARAMETERS, flight.memory, given)[1].answer == ""


def test_without_status_or_odometry_nothing_is_asked():
    for px4, inputs, word in (
        ({"silent": True}, {}, "vehicle_status"),
        ({}, {"state_age": math.inf}, "vehicle_odometry"),
    ):
        flight = Flight(**px4)
        output = flight.run(Phase.RELEASED, **inputs)
        assert word in output.reason
        assert flight.requests == []


def test_what_does_not_fit_refuses_arming_with_the_numbers():
    flight = Flight()
    output = flight.run(Phase.RELEASED, refusal="states 8 ms to 12 ms apart")
    assert output.reason == "arming refused: states 8 ms to 12 ms apart"
    assert flight.requests == []


def test_a_vehicle_that_is_armed_already_is_left_alone():
    flight = Flight(arming_state=2, nav_state=2)
    output = flight.run(Phase.RELEASED)
    assert "armed already, in POSCTL" in output.reason
    assert flight.requests == []


def test_the_heartbeat_stops_within_100_ms_of_the_last_command_and_px4_lands():
    flight = flying()
    last_command = flight.now
    beats = []
    while flight.now < last_command + 1.0:
        if flight.tick(command_age=flight.now - last_command).heartbeat:
            beats.append(flight.now)
    assert beats[-1] - last_command <= 0.1
    land = [at for at, request in flight.requests if request.command == LAND]
    assert land[0] - last_command <= 0.1
    flight.arming_state = 1
    output = flight.run(Phase.LANDED)
    assert output.failed
    assert "no command for" in output.reason


def test_a_command_that_comes_back_does_not_take_the_vehicle_back():
    flight = flying(deaf={LAND})
    flight.tick(command_age=0.2)
    output = flight.tick(command_age=0.0)
    assert (output.phase, output.heartbeat, output.setpoint) == (Phase.LAND, False, Setpoint.LEVEL)


def test_the_first_command_may_take_longer_but_not_for_ever():
    flight = Flight()
    flight.run(Phase.FLY)
    began = flight.now
    while flight.tick(command_age=math.inf).phase == Phase.FLY:
        assert flight.output.setpoint == Setpoint.IDLE
        assert flight.output.heartbeat
    assert flight.now - began == pytest.approx(PARAMETERS.first_command, abs=0.1)


@pytest.mark.parametrize(("nav_state", "name"), [(2, "POSCTL"), (15, "STAB"), (18, "AUTO_LAND"), (99, "mode 99")])
@pytest.mark.parametrize("failsafe", [True, False])
def test_who_takes_the_mode_has_it(nav_state, name, failsafe):
    flight = flying()
    before = len(flight.requests)
    flight.nav_state, flight.failsafe = nav_state, failsafe
    output = flight.tick()
    assert (output.phase, output.heartbeat, output.setpoint) == (Phase.RELEASED, False, Setpoint.NONE)
    assert name in output.reason
    assert ("failsafe" in output.reason) == failsafe
    flight.nav_state = 14  # and never asks back
    for _ in range(100):
        assert not flight.tick().heartbeat
    assert len(flight.requests) == before


def test_a_pilot_may_take_over_while_arming_and_while_landing():
    flight = Flight()
    flight.run(Phase.SPOOL_UP)
    flight.nav_state = 2
    assert "POSCTL" in flight.run(Phase.RELEASED, 0.1).reason
    flight = flying()
    flight.inputs["ended"] = True
    flight.run(Phase.LAND)
    flight.nav_state, flight.due = 2, []
    output = flight.run(Phase.RELEASED, 0.1)
    assert output.failed
    assert "while landing" in output.reason


def test_a_disarmed_vehicle_ends_the_flight():
    flight = flying()
    flight.arming_state = 1
    assert "disarmed in flight" in flight.run(Phase.RELEASED, 0.1).reason
    flight = Flight()
    flight.run(Phase.SPOOL_UP)
    flight.arming_state = 1
    assert "spooled up" in flight.run(Phase.RELEASED, 0.1).reason


def test_lost_odometry_and_a_wish_to_stop_land():
    for inputs, word in (({"state_age": 0.3}, "vehicle_odometry"), ({"stop": "stopped by SIGINT"}, "SIGINT")):
        flight = flying()
        flight.run(Phase.LAND, 0.1, **inputs)
        flight.arming_state = 1
        output = flight.run(Phase.LANDED, 1.0)
        assert output.failed
        assert word in output.reason


def test_a_wish_to_stop_on_the_ground_needs_no_landing():
    flight = Flight()
    flight.run(Phase.MODE)
    assert flight.tick(stop="stopped by SIGINT").reason == "stopped by SIGINT"
    assert flight.output.phase == Phase.RELEASED
    assert LAND not in asked(flight)


def test_a_landing_that_does_not_end_is_left_to_px4():
    flight = flying(results={LAND: 2})
    output = flight.run(Phase.RELEASED, 2 * PARAMETERS.land_timeout, ended=True)
    assert output.failed
    assert "NAV_LAND denied" in output.reason


def test_the_clock_of_the_spool_up_is_px4s():
    flight = Flight()
    flight.run(Phase.SPOOL_UP)
    frozen = flight.autopilot_time
    for _ in range(200):
        flight.autopilot_time = frozen
        assert flight.tick().phase == Phase.SPOOL_UP
