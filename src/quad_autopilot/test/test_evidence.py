"""The way to the flight and back where a commander says what the flight wants of the autopilot."""

import pytest
from sequence_flights import ARM, LAND, MODE, PROFILE, Flight, asked

from quad_autopilot.arming import Setpoint
from quad_autopilot.autopilot import FORCE
from quad_autopilot.evidence import Intent, Phase

TAKEOFF = 22


class Commanded(Flight):
    """A flight whose autopilot takes off by itself if it is asked to, and disarms when it is told."""

    def obey(self, request):
        if request.command == TAKEOFF:
            self.nav_state = 17
            return None
        if request.command == ARM and request.param1 == 0.0:
            refused = not self.landed and request.param2 != FORCE
            self.arming_state = 2 if refused else 1
            return None
        return super().obey(request)

    landed = True

    def stream(self):
        return {"landed": self.landed}


def reach(flight, intent, phase, longest=15.0):
    return flight.run(phase, longest, intent=intent)


def airborne():
    flight = Commanded()
    reach(flight, Intent.GROUND, Phase.STANDBY)
    reach(flight, Intent.IDLE, Phase.FLY)
    flight.landed = False
    flight.tick(intent=Intent.FLY)
    return flight


def test_it_stands_by_until_it_is_to_arm_and_idles_until_it_is_to_fly():
    flight = Commanded()
    reach(flight, Intent.GROUND, Phase.STANDBY)
    for _ in range(200):
        output = flight.tick(intent=Intent.GROUND)
        assert (output.phase, output.heartbeat, output.setpoint) == (Phase.STANDBY, True, Setpoint.IDLE)
    assert flight.requests == []
    reach(flight, Intent.IDLE, Phase.FLY)
    assert asked(flight) == [MODE, ARM]
    output = flight.tick(intent=Intent.IDLE)
    assert (output.heartbeat, output.setpoint) == (True, Setpoint.IDLE)
    assert flight.tick(intent=Intent.FLY).setpoint == Setpoint.COMMAND


@pytest.mark.parametrize("intent", [Intent.GROUND, Intent.KILL])
def test_a_flight_that_the_commander_ends_on_the_ground_is_over(intent):
    flight = Commanded()
    reach(flight, Intent.GROUND, Phase.STANDBY)
    output = flight.run(Phase.LANDED, 0.1, intent=intent, is_over=True)
    assert (output.reason, output.heartbeat, flight.requests) == ("", False, [])


def test_an_autopilot_that_disarms_while_it_waits_for_the_take_off_is_not_told_as_one_in_flight():
    flight = Commanded(profile=PROFILE._replace(idle_hint="(COM_DISARM_PRFLT?)"))
    reach(flight, Intent.IDLE, Phase.FLY)
    flight.arming_state = 1
    output = flight.run(Phase.RELEASED, 0.1, intent=Intent.IDLE, refusal="tilt: found 20 deg")
    assert output.reason == "PX4 disarmed before the take-off (COM_DISARM_PRFLT?); tilt: found 20 deg"


def test_an_autopilot_that_does_not_stop_its_motors_is_left_alone_in_the_end():
    for said, words in (({}, "does not stop its motors"), ({"silence": 6.0}, "its motors may still turn")):
        flight = airborne()
        flight.deaf = {ARM}
        flight.obey = lambda _: None
        assert words in flight.run(Phase.RELEASED, 70.0, intent=Intent.KILL, **said).reason


def test_arming_that_is_given_up_disarms():
    flight = Commanded()
    reach(flight, Intent.IDLE, Phase.SPOOL_UP)
    reach(flight, Intent.GROUND, Phase.DISARM, 0.1)
    assert not reach(flight, Intent.GROUND, Phase.LANDED, 1.0).reason
    assert flight.arming_state == 1


def test_after_a_landing_of_ours_it_disarms_and_that_is_a_good_end():
    flight = airborne()
    flight.landed = True
    output = reach(flight, Intent.GROUND, Phase.LANDED, 1.0)
    assert output.reason == ""
    assert LAND not in asked(flight)


def test_an_autopilot_that_sees_no_ground_lands_by_itself_and_nothing_stops_in_the_air():
    flight = airborne()
    output = reach(flight, Intent.GROUND, Phase.LAND, 5.0)
    assert "does not disarm" in output.reason
    # the commander's link is disarmed: its commands give no thrust, whereas LEVEL carries the vehicle's weight
    assert (output.heartbeat, output.setpoint) == (True, Setpoint.COMMAND)
    assert flight.arming_state == 2
    assert asked(flight)[-1] == LAND
    assert all(request.param2 != FORCE for _, request in flight.requests if request.command == ARM)
    flight.arming_state = 1
    assert reach(flight, Intent.GROUND, Phase.LANDED, 1.0).reason


def test_a_landing_of_its_own_is_no_failure():
    flight = airborne()
    reach(flight, Intent.LAND, Phase.LAND, 0.1)
    flight.arming_state = 1
    output = reach(flight, Intent.LAND, Phase.LANDED, 1.0)
    assert output.reason == ""


def test_a_kill_disarms_in_the_air_and_sends_no_heartbeat():
    flight = airborne()
    assert not flight.tick(intent=Intent.KILL).heartbeat
    reach(flight, Intent.KILL, Phase.LANDED, 1.0)
    assert flight.arming_state == 1
    assert flight.requests[-1][1].param2 == FORCE


def test_its_own_take_off_is_waited_for_and_then_it_follows_us():
    flight = Commanded()
    reach(flight, Intent.GROUND, Phase.STANDBY)
    reach(flight, Intent.IDLE, Phase.FLY)
    output = reach(flight, Intent.CLIMB, Phase.CLIMB, 0.1)
    assert output.setpoint == Setpoint.IDLE  # on the ground no command of ours lifts it
    for _ in range(50):
        flight.tick(intent=Intent.CLIMB)
    assert flight.output.phase == Phase.CLIMB
    flight.nav_state, flight.landed = 4, False
    assert reach(flight, Intent.CLIMB, Phase.RETURN, 0.1).setpoint == Setpoint.COMMAND
    reach(flight, Intent.FLY, Phase.FLY, 1.0)
    assert flight.tick(intent=Intent.FLY).setpoint == Setpoint.COMMAND
    assert asked(flight) == [MODE, ARM, TAKEOFF, MODE]


@pytest.mark.parametrize("nav_state", [2, 15])
def test_a_pilot_may_take_over_during_its_take_off(nav_state):
    flight = Commanded()
    reach(flight, Intent.IDLE, Phase.FLY)
    reach(flight, Intent.CLIMB, Phase.CLIMB, 0.1)
    flight.tick(intent=Intent.CLIMB)
    flight.nav_state, flight.due = nav_state, []
    output = reach(flight, Intent.CLIMB, Phase.RELEASED, 0.1)
    assert "during its take-off" in output.reason


def test_a_landing_asked_for_during_its_take_off_is_its_own():
    flight = Commanded()
    reach(flight, Intent.IDLE, Phase.FLY)
    reach(flight, Intent.CLIMB, Phase.CLIMB, 0.1)
    reach(flight, Intent.LAND, Phase.LAND, 0.1)
    assert PROFILE.name in flight.memory.reason
