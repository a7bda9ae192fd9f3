"""The way to the flight and back, against an autopilot of a few lines that may refuse, be late, or be taken away."""

import math

import pytest
from sequence_flights import ARM, LAND, MODE, PARAMETERS, PROFILE, TICK, UNSAID, Flight, asked, flying, said

from quad_autopilot import arming
from quad_autopilot.arming import Setpoint
from quad_autopilot.autopilot import COMMANDS, Ack, Request
from quad_autopilot.evidence import PROBE_PATIENCE, Inputs, Intent, Phase

LOSSY = PROFILE._replace(loss_limit=0.25, loss_advice="set COM_OF_LOSS_T to 0.1")


def test_from_the_ground_to_the_ground():
    flight = Flight()
    began = flight.now
    while flight.tick().phase != Phase.FLY:
        assert (flight.output.heartbeat, flight.output.setpoint) == (True, Setpoint.IDLE)
    assert flight.phases == [Phase.STREAM, Phase.STANDBY, Phase.MODE, Phase.ARM, Phase.SPOOL_UP, Phase.FLY]
    first = flight.requests[0][0] - began
    assert first >= 20 * TICK - 1e-9  # PX4 wants a stream before it takes the mode
    assert flight.requests[0][1][:3] == (MODE, 1.0, 6.0)
    assert flight.requests[1][1][:2] == (ARM, 1.0)
    assert flight.now - flight.requests[1][0] >= 1.0  # COM_SPOOLUP_TIME
    for _ in range(50):
        output = flight.tick()
        assert (output.heartbeat, output.setpoint, output.request) == (True, Setpoint.COMMAND, None)
    flight.inputs["intent"] = Intent.LAND
    assert flight.tick().heartbeat  # until PX4 has taken over
    while flight.nav_state != 18:
        flight.tick()
    output = flight.tick()
    assert (output.phase, output.heartbeat, output.setpoint) == (Phase.LAND, False, Setpoint.NONE)
    flight.arming_state = 1
    output = flight.run(Phase.LANDED)
    assert output.reason == ""
    assert asked(flight) == [MODE, ARM, LAND]


HOLDS = PROFILE._replace(hold=Request(MODE, 1.0, 4.0, 3.0))


@pytest.mark.parametrize(("profile", "deaf", "phases", "requests", "words"), [
    (HOLDS, (), [Phase.HAND_BACK, Phase.RELEASED], [MODE], "too fast; PX4 was asked to hold its place"),
    (HOLDS, {MODE}, [Phase.HAND_BACK, Phase.LAND], [MODE, MODE, LAND], "PX4 does not hold its place"),
    (PROFILE, (), [Phase.LAND], [LAND], "too fast; PX4 lands"),
])  # fmt: skip
def test_beyond_a_limit_of_the_step_the_vehicle_is_handed_back_at_once(profile, deaf, phases, requests, words):
    flight = flying(profile=profile)
    flight.requests.clear()
    flight.phases.clear()
    flight.deaf = deaf
    output = flight.tick(broken_limit="too fast")
    assert (output.heartbeat, output.setpoint) == (False, Setpoint.NONE if profile is HOLDS else Setpoint.LEVEL)
    flight.run(phases[-1], broken_limit="too fast")
    assert (flight.phases, asked(flight)) == (phases, requests)
    assert words in flight.output.reason


@pytest.mark.parametrize("command", [MODE, ARM])
@pytest.mark.parametrize(("result", "word"), [(1, "temporarily rejected"), (2, "denied"), (9, "result 9")])
def test_a_denial_ends_with_its_reason(command, result, word):
    flight = Flight(results={command: result}, reasons=("local_position_invalid",))
    output = flight.run(Phase.RELEASED)
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


def test_the_flight_begins_once_the_estimate_rests_however_long_that_takes():
    flight = Flight()
    for _ in range(round(30.0 / TICK)):
        assert flight.tick(moves=True, intent=Intent.GROUND).phase == Phase.STREAM
    flight.run(Phase.STANDBY, 0.1, intent=Intent.GROUND)


GROUNDED = {
    "no status": ({"silent": True}, {}, "vehicle_status"),
    "no states": ({}, {"state_age": math.inf}, "vehicle_odometry"),
    "misfit": ({}, {"refusal": "states 8 ms to 12 ms apart"}, "arming refused: states 8 ms to 12 ms apart"),
    "armed": ({"arming_state": 2, "nav_state": 2}, {}, "armed already, in POSCTL"),
}


@pytest.mark.parametrize("name", GROUNDED)
def test_what_speaks_against_a_flight_is_named_and_nothing_is_asked(name):
    px4, inputs, words = GROUNDED[name]
    flight = Flight(**px4)
    output = flight.run(Phase.RELEASED, **inputs)
    assert words in output.reason
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
    assert "no command for" in output.reason


def test_a_command_that_comes_back_does_not_take_the_vehicle_back():
    flight = flying(deaf={LAND})
    flight.tick(command_age=0.2)
    output = flight.tick(command_age=0.0)
    assert (output.phase, output.heartbeat, output.setpoint) == (Phase.LAND, False, Setpoint.LEVEL)


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


def test_a_mode_that_was_taken_away_is_left_before_it_is_known_who_has_it():
    flight = flying()
    before = len(flight.requests)
    flight.nav_state = UNSAID
    for stop in ("", "stopped by SIGINT", ""):  # a landing would take the vehicle from its pilot
        output = flight.tick(stop=stop, command_age=1.0, intent=Intent.LAND)
        assert (output.phase, output.heartbeat, output.setpoint) == (Phase.FLY, False, Setpoint.NONE)
    flight.nav_state = 2
    output = flight.tick()
    assert output.phase == Phase.RELEASED
    assert "took the vehicle in flight: mode POSCTL" in output.reason
    assert len(flight.requests) == before


@pytest.mark.parametrize("phase", [Phase.ARM, Phase.SPOOL_UP, Phase.FLY])
def test_a_mode_that_comes_back_is_not_ours_again(phase):
    flight = Flight(deaf={ARM} if phase == Phase.ARM else set())
    flight.run(phase)
    flight.nav_state = UNSAID
    output = flight.tick(stop="stopped by SIGINT")
    assert (output.heartbeat, output.setpoint, output.request) == (False, Setpoint.NONE, None)
    flight.nav_state = 14
    output = flight.tick()
    assert (output.phase, output.heartbeat, output.setpoint) == (Phase.RELEASED, False, Setpoint.NONE)
    assert "took the vehicle" in output.reason


def test_a_request_that_is_due_is_not_repeated_in_a_mode_that_was_taken_away():
    flight = Flight(deaf={ARM})
    flight.run(Phase.ARM)
    asked_at = flight.requests[-1][0]
    while flight.now - asked_at < PARAMETERS.answer_timeout - 2 * TICK:
        flight.tick()
    flight.nav_state, before = UNSAID, len(flight.requests)
    for _ in range(10):
        flight.tick()
    assert flight.now - asked_at > PARAMETERS.answer_timeout
    assert len(flight.requests) == before


def test_after_a_planned_end_a_command_that_stays_away_is_not_flown_on():
    flight = flying(deaf={LAND})
    flight.run(Phase.LAND, 0.1, intent=Intent.LAND)
    output = flight.tick(intent=Intent.LAND)
    assert (output.heartbeat, output.setpoint) == (True, Setpoint.COMMAND)
    output = flight.tick(intent=Intent.LAND, command_age=0.2)
    assert (output.heartbeat, output.setpoint) == (False, Setpoint.LEVEL)


def test_a_mode_that_is_never_named_ends_the_flight_within_half_a_second():
    flight = flying()
    flight.nav_state = UNSAID
    began = flight.now
    assert "took the vehicle in flight" in flight.run(Phase.RELEASED, 1.0).reason
    assert 0.4 < flight.now - began < 0.6


def test_while_landing_nothing_is_asked_of_a_mode_without_a_name():
    flight = flying()
    flight.run(Phase.LAND, 0.1, intent=Intent.LAND)
    flight.nav_state, flight.due, before = UNSAID, [], len(flight.requests)
    for _ in range(100):
        output = flight.tick(intent=Intent.LAND)
        assert (output.phase, output.heartbeat, output.setpoint) == (Phase.LAND, False, Setpoint.NONE)
    assert len(flight.requests) == before


@pytest.mark.parametrize("nav_state", [14, 4, 18, UNSAID])
def test_a_disarmed_vehicle_ends_the_flight_and_no_pilot_took_it(nav_state):
    flight = flying()
    flight.arming_state, flight.nav_state = 1, nav_state
    assert "disarmed in flight" in flight.run(Phase.RELEASED, 0.1).reason
    assert math.isinf(flight.memory.left_at)


STOP = {"stop": "stopped by SIGINT"}
ENDS = {
    "disarmed, spooling up": (Phase.SPOOL_UP, {"arming_state": 1}, {}, Phase.RELEASED, "spooled up"),
    "pilot, arming": (Phase.SPOOL_UP, {"nav_state": 2}, {}, Phase.RELEASED, "POSCTL"),
    "pilot, landing": (Phase.LAND, {"nav_state": 2, "due": []}, {}, Phase.RELEASED, "while landing"),
    "no odometry": (Phase.FLY, {}, {"state_age": 0.3}, Phase.LAND, "vehicle_odometry"),
    "stopped": (Phase.FLY, {}, STOP, Phase.LAND, "SIGINT"),
    "stopped on the ground": (Phase.MODE, {}, STOP, Phase.RELEASED, "SIGINT"),
    "stopped, probing": (Phase.PROBE, {}, STOP, Phase.RELEASED, "SIGINT"),
    "armed by others, probing": (Phase.PROBE, {"arming_state": 2}, {}, Phase.RELEASED, "was armed in"),
}


@pytest.mark.parametrize("name", ENDS)
def test_what_ends_a_flight_is_named_and_only_a_vehicle_in_the_air_lands(name):
    phase, px4, inputs, end, word = ENDS[name]
    flight = Flight(profile=LOSSY, loss_timeout=60.0) if phase == Phase.PROBE else Flight()
    if phase == Phase.LAND:
        flight.run(Phase.FLY)
        flight.inputs["intent"] = Intent.LAND
    flight.run(phase)
    for attribute, value in px4.items():
        setattr(flight, attribute, value)
    output = flight.run(end, 0.1, **inputs)
    assert (LAND in asked(flight)) == (Phase.LAND in (phase, end))
    if end == Phase.LAND:
        flight.arming_state = 1
        output = flight.run(Phase.LANDED, 1.0)
    assert word in output.reason


def test_a_landing_that_does_not_end_is_left_to_px4():
    flight = flying(results={LAND: 2})
    output = flight.run(Phase.RELEASED, 2 * PARAMETERS.land_timeout, intent=Intent.LAND)
    assert "NAV_LAND denied" in output.reason


def test_the_clock_of_the_spool_up_is_px4s():
    flight = Flight()
    flight.run(Phase.SPOOL_UP)
    frozen = flight.autopilot_time
    for _ in range(200):
        flight.autopilot_time = frozen
        assert flight.tick().phase == Phase.SPOOL_UP


def test_before_arming_the_stream_stops_once_to_see_how_soon_the_autopilot_notices():
    flight = Flight(profile=LOSSY, loss_timeout=0.1)
    flight.run(Phase.FLY)
    assert flight.phases[:4] == [Phase.STREAM, Phase.PROBE, Phase.STREAM, Phase.STANDBY]
    assert flight.memory.noticed == pytest.approx(0.1, abs=2 * TICK)
    assert asked(flight) == [MODE, ARM]


@pytest.mark.parametrize(("loss_timeout", "word"), [(1.0, "after 0.98 s"), (60.0, "noticed not")])
def test_an_autopilot_that_flies_on_without_a_stream_is_not_armed(loss_timeout, word):
    flight = Flight(profile=LOSSY, loss_timeout=loss_timeout)
    output = flight.run(Phase.RELEASED)
    assert word in output.reason
    assert "expected within 0.25 s: set COM_OF_LOSS_T to 0.1" in output.reason
    assert flight.requests == []


def test_an_autopilot_that_says_nothing_of_the_stream_is_armed_after_a_while():
    flight = Flight(profile=LOSSY)
    began = flight.now
    flight.run(Phase.MODE)
    assert flight.now - began == pytest.approx(PROBE_PATIENCE + 2 * 25 * TICK, abs=0.2)


def test_reasons_that_stood_when_the_flight_began_do_not_explain_a_take_over():
    flight = flying(reasons=("manual_control_signal_lost", "gcs_connection_lost"))
    flight.nav_state = 2
    assert flight.tick().reason == "a pilot or PX4 took the vehicle in flight: mode POSCTL"
    flight = flying(reasons=("gcs_connection_lost",))
    flight.nav_state, flight.reasons, flight.failsafe = 18, ("gcs_connection_lost", "battery_low"), True
    assert flight.tick().reason == "PX4's failsafe took the vehicle in flight: mode AUTO_LAND (battery_low)"


def test_a_landing_of_which_nothing_is_heard_is_not_waited_for():
    flight = flying(deaf={LAND})
    flight.run(Phase.LAND, 0.1, state_age=0.3)
    began = flight.now
    while flight.tick(state_age=1.0, silence=flight.now - began + 0.3).phase == Phase.LAND:
        pass
    assert "nothing heard from PX4 for 5 s" in flight.output.reason
    assert "still armed" not in flight.output.reason
    assert flight.now - began < 6.0


def test_a_late_notice_on_a_busy_machine_is_measured_again():
    flight = Flight(profile=LOSSY, loss_timeout=0.4)
    flight.run(Phase.PROBE)
    while flight.memory.phase == Phase.PROBE:
        flight.tick()
    flight.loss_timeout = 0.1
    flight.run(Phase.FLY)
    assert (flight.memory.probes, flight.memory.noticed < 0.2) == (2, True)
