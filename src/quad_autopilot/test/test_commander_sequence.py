"""The way to the flight and back where a commander says what the flight wants of the autopilot."""

import pytest
from sequence_flights import ARM, LAND, MODE, PROFILE, Flight, asked

from quad_autopilot.arming import Phase, Setpoint, Wish
from quad_autopilot.autopilot import FORCE

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


def reach(flight, wish, phase, longest=15.0):
    return flight.run(phase, longest, wish=wish)


def airborne():
    flight = Commanded()
    reach(flight, Wish.GROUND, Phase.STANDBY)
    reach(flight, Wish.IDLE, Phase.FLY)
    flight.landed = False
    flight.tick(wish=Wish.FLY)
    return flight


def test_it_stands_by_until_it_is_to_arm_and_idles_until_it_is_to_fly():
    flight = Commanded()
    reach(flight, Wish.GROUND, Phase.STANDBY)
    for _ in range(200):
        output = flight.tick(wish=Wish.GROUND)
        assert (output.phase, output.heartbeat, output.setpoint) == (Phase.STANDBY, True, Setpoint.IDLE)
    assert flight.requests == []
    reach(flight, Wish.IDLE, Phase.FLY)
    assert asked(flight) == [MODE, ARM]
    output = flight.tick(wish=Wish.IDLE)
    assert (output.heartbeat, output.setpoint) == (True, Setpoint.IDLE)
    assert flight.tick(wish=Wish.FLY).setpoint == Setpoint.COMMAND


@pytest.mark.parametrize("wish", [Wish.GROUND, Wish.KILL])
def test_a_flight_that_the_commander_ends_on_the_ground_is_over(wish):
    flight = Commanded()
    reach(flight, Wish.GROUND, Phase.STANDBY)
    output = flight.run(Phase.LANDED, 0.1, wish=wish, is_over=True)
    assert (output.reason, output.heartbeat, flight.requests) == ("", False, [])


def test_an_autopilot_that_disarms_while_it_waits_for_the_take_off_is_not_told_as_one_in_flight():
    flight = Commanded(profile=PROFILE._replace(idle_hint="(COM_DISARM_PRFLT?)"))
    reach(flight, Wish.IDLE, Phase.FLY)
    flight.arming_state = 1
    output = flight.run(Phase.RELEASED, 0.1, wish=Wish.IDLE, refusal="tilt: found 20 deg")
    assert output.reason == "PX4 disarmed before the take-off (COM_DISARM_PRFLT?); tilt: found 20 deg"


def test_an_autopilot_that_does_not_stop_its_motors_is_left_alone_in_the_end():
    for said, words in (({}, "does not stop its motors"), ({"silence": 6.0}, "its motors may still turn")):
        flight = airborne()
        flight.deaf = {ARM}
        flight.obey = lambda _: None
        assert words in flight.run(Phase.RELEASED, 70.0, wish=Wish.KILL, **said).reason


def test_arming_that_is_given_up_disarms():
    flight = Commanded()
    reach(flight, Wish.IDLE, Phase.SPOOL_UP)
    reach(flight, Wish.GROUND, Phase.DISARM, 0.1)
    assert not reach(flight, Wish.GROUND, Phase.LANDED, 1.0).reason
    assert flight.arming_state == 1


def test_after_a_landing_of_ours_it_disarms_and_that_is_a_good_end():
    flight = airborne()
    flight.landed = True
    output = reach(flight, Wish.GROUND, Phase.LANDED, 1.0)
    assert output.reason == ""
    assert LAND not in asked(flight)


def test_an_autopilot_that_sees_no_ground_lands_by_itself_and_nothing_stops_in_the_air():
    flight = airborne()
    output = reach(flight, Wish.GROUND, Phase.LAND, 5.0)
    assert "does not disarm" in output.reason
    # the commander's link is disarmed: its commands give no thrust, whereas LEVEL carries the vehicle's weight
    assert (output.heartbeat, output.setpoint) == (True, Setpoint.COMMAND)
    assert flight.arming_state == 2
    assert asked(flight)[-1] == LAND
    assert all(request.param2 != FORCE for _, request in flight.requests if request.command == ARM)
    flight.arming_state = 1
    assert reach(flight, Wish.GROUND, Phase.LANDED, 1.0).reason


def test_a_landing_of_its_own_is_no_failure():
    flight = airborne()
    reach(flight, Wish.LAND, Phase.LAND, 0.1)
    flight.arming_state = 1
    output = reach(flight, Wish.LAND, Phase.LANDED, 1.0)
    assert output.reason == ""


def test_a_kill_disarms_in_the_air_and_sends_no_heartbeat():
    flight = airborne()
    assert not flight.tick(wish=Wish.KILL).heartbeat
    reach(flight, Wish.KILL, Phase.LANDED, 1.0)
    assert flight.arming_state == 1
    assert flight.requests[-1][1].param2 == FORCE


def test_its_own_take_off_is_waited_for_and_then_it_follows_us():
    flight = Commanded()
    reach(flight, Wish.GROUND, Phase.STANDBY)
    reach(flight, Wish.IDLE, Phase.FLY)
    output = reach(flight, Wish.CLIMB, Phase.CLIMB, 0.1)
    assert output.setpoint == Setpoint.IDLE  # on the ground no command of ours lifts it
    for _ in range(50):
        flight.tick(wish=Wish.CLIMB)
    assert flight.output.phase == Phase.CLIMB
    flight.nav_state, flight.landed = 4, False
    assert reach(flight, Wish.CLIMB, Phase.RETURN, 0.1).setpoint == Setpoint.COMMAND
    reach(flight, Wish.FLY, Phase.FLY, 1.0)
    assert flight.tick(wish=Wish.FLY).setpoint == Setpoint.COMMAND
    assert asked(flight) == [MODE, ARM, TAKEOFF, MODE]


@pytest.mark.parametrize("nav_state", [2, 15])
def test_a_pilot_may_take_over_during_its_take_off(nav_state):
    flight = Commanded()
    reach(flight, Wish.IDLE, Phase.FLY)
    reach(flight, Wish.CLIMB, Phase.CLIMB, 0.1)
    flight.tick(wish=Wish.CLIMB)
    flight.nav_state, flight.due = nav_state, []
    output = reach(flight, Wish.CLIMB, Phase.RELEASED, 0.1)
    assert "during its take-off" in output.reason


def test_a_landing_asked_for_during_its_take_off_is_its_own():
    flight = Commanded()
    reach(flight, Wish.IDLE, Phase.FLY)
    reach(flight, Wish.CLIMB, Phase.CLIMB, 0.1)
    reach(flight, Wish.LAND, Phase.LAND, 0.1)
    assert PROFILE.name in flight.memory.reason
