"""The commander's node: messages in, messages out; requests, services, and a mission reference that stays away."""

import math
import re
from functools import partial
from types import SimpleNamespace

import pytest
from std_srvs.srv import Trigger
from wired_commander import RUN, wired

from quad_commander import node as commander_node
from quad_commander.mode_table import Condition
from quad_core.enumerations import Request
from quad_msgs import msg
from quad_msgs.msg import FlightEvent, FlightMode, FlightRequest
from quad_msgs.srv import Goto
from quad_node import topics


@pytest.fixture
def make(start_node, callbacks):
    """Return a function that makes the node with the given ROS parameters."""
    return partial(wired, start_node, callbacks)


def test_mode_and_reference_of_a_step_come_together_and_wait_for_the_mission_and_the_guard(make):
    node = make()
    node.state(0)
    assert node.modes == []
    node.mission(0)
    assert [(mode.step, mode.next_step, mode.name) for mode in node.modes] == [(0, 5, "DISARMED")]
    assert [(point.step, point.next_step) for point in node.references] == [(0, 5)]
    assert (node.modes[0].run, node.modes[0].reason, node.modes[0].is_over) == (RUN, -1, False)
    node.mission(5)
    node.state(5)
    assert len(node.modes) == 1
    node.guard(4)
    assert [mode.step for mode in node.modes] == [0, 5]


def test_the_file_of_the_node_names_what_it_subscribes(make):
    callbacks = make().callbacks
    (named,) = re.findall(r"^Subscribes: (.*?)\.$", commander_node.__doc__, re.MULTILINE | re.DOTALL)
    found = dict(re.findall(r"([\w/]+)\s\((\w+)\)", named))
    assert set(found) | {"flight/state"} == set(callbacks)
    assert found == {topic: topics.TOPICS[topic].type.__name__ for topic in found}


def test_a_request_takes_effect_at_the_next_step_which_is_recorded(make):
    node = make()
    node.fly(0, 11)
    node.ask(FlightRequest.ARM)
    node.fly(11, 16)
    newest = node.modes[-1]
    assert (newest.step, newest.request_step, newest.since) == (15, 15, 15)
    assert (newest.name, newest.request, newest.answer, newest.sender) == ("ARMING", 1, FlightMode.DONE, "pilot")
    assert (FlightEvent.INFO, "mode", "DISARMED to ARMING: asked for by pilot") in node.events


@pytest.mark.parametrize(
    ("request_number", "sender"), [(0, "pilot"), (77, "pilot"), (0, ""), (5, "x" * 1000), (5, "\x1b[31m")]
)
def test_a_request_that_is_none_is_refused_by_name(make, request_number, sender):
    node = make()
    node.ask(request_number, sender)
    node.fly(0, 6)
    assert node.modes[-1].request == 0
    assert [kind for _, kind, _ in node.events] == ["bad_request"]
    assert len(node.events[0][2]) < 200  # an event of megabytes would harm as much


@pytest.mark.parametrize(("request_number", "answer"), [(FlightRequest.LAND, "refused"), (FlightRequest.KILL, "done")])
def test_an_unnamed_sender_is_a_sender_and_a_refusal_is_a_warning_with_its_reason(make, request_number, answer):
    node = make()
    node.ask(request_number, "")
    node.fly(0, 6)
    (severity, kind, text), *_ = [event for event in node.events if event[1].startswith("request")]
    assert (severity, kind) in ((FlightEvent.WARNING, "request_refused"), (FlightEvent.INFO, "request"))
    assert (kind == "request_refused") == (answer == "refused")
    assert f"of unnamed: {answer}" in text
    assert node.modes[-1].sender == "unnamed"


def test_the_name_of_the_mission_is_its_own(make):
    """LAND of a stranger, refused on the ground for longer than a take-off may be late, gave the flight up."""
    node = make("mission:=takeoff,land", "modes.arming_late:=0.1")
    node.plan()
    for step in range(0, 200, 5):
        node.ask(FlightRequest.LAND, "mission")
        node.fly(step, step + 5)
    assert [mode.is_over for mode in node.modes] == [False] * len(node.modes)
    assert node.modes[-1].sender == "another mission"


@pytest.mark.parametrize(
    ("place", "yaw", "reference"),
    [([0.5, 0.0, 1.0], math.nan, (0.5, 0.0)), ([0.5, 0.0, 1.0], 0.5, (0.5, 0.5)), ([math.inf, 0.0, 1.0], 0.0, None)],
)
def test_a_place_that_is_asked_for_is_where_the_reference_goes(make, place, yaw, reference):
    node = make()
    node.plan()
    node.ask(FlightRequest.TAKEOFF)
    node.fly(0, 520)
    node.callbacks["flight/request"](FlightRequest(request=FlightRequest.GOTO, sender="pilot", p_w=place, yaw=yaw))
    node.fly(520, 530)
    if reference is None:
        assert ("bad_request", node.modes[-1].name) == (node.events[-1][1], "TAKEOFF")
        return
    assert (node.modes[-1].name, node.modes[-1].request, node.modes[-1].answer) == ("HOLD", 10, FlightMode.DONE)
    node.fly(530, 2000)
    last = node.references[-1]
    assert (last.p_w[0], last.yaw) == pytest.approx(reference)


def test_the_service_says_at_once_what_the_next_step_would_answer(make):
    node = make()
    call = node._on_call
    before = call(Request.ARM, Trigger.Request(), Trigger.Response())
    assert (before.success, before.message) == (False, "the flight has not begun")
    node.fly(0, 6)
    names = {service.srv_name for service in node._offered}
    assert names == {"arm", "takeoff", "mission", "hold", "land", "descend", "disarm", "kill", "goto", "end"}
    refused = call(Request.LAND, Trigger.Request(), Trigger.Response())
    assert (refused.success, refused.message) == (False, "LAND is not possible in DISARMED")
    nowhere = call(Request.GOTO, Goto.Request(p_w=[math.nan, 0.0, 1.0]), Goto.Response())
    assert (nowhere.success, "expected finite numbers" in nowhere.message) == (False, True)
    assert call(Request.END, Trigger.Request(), Trigger.Response()).success
    assert call(Request.KILL, Trigger.Request(), Trigger.Response()).success
    node.fly(6, 11)
    assert (node.modes[-1].name, node.modes[-1].sender) == ("KILL", "service kill")


def in_the_air(make):
    node = make()
    node.plan()
    node.ask(FlightRequest.TAKEOFF)
    node.fly(0, 520)
    assert node.modes[-1].name == "TAKEOFF"
    return node


def called(node, request):
    answer = node._on_call(request, Trigger.Request(), Trigger.Response())
    return answer.success, answer.message


def test_the_service_refuses_a_place_that_the_next_step_would_refuse(make):
    node = in_the_air(make)
    sent = node._on_call(Request.GOTO, Goto.Request(p_w=[200.0, 0.0, 2.0], yaw=math.nan), Goto.Response())
    assert (sent.success, "goto 200 0 2, outside the fence" in sent.message) == (False, True)


def test_a_service_is_refused_by_name_when_no_more_senders_can_wait(make):
    node = in_the_air(make)
    for number in range(16):
        node.ask(FlightRequest.HOLD, f"sender {number}")
    assert called(node, Request.HOLD) == (False, "HOLD: 16 senders wait; ask again")
    assert called(node, Request.LAND)[0]


def test_a_service_is_refused_by_name_while_a_more_severe_one_waits(make):
    node = in_the_air(make)
    assert called(node, Request.LAND)[0]
    assert called(node, Request.HOLD) == (False, "HOLD is not possible: LAND of service land comes first")
    node.fly(520, 531)
    assert (node.modes[-1].name, node.modes[-1].answer) == ("LAND", FlightMode.DONE)


def test_a_service_that_only_repeats_what_a_landing_has_ended_is_refused_by_name(make):
    node = in_the_air(make)
    for request, sender in ((Request.HOLD, "service hold"), (Request.LAND, "pilot")):
        node.ask(request, sender)
        node.fly(520 if request == Request.HOLD else 526, 526 if request == Request.HOLD else 531)
    assert node.modes[-1].name == "LAND"
    text = "HOLD is not possible: granted less than 0.5 s ago; ask again then"
    assert called(node, Request.HOLD) == (False, text)
    node.fly(531, 790)
    assert called(node, Request.HOLD)[0]


def test_a_service_that_a_later_one_overtakes_is_refused_on_the_next_step(make):
    node = in_the_air(make)
    assert called(node, Request.HOLD)[0]
    assert called(node, Request.LAND)[0]
    node.fly(520, 531)
    assert [mode.name for mode in node.modes[-2:]] == ["LAND", "LAND"]
    refused = "HOLD of service hold: refused: HOLD was asked for before LAND began"
    assert refused in [text for _, kind, text in node.events if kind == "request_refused"]


@pytest.mark.parametrize(("lands", "mode"), [("true", "LAND"), ("false", "TAKEOFF")])
def test_a_recorder_that_leaves_is_said_and_lands_the_vehicle_if_asked(make, lands, mode):
    node = make(f"modes.land_without_recorder:={lands}")
    node.plan()
    node.ask(FlightRequest.TAKEOFF)
    node.fly(0, 520)
    node.node.flying = True
    node._watch()
    node.fly(520, 530)
    assert node.modes[-1].name == "TAKEOFF"
    node.publishing = 0
    node._watch()
    node._watch()
    node.fly(530, 531)
    assert node.modes[-1].name == mode
    assert [kind for _, kind, _ in node.events].count("recorder_lost") == 1


def test_a_low_battery_lands_the_vehicle_and_one_that_is_unknown_does_not(make):
    node = make()
    node.plan()
    node.battery(math.nan)
    node.ask(FlightRequest.TAKEOFF)
    node.fly(0, 520)
    node.battery(0.21)
    node.fly(520, 530)
    assert node.modes[-1].name == "TAKEOFF"
    node.battery(0.19)
    node.fly(530, 540)
    assert (node.modes[-1].name, node.modes[-1].reason) == ("LAND", Condition.BATTERY_LOW)
    node.battery(0.9)  # nothing goes back up when a battery recovers
    node.ask(FlightRequest.HOLD)
    node.fly(540, 550)
    assert node.modes[-1].name == "LAND"


@pytest.mark.parametrize("share", [-0.1, 1.5, 80.0, math.inf])
def test_a_battery_that_cannot_be_is_ignored_and_named(make, share):
    node = make()
    node.battery(share)
    (event,) = [text for _, kind, text in node.events if kind == "bad_battery"]
    assert event.startswith(f"battery_state: found percentage {share:g}, expected 0 to 1")


@pytest.mark.parametrize(("spoil", "reason"), [
    (lambda node: None, "plan: found none"),
    (
        lambda node: (
            node.plan(),
            node.node.links._in.update(wrench_setpoint=(SimpleNamespace(get_publisher_count=lambda: 2), "")),
            setattr(node, "publishing", 2),
        ),
        "one publisher of wrench_setpoint, there are 2: /node_0, /node_1",
    ),
    (
        lambda node: (node.plan(), node.callbacks["flight/nodes"](msg.NodeStatus(node="/b/x", run_id="b2"))),
        "run ids: found 'b2' too, expected 'a1' alone",
    ),
    *(
        (lambda node, share=share: (node.plan(), node.battery(share)), f"battery_state: found percentage {share:g}")
        for share in (15.0, -1.0)
    ),
])  # fmt: skip
def test_what_is_wrong_keeps_it_on_the_ground_and_is_said(make, spoil, reason):
    node = make("mission:=takeoff,land")
    spoil(node)
    node.fly(0, 300)
    assert node.modes[-1].name == "ARMING"
    assert reason in node.modes[-1].answer_text
    for step in range(300, 6000, 5):
        node.mission(step)
        node.guard(step - 1)
        node.state(step)
    assert (node.modes[-1].name, node.modes[-1].is_over) == ("DISARMED", True)
    assert node.modes[-1].outcome.startswith("not armed: ")
    assert reason in node.modes[-1].outcome


def test_a_mission_that_cannot_be_read_is_refused_by_name(make):
    with pytest.raises(ValueError, match=r"mission: found 'case9' as item 2, expected one of takeoff"):
        make("mission:=takeoff,case9,land")


def test_in_lockstep_a_mission_reference_that_stays_away_is_given_up_after_a_while(make):
    node = make()
    node.fly(0, 6)
    node.guard(9)
    node.state(10)
    node.responder.state_heard -= 0.9
    node._watch()
    assert len(node.modes) == 2
    node.responder.state_heard -= 0.2
    node._watch()
    assert [mode.step for mode in node.modes] == [0, 5, 10]
    assert [kind for _, kind, _ in node.events] == ["mission_lost"]
    node.guard(14)
    node.state(15)
    assert node.modes[-1].step == 15


def test_in_lockstep_a_guard_report_that_stays_away_is_no_lost_mission(make):
    node = make()
    node.fly(0, 6)
    node.mission(10)
    node.state(10)
    node.responder.state_heard -= 1.1
    node._watch()
    assert (node.events, node.responder.given_up, len(node.modes)) == ([], set(), 2)
    node.guard(9)
    assert node.modes[-1].step == 10


def test_in_real_time_a_state_that_stays_away_is_decided_on_all_the_same(make):
    node = make("flight.mode:=realtime")
    node.fly(0, 6)
    count = len(node.modes)
    node._watch()
    assert len(node.modes) == count
    node.responder.state_heard -= 0.7
    node._watch()
    assert len(node.modes) == count + 1
    assert node.modes[-1].raised >> Condition.STATE_LOST & 1
    decided = node.modes[-1].step
    assert decided >= 5 + 350
    node.fly(decided, decided + 22)  # states that go on for 30 ms after a gap are believed
    assert [mode.step for mode in node.modes[count:]] == [decided, decided + 16, decided + 21]


def test_a_commander_that_slept_holds_it_against_nobody(make, monkeypatch):
    clock = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(commander_node.time, "monotonic", lambda: clock.now)
    node = make("flight.mode:=realtime")
    node.fly(0, 6)
    clock.now += 1.0
    node._watch()  # what came meanwhile is still to be read
    assert [mode.step for mode in node.modes] == [0, 5]
    for step in range(10, 260, 5):
        node.mission(step)
        node.state(step)
        clock.now += 0.01
    raised = [mode.raised >> Condition.SETPOINT_LOST & 3 for mode in node.modes[2:]]  # setpoint, state
    assert raised[:24] == [0] * 24
    assert raised[-1] == 1


@pytest.mark.parametrize("period_steps", [5, 16, 25, 50, 150])
def test_a_slow_commander_too_sees_that_a_setpoint_stays_away(make, monkeypatch, period_steps):
    clock = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(commander_node.time, "monotonic", lambda: clock.now)
    node = make("flight.mode:=realtime", f"period_steps:={period_steps}")
    for step in range(301):
        if step % period_steps == 0:
            node.mission(step, length=period_steps)
        node.state(step)
        if step % 25 == 7:  # 20 times a second
            node._watch()
        clock.now += 0.002
    raised = {mode.step: mode.raised >> Condition.SETPOINT_LOST & 3 for mode in node.modes}
    assert [step for step, found in raised.items() if found == 1] == [step for step in raised if step > 150]


def test_states_that_stop_as_a_slow_commander_arms_are_named(make, monkeypatch):
    clock = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(commander_node.time, "monotonic", lambda: clock.now)
    node = make("flight.mode:=realtime", "period_steps:=250")
    node.plan()
    node.fly(0, 250)
    node.ask(FlightRequest.ARM)
    node.fly(250, 251)
    assert node.modes[-1].name == "ARMING"
    for step in range(251, 451):
        clock.now += 0.002
        node.state(step)
        if step % 25 == 0:
            node._watch()
    for _ in range(3):
        clock.now += 0.05
        node._watch()  # decides on step 250 again
    node.fly(500, 502)
    assert [mode.name for mode in node.modes[-2:]] == ["ARMING", "DISARMED"]


@pytest.mark.parametrize("name", ["SIGINT", "SIGHUP"])
def test_ctrl_c_in_flight_does_not_end_the_node_but_the_flight_and_sigterm_does(make, name):
    node = make()
    assert not node.node.outlives(name)
    node.fly(0, 6)
    assert not node.node.outlives("SIGTERM")
    assert node.node.outlives(name)
    node._watch()
    node.fly(6, 11)
    assert (node.modes[-1].is_over, node.modes[-1].outcome) == (True, name)


def test_a_guard_that_descends_is_followed_and_what_it_did_before_arming_is_over(make):
    node = make()
    node.plan()
    descends = {"mode": 1, "reason": 1, "condition": 1}
    node.ask(FlightRequest.TAKEOFF)
    node.fly(0, 250, **descends)
    assert node.modes[-1].name == "ARMING"
    node.fly(250, 520)
    assert node.modes[-1].name == "TAKEOFF"
    node.guard(524, run=RUN + 1, **descends)
    node.fly(520, 530)
    assert node.modes[-1].name == "TAKEOFF"
    node.fly(530, 540, **descends)
    text = "the guard flies its backup law: no good wrench from attitude_controller"
    assert (node.modes[-1].name, node.modes[-1].text) == ("DESCEND", text)
    assert node.modes[-1].guard_request == 2


def test_setpoints_of_another_run_keep_no_setpoint_young_and_its_plans_are_none(make, monkeypatch):
    clock = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(commander_node.time, "monotonic", lambda: clock.now)
    node = make("flight.mode:=realtime")
    node.plan(run=1)
    assert node._preflight._plan is None
    for step in range(0, 200, 5):
        node.callbacks["wrench_setpoint"](b"")
        node.setpoint(step, run=1)
        node.mission(step)
        node.state(step)
        clock.now += 0.01
    assert node.modes[-1].raised >> Condition.SETPOINT_LOST & 3 == 1  # the wrench is there
    assert {text for _, kind, text in node.events if kind == "foreign_run"} == {
        "flight/plan of another run ignored",
        "attitude_setpoint of another run ignored",
    }


def test_a_request_for_another_run_is_ignored_and_named(make):
    node = make()
    node.ask(FlightRequest.KILL, run=RUN + 1)
    node.fly(0, 6)
    assert node.modes[-1].name == "DISARMED"
    assert [kind for _, kind, _ in node.events] == ["foreign_run"]
