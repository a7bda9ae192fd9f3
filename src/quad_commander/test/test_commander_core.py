"""The commander's step without ROS: a whole mission, requests, a trajectory that stays away, and no step in between."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quad_commander.commander_core import CommanderCore
from quad_commander.missions import parse
from quad_commander.modes import Inputs
from quad_commander.parameters import CommanderParameters
from quad_commander.references import Place
from quad_commander.request_queue import PendingRequest, RequestQueue
from quad_core.enumerations import GuardMode, GuardReason, Mode, Request
from quad_core.geometry import quaternion_from_euler
from quad_core.types import NOT_BEGUN, GuardStatus, Quat, TrajectoryPoint, Vec3, VehicleState

DT = 0.01
PARAMETERS = CommanderParameters()
GROUND = VehicleState(Vec3(), Vec3(), Quat(), Vec3())
ZERO = Vec3(0.0, 0.0, 0.0)
JERK = PARAMETERS.references.horizontal.jerk


class Flight:
    """A vehicle that is where its reference is, and a trajectory: one metre east and back in ``length`` s."""

    def __init__(self, mission, length=4.0):
        items = parse(mission, ["case1"]) if mission else ()
        self.core = CommanderCore(PARAMETERS, items, GROUND)
        self.length, self.flown, self.step, self.dead = length, 0.0, 0, False
        self.state, self.point, self.lag = GROUND, TrajectoryPoint(NOT_BEGUN), 0.0
        self.said, self.modes, self.references, self.news = None, [], [], []
        self.refusals, self.stood = [], 0.0

    def go(self, seconds, *asked, **changes):
        for index in range(round(seconds / DT)):
            mode = self.core.mode
            seen = Inputs(
                step=self.step,
                dt=DT,
                state=self.state,
                mission=self.point,
                mission_lag=self.lag,
                guard=self.guard(),
                refusals=self.refusals if mode <= Mode.ARMING else None,
            )
            self.said = self.core.step(seen._replace(**changes), asked if index == 0 else ())
            self.news += self.said.news
            self.modes.append(Mode(self.said.mode.mode))
            self.references.append(self.said.reference)
            p = self.said.reference.p_w
            on_ground = p.z <= 0.0
            self.state = VehicleState(
                Vec3(p.x, p.y, max(p.z, 0.0)), Vec3() if on_ground else self.said.reference.v_w, Quat(), Vec3()
            )
            self.step += 5
            self.trajectory()
        return self

    def guard(self):
        """Return what the guard reports: whether the vehicle stands, and has stood for half a second."""
        stands = self.state.p_w.z <= 0.0
        self.stood = self.stood + DT if stands else 0.0
        return GuardStatus(on_ground=stands, contact=self.stood >= 0.5)

    def trajectory(self):
        """Answer as the trajectory node does: at rest but in MISSION, and when its time is over."""
        if self.dead:
            self.lag += DT
            return
        self.point = self.said.reference._replace(trajectory_time=NOT_BEGUN)
        if self.said.mode.mode == Mode.MISSION and self.flown < self.length:
            rate = 2.0 * math.pi / self.length
            angle = rate * self.flown
            height = self.references[-1].p_w.z if self.flown == 0.0 else self.height
            self.height = height
            self.point = TrajectoryPoint(
                self.flown,
                Vec3(0.5 - 0.5 * math.cos(angle), 0.0, height),
                Vec3(0.5 * rate * math.sin(angle), 0.0, 0.0),
                Vec3(0.5 * rate * rate * math.cos(angle), 0.0, 0.0),
            )
            self.flown += DT

    def in_the_air(self):
        return [point for point, mode in zip(self.references, self.modes, strict=True) if mode >= Mode.TAKEOFF]

    def entered(self):
        return [mode for index, mode in enumerate(self.modes) if index == 0 or self.modes[index - 1] != mode]


def largest_steps(references):
    """Return the largest change of position and of velocity from one reference to the next, in m and m/s."""
    position = velocity = 0.0
    for before, after in pairwise(references):
        position = max(position, math.dist(before.p_w, after.p_w))
        velocity = max(velocity, math.dist(before.v_w, after.v_w))
    return position, velocity


def test_a_mission_is_flown_from_the_ground_to_the_ground():
    flight = Flight("takeoff,case1,hold:1,hold:1,land").go(20.0)
    assert flight.entered() == [Mode.ARMING, Mode.TAKEOFF, Mode.HOLD, Mode.MISSION, Mode.HOLD, Mode.LAND, Mode.DISARMED]
    assert flight.said.mode.is_over
    assert flight.said.outcome == ""
    assert max(point.p_w.x for point in flight.references) == pytest.approx(1.0, abs=0.01)
    assert flight.modes.count(Mode.HOLD) == pytest.approx(2.0 / DT, abs=5)
    position, velocity = largest_steps(flight.in_the_air())
    assert position < 1.05 * DT  # 1 m/s is the fastest that anything is flown here
    assert velocity < 2.5 * DT


def test_a_take_off_without_a_height_rises_as_the_parameter_says():
    flight = Flight("takeoff,hold:60")
    flight.core = CommanderCore(PARAMETERS._replace(takeoff_height=3.0), parse("takeoff,hold:60", []), GROUND)
    assert flight.go(10.0).said.reference.p_w.z == pytest.approx(3.0)


@pytest.mark.parametrize("ground", [-20.0, 13.2])
def test_heights_count_from_the_estimate_at_arming(ground):
    """The estimate has the vehicle metres off, adrift while it waits, and holds the place at arming from then on."""
    core = CommanderCore(PARAMETERS, parse("takeoff:2,land", []), VehicleState())
    state, said, heights, step = VehicleState(), None, [], 0
    for k in range(3000):
        armed = core.mode > Mode.ARMING
        if not armed:  # as the vehicle's owner marks it
            z = ground + 0.0005 * min(k, 40)
            state = VehicleState(p_w=Vec3(0.0, 0.0, z), ground_z=z, on_ground=True)
        seen = Inputs(step, DT, state, TrajectoryPoint(NOT_BEGUN), 0.0, refusals=[] if not armed else None)
        if armed and said.reference.p_w.z <= state.ground_z:
            seen = seen._replace(guard=GuardStatus(on_ground=True, contact=True))
        said, step = core.step(seen), step + 5
        if armed:
            p, v = said.reference.p_w, said.reference.v_w
            lands = p.z <= state.ground_z
            state = state._replace(p_w=p._replace(z=max(p.z, state.ground_z)), v_w=Vec3() if lands else v)
            heights.append(p.z - state.ground_z)
        if said.mode.is_over:
            break
    assert said.mode.is_over
    assert said.outcome == ""
    assert heights[0] == pytest.approx(0.0, abs=1e-3)
    assert max(heights) == pytest.approx(2.0, abs=1e-6)
    assert state.p_w.z == state.ground_z != 0.0


def test_a_take_off_stays_where_the_air_has_taken_the_vehicle():
    """Until it is clear it may not tilt; the reference goes along, and stops within the limits from then on."""
    core = CommanderCore(PARAMETERS, parse("takeoff:3,hold:60", []), VehicleState())
    state, points = VehicleState(on_ground=True), []
    for k in range(1000):
        said = core.step(Inputs(5 * k, DT, state, None, 0.0, refusals=[]))
        if core.mode < Mode.TAKEOFF:
            continue
        points.append(said.reference)
        p, v = said.reference.p_w, said.reference.v_w
        if state.on_ground:  # half a metre per second squared to the east
            x = state.p_w.x + DT * state.v_w.x
            state = VehicleState(Vec3(x, 0.0, p.z), Vec3(state.v_w.x + 0.5 * DT, 0.0, v.z), on_ground=p.z <= 0.7)
        else:
            state = VehicleState(p, v)
    assert core.mode == Mode.HOLD
    position, velocity = largest_steps(points)
    assert position < 1.25 * DT
    assert velocity < 2.5 * DT
    carried = next(point.p_w.x for point in points if point.p_w.z > 0.71)
    assert 0.1 < carried < points[-1].p_w.x < carried + 1.0
    assert points[-1].v_w == Vec3()


@settings(max_examples=20, deadline=None)
@given(
    st.sampled_from([Request.HOLD, Request.LAND]),
    st.builds(Vec3, *(st.floats(-6.0, 6.0),) * 3),
    st.builds(Vec3, st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(-3.1, 3.1)),
)
def test_after_a_descent_the_reference_begins_with_the_vehicle_s_own_motion(request, velocity, angles):
    """The guard has flown it away from its reference, with a motion of its own."""
    flight = Flight("takeoff,case1,land").go(5.0)
    flight.go(0.5, guard=GuardStatus(mode=GuardMode.DESCEND, condition=GuardReason.WRENCH_LOST))
    assert flight.core.mode == Mode.DESCEND
    state = VehicleState(Vec3(3.0, -2.0, 8.0), velocity, quaternion_from_euler(angles), Vec3(1.0, -2.0, 0.5))
    flight.state = state
    flight.go(
        DT, PendingRequest(request, "pilot"), guard=GuardStatus(mode=GuardMode.DESCEND, condition=GuardReason.GOOD)
    )
    assert flight.core.mode == Mode[request.name], flight.news[-3:]
    first = flight.references[-1]
    assert (first.p_w, first.v_w) == (state.p_w, state.v_w)
    assert math.dist(first.a_w, ZERO) == 0.0
    assert first.yaw == pytest.approx(angles.z)
    flight.references, flight.modes = [first], [flight.core.mode]
    flight.go(6.0)
    for before, after in pairwise(flight.in_the_air()):
        assert math.dist(after.a_w, before.a_w) <= math.sqrt(3.0) * JERK * DT + 1e-9
        assert math.dist(after.v_w, before.v_w) <= (math.dist(after.a_w, ZERO) + math.sqrt(3.0) * JERK * DT) * DT
        assert math.dist(after.p_w, before.p_w) <= (math.dist(after.v_w, ZERO) + 0.2) * DT


def test_an_operator_holds_goes_on_and_lands():
    flight = Flight("takeoff,case1,land").go(5.0)
    assert flight.core.mode == Mode.MISSION
    flight.go(DT, PendingRequest(Request.HOLD, "pilot")).go(3.0)
    assert (flight.core.mode, flight.said.text) == (Mode.HOLD, "asked for by pilot")
    assert not flight.said.mode.is_over
    flight.go(DT, PendingRequest(Request.MISSION, "pilot")).go(1.0)
    assert flight.core.mode == Mode.MISSION
    flight.go(DT, PendingRequest(Request.LAND, "pilot")).go(10.0)
    assert flight.said.mode.is_over
    assert flight.said.outcome.startswith("mission not finished: LAND at step ")
    assert flight.said.outcome.endswith("asked for by pilot")
    assert largest_steps(flight.in_the_air())[0] < 1.05 * DT


def test_on_the_ground_a_landing_asks_for_no_way_back_to_where_it_began():
    """6 cm beside its reference a vehicle tilted by 5 degrees towards it before its motors stopped."""
    aside = VehicleState(Vec3(0.05, -0.06, 0.0), Vec3(), Quat(), Vec3())
    for stands, x in ((False, 0.0), (True, 0.05)):  # in the air it does
        landing = Flight("takeoff,hold:600").go(8.0).go(1.0, PendingRequest(Request.LAND, "me"))
        landing.go(0.1, state=aside, guard=GuardStatus(on_ground=stands))
        assert landing.core.mode == Mode.LAND
        reference = landing.references[-1]
        assert reference.p_w.x == pytest.approx(x, abs=1e-9)
        assert (reference.v_w.x, reference.v_w.y, reference.a_w.x) == (0.0, 0.0, 0.0)
        assert reference.v_w.z < 0.0


@pytest.mark.parametrize(("asked", "seen", "text"), [
    ((), {"overruns": 0.2}, "more than 5% of the commander's cycles of a second late"),
    ((), {"estimator_reset": True}, "estimator reset"),
    ((PendingRequest(Request.HOLD, "pilot"),), {}, "asked for by pilot"),
])  # fmt: skip
@pytest.mark.parametrize("climbs", [0, 30])
def test_a_hold_before_the_vehicle_is_clear_of_the_ground_lands_in_place(asked, seen, text, climbs):
    """It held, its motors at the weight, and slid 1.4 m in the wind."""
    standing = {"state": VehicleState(Vec3(0.2, 0.0, 0.0), on_ground=True), "guard": GuardStatus(on_ground=True)}
    flight = Flight("takeoff,hold:60,land").go(1.0 + climbs * DT, **standing)
    assert flight.core.mode == (Mode.TAKEOFF if climbs else Mode.ARMING)
    flight.go(DT, *asked, **standing, **seen)
    assert (flight.core.mode, flight.said.text) == (Mode.LAND, f"{text}; not clear of the ground")
    flight.go(1.0, **standing).go(DT, PendingRequest(Request.HOLD, "pilot"), **standing)
    assert (flight.core.mode, flight.said.reference.p_w[:2]) == (Mode.LAND, (0.2, 0.0))
    assert (
        flight.said.answer_text
        == flight.core.foresee(PendingRequest(Request.HOLD, "me"))
        == "HOLD is not possible in LAND"
    )
    assert flight.said.reference.p_w.z < 0.0
    flight.go(DT, state=standing["state"], guard=GuardStatus(on_ground=True, contact=True))
    assert (flight.core.mode, flight.said.mode.is_over) == (Mode.DISARMED, True)
    assert flight.said.outcome.startswith("mission not finished: LAND at step")


def test_a_vehicle_on_its_way_up_may_be_sent_to_a_place_and_a_low_take_off_holds():
    standing = {"state": VehicleState(on_ground=True)}
    sent = Flight("takeoff,hold:60,land").go(1.3, **standing).go(DT, sent_to(4.0, 0.0, 2.0), **standing)
    assert sent.core.mode == Mode.HOLD
    low = Flight("takeoff:0.5,hold:60,land").go(4.0, **standing)
    assert (low.core.mode, low.said.text) == (Mode.HOLD, "at the height of take-off")


def sent_to(*place, request=Request.GOTO):
    return PendingRequest(request, "pilot", place=Place(*place))


def test_an_operator_stops_the_way_to_a_place_by_hold():
    flight = Flight("takeoff:2,hold:600,land").go(8.0).go(2.0, sent_to(50.0, 0.0, 2.0))
    flight.go(3.0, PendingRequest(Request.HOLD, "pilot"))
    assert flight.said.reference.v_w == Vec3()
    assert 1.0 < flight.said.reference.p_w.x < 3.0


@pytest.mark.parametrize(("place", "reason"), [
    ((200.0, 0.0, 2.0), "goto 200 0 2, outside the fence, expected a place within -100 -100 -1 to 100 100 120 m"),
    ((0.0, 0.0, 121.0), "goto 0 0 121, outside the fence"),
    ((0.0, 0.0, 0.0), "goto 0 0 0, at most the height of the ground"),
])  # fmt: skip
def test_a_place_that_must_not_be_flown_to_is_refused_by_name(place, reason):
    flight = Flight("takeoff:2,hold:600,land").go(8.0).go(DT, sent_to(*place))
    assert (flight.said.mode.answer, flight.core.mode) == (2, Mode.HOLD)
    assert flight.said.answer_text.startswith(reason)
    grounded = Flight(f"takeoff:2,goto:{place[0]} {place[1]} {place[2]},land").go(12.0)
    assert grounded.entered() == [Mode.ARMING, Mode.DISARMED]
    assert f"mission: found {reason}" in grounded.said.outcome


def test_what_is_foreseen_of_a_place_is_what_the_next_step_answers():
    flight = Flight("takeoff:2,hold:600,land").go(8.0)
    for x in (200.0, 4.0):
        foreseen = flight.core.foresee(sent_to(x, 0.0, 2.0))
        assert foreseen == flight.go(DT, sent_to(x, 0.0, 2.0)).said.answer_text
        assert ("outside the fence" in foreseen) == (x > 100.0)


def test_what_a_waiting_request_will_overtake_is_foreseen():
    flight, queue = Flight("takeoff:2,hold:600,land"), RequestQueue()
    flight.core = CommanderCore(PARAMETERS, parse("takeoff:2,hold:600,land", []), GROUND, queue)
    flight.go(8.0)
    queue.add(PendingRequest(Request.DISARM, "someone"))
    assert flight.core.foresee(PendingRequest(Request.HOLD, "me")) == "", "what is refused itself overtakes nothing"
    queue.add(PendingRequest(Request.LAND, "someone"))
    assert (
        flight.core.foresee(PendingRequest(Request.HOLD, "me")) == "HOLD is not possible: LAND of someone comes first"
    )
    assert (
        flight.core.foresee(PendingRequest(Request.LAND, "me"))
        == flight.core.foresee(PendingRequest(Request.KILL, "me"))
        == ""
    )


def test_a_mission_flies_from_place_to_place():
    """The second way takes longer than a mission may be kept waiting."""
    flight = Flight("takeoff:2,goto:3 0 2,goto:3 -70 2 90deg,hold:2,land").go(75.0)
    assert flight.core.mode == Mode.HOLD
    assert max(point.p_w.x for point in flight.references) == pytest.approx(3.0)
    flight.go(30.0)
    assert flight.entered()[-2:] == [Mode.LAND, Mode.DISARMED]
    assert (flight.said.mode.is_over, flight.said.outcome) == (True, "")
    landed = flight.references[-1]
    assert landed.p_w[:2] == pytest.approx((3.0, -70.0))
    assert flight.in_the_air()[-1].yaw == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize(("request_", "mode"), [(Request.KILL, Mode.KILL), (Request.LAND, Mode.LAND)])
@pytest.mark.parametrize("senders", [1, 40])
def test_a_flood_of_requests_does_not_delay_a_more_severe_one(request_, mode, senders):
    """Ten requests per step: 1 kHz."""
    flood = [PendingRequest(Request.HOLD, f"flood {number % senders}") for number in range(10)]
    flight = Flight("takeoff,hold:600,land").go(8.0)
    for _ in range(300):
        flight.go(DT, *flood)
    assert flight.go(DT, *flood, PendingRequest(request_, "operator"), *flood).core.mode == mode


def test_a_flood_of_one_sender_does_not_take_a_landing_back():
    flood = [PendingRequest(Request.HOLD, "flood")] * 10
    flight = Flight("takeoff,hold:600,land").go(8.0).go(DT, *flood)
    flight.go(DT, *flood, PendingRequest(Request.LAND, "operator"))
    for _ in range(100):
        assert flight.go(DT, *flood).core.mode == Mode.LAND
    flight.go(0.6)
    assert flight.go(DT, PendingRequest(Request.HOLD, "flood")).core.mode == Mode.HOLD, (
        "after a pause it is a new request"
    )


def test_a_request_from_before_a_descent_does_not_take_the_vehicle_back():
    asked = [PendingRequest(Request.HOLD, f"operator {number}") for number in range(5)]
    flight = Flight("takeoff,hold:600,land").go(8.0)
    descends = GuardStatus(mode=GuardMode.DESCEND, condition=GuardReason.WRENCH_LOST)
    flight.go(DT, *asked, guard=descends)
    assert flight.core.mode == Mode.DESCEND
    for number in range(1, 5):
        flight.go(DT, guard=GuardStatus(mode=GuardMode.DESCEND, condition=GuardReason.GOOD))
        assert flight.core.mode == Mode.DESCEND
        assert flight.said.answer_text == "HOLD was asked for before DESCEND began"
        assert flight.said.sender == f"operator {number}"
    flight.go(
        DT,
        PendingRequest(Request.HOLD, "operator 1"),
        guard=GuardStatus(mode=GuardMode.DESCEND, condition=GuardReason.GOOD),
    )
    assert flight.core.mode == Mode.HOLD, "what is asked for during the descent counts"


@pytest.mark.parametrize("severe", [Request.LAND, Request.DESCEND])
def test_what_is_granted_overtakes_all_that_is_milder_whoever_asked_for_it(severe):
    flight = Flight("takeoff,hold:600").go(8.0)
    milder = [PendingRequest(Request.HOLD, f"operator {number}") for number in range(3)]
    flight.go(0.1, *milder, PendingRequest(severe, "alice"), *milder)
    assert flight.core.mode == Mode[severe.name]
    assert flight.said.answer_text == f"HOLD was asked for before {severe.name} began"
    assert flight.go(DT, PendingRequest(Request.HOLD, "operator 1")).core.mode == Mode.HOLD, "asked for later it counts"


def test_a_take_off_that_its_sender_keeps_repeating_does_not_follow_a_landing():
    flight = Flight("")
    for tenth in range(200):
        pilot = [PendingRequest(Request.LAND, "pilot")] if tenth == 80 else []
        flight.go(0.1, PendingRequest(Request.TAKEOFF, "gcs"), *pilot)
    assert [mode.name for mode in flight.entered()] == ["ARMING", "TAKEOFF", "HOLD", "LAND", "DISARMED"]
    flight.go(1.0)
    flight.go(1.0, PendingRequest(Request.TAKEOFF, "gcs"))
    assert flight.entered()[-2:] == [Mode.DISARMED, Mode.ARMING], "asked for anew after a pause"


def test_a_stream_of_refused_requests_does_not_stop_the_mission():
    flight = Flight("takeoff:2,hold:1,land").go(2.0)
    for _ in range(1500):
        flight.go(DT, PendingRequest(Request.DISARM, "stream"))
    assert [mode.name for mode in flight.entered()] == ["ARMING", "TAKEOFF", "HOLD", "LAND", "DISARMED"]


def test_a_more_severe_request_comes_before_the_mission_whatever_was_refused():
    lands = Flight("takeoff:2,hold:1,land").go(20.0).modes.index(Mode.LAND)
    flight = Flight("takeoff:2,hold:1,land").go((lands - 1) * DT)
    flight.go(DT, PendingRequest(Request.DISARM, "stream")).go(DT, PendingRequest(Request.KILL, "operator"))
    assert flight.core.mode == Mode.KILL


def test_of_two_equal_requests_of_one_step_both_are_granted_in_the_order_of_arrival():
    flight = Flight("takeoff:2,hold:100,land")
    flight.go(10.0)
    east, west = (PendingRequest(Request.GOTO, name, place=Place(x, 0.0, 2.0)) for name, x in (("a", 1.0), ("b", -1.0)))
    flight.go(0.1, east, west)
    assert [text for _, text in flight.news[-2:]] == ["GOTO of a: done", "GOTO of b: done"]
    flight.go(15.0)
    assert flight.state.p_w.x == pytest.approx(-1.0, abs=0.01)


def test_a_refusal_names_the_mode_in_which_it_was_judged():
    rises = Flight("takeoff:2,land").go(3.0).modes.index(Mode.TAKEOFF)
    flight = Flight("takeoff:2,land").go(rises * DT)
    flight.go(DT, PendingRequest(Request.DISARM, "pilot"))
    assert (flight.core.mode, flight.said.answer_text) == (Mode.TAKEOFF, "DISARM is not possible in TAKEOFF")


def test_what_is_granted_overtakes_also_for_a_sender_that_bears_the_name_of_the_mission():
    flight = Flight("takeoff,hold:600").go(8.0)
    flight.go(0.1, PendingRequest(Request.LAND, "mission"), PendingRequest(Request.HOLD, "x"))
    assert (flight.core.mode, flight.said.answer_text) == (Mode.LAND, "HOLD was asked for before LAND began")


def test_a_hold_of_an_operator_lasts_as_long_as_the_operator_likes():
    flight = Flight("takeoff,case1,land").go(5.0).go(DT, PendingRequest(Request.HOLD, "operator"))
    flight.go(3.0 * PARAMETERS.wait_limit)
    assert (flight.core.mode, flight.said.text) == (Mode.HOLD, "asked for by operator")
    assert flight.go(DT, PendingRequest(Request.MISSION, "operator")).core.mode == Mode.MISSION


@pytest.mark.parametrize("is_lost", [False, True])
def test_a_hold_that_a_fault_began_becomes_that_of_the_operator_who_asks_for_it(is_lost):
    flight = Flight("takeoff,case1,land").go(5.0)
    if is_lost:
        flight.dead = True
        flight.go(1.0)
    else:
        flight.go(DT, overruns=0.2)
    assert (flight.core.mode, "asked for" in flight.said.text) == (Mode.HOLD, False)
    flight.go(DT, PendingRequest(Request.HOLD, "operator")).go(3.0 * PARAMETERS.wait_limit)
    assert (flight.core.mode, flight.said.text) == (Mode.HOLD, "asked for by operator")
    flight.go(DT, PendingRequest(Request.MISSION, "operator"))
    if is_lost:  # it would land at the next step
        assert (flight.core.mode, flight.said.answer_text) == (Mode.HOLD, "MISSION is not possible: reference late")
        assert flight.core.foresee(PendingRequest(Request.MISSION, "me")) == flight.said.answer_text
    else:
        assert flight.core.mode == Mode.MISSION


def test_a_trajectory_that_stays_away_becomes_hold_and_then_land():
    flight = Flight("takeoff,case1,land").go(5.0)
    flight.dead, begun = True, len(flight.modes)
    flight.go(15.0)
    after = flight.modes[begun:]
    assert after.index(Mode.HOLD) * DT == pytest.approx(0.2, abs=0.03)
    assert after.index(Mode.LAND) * DT == pytest.approx(2.0, abs=0.03)
    assert flight.said.mode.is_over
    assert "trajectory is silent: mission reference older than 2 s" in flight.said.outcome
    assert largest_steps(flight.in_the_air())[0] < 1.05 * DT


def test_a_mission_whose_take_off_stays_refused_is_given_up_and_says_why():
    flight = Flight("takeoff,hold:60,land").go(5.0, position_good=False)
    assert not flight.said.mode.is_over
    flight.go(6.0, position_good=False)
    assert (flight.core.mode, flight.said.mode.is_over) == (Mode.DISARMED, True)
    assert flight.said.outcome == "not armed: TAKEOFF is not possible: position lost"


def test_ctrl_c_lands_and_says_so():
    flight = Flight("takeoff,hold:60,land").go(6.0)
    flight.go(10.0, end_asked="interrupted by SIGINT")
    assert flight.entered()[-2:] == [Mode.LAND, Mode.DISARMED]
    assert (flight.said.mode.is_over, flight.said.outcome) == (True, "landed: interrupted by SIGINT")


def by_hand():
    """Return a flight without a mission in HOLD."""
    flight = Flight("").go(DT, PendingRequest(Request.TAKEOFF, "pilot")).go(8.0)
    assert flight.core.mode == Mode.HOLD
    return flight


def test_a_flight_without_a_mission_that_an_operator_landed_ends_good():
    flight = by_hand().go(5.0, PendingRequest(Request.LAND, "pilot"))
    assert (flight.core.mode, flight.said.mode.is_over) == (Mode.DISARMED, False)
    flight.go(DT, end_asked="asked to end by a service")
    assert (flight.said.mode.is_over, flight.said.outcome) == (True, "")


@pytest.mark.parametrize(("seen", "outcome"), [
    ({"battery": 0.1}, "LAND at step 4005: battery below 20%"),
    ({"end_asked": "asked to end by a service"}, "landed: asked to end by a service"),
])  # fmt: skip
def test_a_flight_without_a_mission_that_came_down_by_itself_says_why(seen, outcome):
    flight = by_hand().go(5.0, **seen).go(DT, end_asked="asked to end by a service")
    assert (flight.said.mode.is_over, flight.said.outcome) == (True, outcome)


def test_a_landing_for_the_end_of_the_flight_names_who_asked_for_it():
    flight = by_hand().go(DT, end_asked="asked to end by a service")
    assert (flight.core.mode, flight.said.text) == (Mode.LAND, "asked to end by a service")


def test_a_mission_that_is_not_armed_ends_with_every_reason():
    flight = Flight("takeoff,land")
    flight.refusals = ["tilt: found 20.0 deg", "plan: found none"]
    flight.go(2.0)
    assert flight.said.answer_text == "tilt: found 20.0 deg; plan: found none"
    flight.go(10.0)
    assert flight.said.mode.is_over
    assert flight.entered() == [Mode.ARMING, Mode.DISARMED]
    assert flight.said.outcome == "not armed: no take-off within 10 s; tilt: found 20.0 deg; plan: found none"


def test_an_autopilot_is_not_armed_before_every_check_has_passed():
    flight = Flight("takeoff,land")
    flight.refusals = ["battery: found 10 %", "state: the estimate moves"]
    flight.go(2.0, by_autopilot=True)
    refused = "battery: found 10 %; state: the estimate moves"
    assert [flight.core.foresee(PendingRequest(request, "me")) for request in (Request.ARM, Request.TAKEOFF)] == [
        refused,
        refused,
    ]
    flight.go(9.0, by_autopilot=True)
    assert flight.entered() == [Mode.DISARMED]
    assert (flight.said.mode.is_over, flight.said.outcome) == (True, f"not armed: {refused}")
    rests = Flight("takeoff,land")
    rests.refusals = ["state: the estimate moves"]
    rests.go(5.0, by_autopilot=True).refusals.clear()
    assert rests.go(2.0, by_autopilot=True).entered()[:3] == [Mode.DISARMED, Mode.ARMING, Mode.TAKEOFF]


def test_a_mission_that_a_fault_keeps_waiting_lands_after_a_minute():
    flight = Flight("takeoff,case1,land").go(5.0).go(1.0, overruns=0.2)
    assert flight.core.mode == Mode.HOLD
    flight.go(58.0)
    assert flight.core.mode == Mode.HOLD
    assert flight.go(3.0).core.mode == Mode.LAND
    assert flight.said.text.endswith("kept waiting for 60 s (more than 5% of the commander's cycles of a second late)")


def test_killed_on_the_ground_is_over_at_once_and_in_the_air_after_ten_seconds():
    flight = Flight("takeoff,hold:60,land").go(6.0)
    flight.go(DT, PendingRequest(Request.KILL, "pilot"))
    for _ in range(990):
        flight.go(DT, state=flight.state._replace(v_w=Vec3(0.0, 0.0, -9.0)), guard=GuardStatus())
    assert not flight.said.mode.is_over
    for _ in range(20):
        flight.go(DT, state=flight.state._replace(v_w=Vec3(0.0, 0.0, -9.0)), guard=GuardStatus())
    assert flight.said.mode.is_over
    assert flight.said.outcome.startswith("KILL at step")


def aloft():
    """Return a flight in HOLD whose vehicle an autopilot owns."""
    flight = Flight("takeoff:2,hold:60,land").go(8.0, by_autopilot=True)
    assert flight.core.mode == Mode.HOLD
    return flight


def test_a_jump_of_the_estimate_takes_the_reference_along():
    flight = aloft()
    flight.state = flight.state._replace(p_w=flight.state.p_w._replace(x=flight.state.p_w.x + 1.0))
    flight.go(DT, by_autopilot=True, estimator_reset=True)
    assert flight.said.reference.p_w.x == pytest.approx(flight.state.p_w.x, abs=1e-9)


@pytest.mark.parametrize("jump", [1.0, 2.2, 9.0])
def test_a_jump_of_any_length_is_a_hold_that_is_named(jump):
    flight = Flight("takeoff,case1,land").go(6.5, by_autopilot=True)
    assert flight.core.mode == Mode.MISSION
    flight.state = flight.state._replace(p_w=flight.state.p_w._replace(x=flight.state.p_w.x + jump))
    flight.go(DT, by_autopilot=True, estimator_reset=True).go(1.0, by_autopilot=True)
    assert (flight.core.mode, flight.said.text) == (Mode.HOLD, "estimator reset")


def test_the_reference_goes_with_an_estimate_that_wanders_while_the_vehicle_stands():
    flight = Flight("takeoff:2,hold:1,land")
    flight.refusals = ["state: the estimate moves"]
    for x in (0.7, 1.4, 2.1):
        flight.state = GROUND._replace(p_w=GROUND.p_w._replace(x=x))
        flight.go(1.0, by_autopilot=True)
        assert (flight.core.mode, flight.said.reference.p_w.x) == (Mode.DISARMED, x)


@pytest.mark.parametrize("by_autopilot", [True, False])
def test_what_the_guard_stops_in_the_simulator_an_autopilot_lands(by_autopilot):
    flight = aloft()
    flight.go(DT, by_autopilot=by_autopilot, guard=GuardStatus(mode=GuardMode.KILL, reason=GuardReason.STATE_LOST))
    assert flight.core.mode == (Mode.DESCEND if by_autopilot else Mode.KILL)
    assert ("motors" in flight.said.text) != by_autopilot


def test_a_land_detector_ends_a_landing_wherever_the_estimate_has_the_ground():
    flight = aloft()
    flight.go(1.0, PendingRequest(Request.LAND, "someone"), by_autopilot=True)
    assert flight.core.mode == Mode.LAND
    assert flight.go(DT, by_autopilot=True, landed=True).core.mode == Mode.DISARMED


def test_while_the_autopilot_flies_the_reference_goes_along_and_no_take_off_is_over():
    flight = Flight("takeoff:2,hold:60,land")
    flight.go(2.5, by_autopilot=True, landed=True)
    assert flight.core.mode == Mode.TAKEOFF
    for height in (0.5, 1.0, 2.4, 2.5):
        flight.state = flight.state._replace(p_w=Vec3(0.2, 0.0, height), v_w=Vec3())
        flight.go(DT, by_autopilot=True, autopilot_flies=True)
        assert flight.core.mode == Mode.TAKEOFF
        assert flight.said.reference.p_w == pytest.approx(Vec3(0.2, 0.0, height), abs=1e-3)
    flight.go(4.0, by_autopilot=True)
    assert flight.core.mode == Mode.HOLD
