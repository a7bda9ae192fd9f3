"""What the owner of a vehicle believes of the other nodes."""

import pytest
from rclpy.serialization import serialize_message

from quad_core.cascade import SIMULATOR
from quad_core.enumerations import GuardReason, GuardRequest
from quad_core.types import Vec3, VehicleState, Wrench
from quad_guard.checks import StateSample, WrenchCommand
from quad_msgs.msg import FlightMode, FlightState, NodeStatus, RecorderAck
from quad_node.codec import pack_wrench
from quad_node.flight_leader import FlightLeader
from quad_node.flight_node import FlightNode


def owning(start_node, callbacks, *parameters):
    """Return the leader of a flight whose topics are functions."""
    node = start_node(lambda: FlightNode(SIMULATOR), *parameters)
    owner = FlightLeader(node, activate=lambda: None, progress=lambda: None)
    owner.callbacks = callbacks
    return owner


@pytest.fixture
def owner(start_node, callbacks):
    return owning(start_node, callbacks, "flight.mode:=realtime")


STILL = "simulator stood still for 1.00 s"


@pytest.mark.parametrize(("reason", "quiet", "late", "expected"), [
    (GuardReason.WRENCH_LOST, 25, 0.0, "attitude_controller does not answer step 100: no wrench_setpoint"),
    (GuardReason.WRENCH_LOST, 5, 0.0, "wrench_setpoint arrives, but no good one reaches the rotors"),
    (GuardReason.WRENCH_LOST, 25, 1.0, STILL),
    (GuardReason.STATE_LOST, 25, 0.0, "state: nothing good from PX4"),
    (GuardReason.STATE_LOST, 25, 1.0, STILL),
    (GuardReason.REQUESTED, 25, 1.0, STILL),
    (GuardReason.REQUESTED, 25, 0.09, ""),
    (GuardReason.TILT, 25, 0.0, ""),
])  # fmt: skip
def test_a_takeover_names_the_node_that_caused_it(owner, reason, quiet, late, expected):
    owner.node.current_step, owner.end_step, owner.estimator = 100, 500, "PX4"
    owner.note_pause(late)
    owner.wrenches.heard_step = 100 - quiet
    owner.guard.memory = owner.guard.memory._replace(reason=reason)
    assert owner._culprit() == expected


def test_a_wrench_whose_stamp_is_no_step_is_refused(owner):
    owner.node.flying, owner.node.current_step = True, 100
    for error in (1, -1, 0):
        owner.callbacks["wrench_setpoint"](pack_wrench(Wrench(5.0, Vec3()), 200_000_000 + error))
        assert (owner.wrenches.newest is None) == (error != 0)
    assert owner.node.events.counts["rejected_stamp"] == 2


@pytest.mark.parametrize("step", [11, 2**64 - 1])
def test_nobody_has_recorded_a_step_that_is_not_flown(owner, step):
    owner.node.current_step = 10
    for acked in (8, step, 10):
        owner.callbacks["flight/recorded"](RecorderAck(step=acked))
        assert owner.recorded_step == min(acked, 10 if acked == 10 else 8)
    assert owner.node.events.counts["rejected"] == 1


@pytest.mark.parametrize(
    ("commanded", "phase"), [(True, FlightState.FAILED), (False, FlightState.FLYING)], ids=["commander", "controller"]
)
def test_without_a_guard_a_lost_commander_ends_the_flight_and_a_silent_controller_does_not(owner, commanded, phase):
    owner.phase, owner.node.commanded = FlightState.FLYING, commanded
    owner.guard.parameters = owner.guard.parameters._replace(enabled=False)
    owner.input_watch.silent = lambda: "it does not answer"
    owner.watch()
    assert owner.phase == phase


@pytest.mark.parametrize("mode", [FlightMode.DISARMED, FlightMode.HOLD])
def test_a_trajectory_that_fails_ends_a_flight_that_is_not_in_the_air_and_no_other(start_node, callbacks, mode):
    owner = owning(start_node, callbacks, "flight.roles:=simulator,trajectory,commander", "flight.mode:=realtime")
    owner.callbacks["flight/mode"](serialize_message(FlightMode(mode=mode)))
    owner.phase, given_up = FlightState.FLYING, []
    owner.give_up = given_up.append
    status = NodeStatus(node="/trajectory", role="trajectory", state=NodeStatus.FAULT, period_steps=5, detail="no plan")
    status.plant_period, status.interface_hash = owner.node.flight.plant_period, owner.handshake._hash
    owner.callbacks["flight/nodes"](status)
    assert given_up == (["trajectory failed: no plan"] if mode == FlightMode.DISARMED else [])


def test_a_flight_that_has_not_begun_ends_when_its_starter_is_gone(owner):
    owner.node.starter.pid = 2**22 + 1  # Linux gives no process such a number
    owner.watch()
    assert (owner.phase, owner._reason) == (FlightState.FAILED, "the process that started the flight is gone")


def test_before_the_flight_a_commander_excuses_no_node_that_does_not_fit(start_node, callbacks):
    owner = owning(start_node, callbacks, "flight.roles:=simulator,trajectory,commander")
    status = NodeStatus(node="/trajectory", role="trajectory", state=NodeStatus.READY, period_steps=5)
    status.plant_period, status.interface_hash = 4_000_000, owner.handshake._hash
    owner.callbacks["flight/nodes"](status)
    assert (owner.phase, owner.node.exit_code) == (FlightState.FAILED, 1)


def test_a_kill_stops_the_motors_of_a_flight_that_was_given_up_too(start_node, callbacks):
    owner = owning(start_node, callbacks, "flight.roles:=simulator,commander")
    flown = []
    for step, asked in enumerate((GuardRequest.NONE, GuardRequest.NONE, GuardRequest.KILL)):
        mode = FlightMode(mode=FlightMode.HOLD, guard_request=asked)
        owner.callbacks["flight/mode"](serialize_message(mode))
        sample = StateSample(VehicleState(Vec3(0.0, 0.0, 2.0 + 1e-3 * step)), step, True)
        flown.append(owner.guarded(WrenchCommand(Wrench(5.5), step, True), sample, step).thrust > 0.0)
        owner.phase = FlightState.FLYING
        owner.give_up("attitude_controller failed")
    assert (owner.gives_up, flown) == (True, [True, True, False])


def test_a_recorder_that_fails_after_the_end_is_heard(owner):
    owner.end(FlightState.ENDED, "")
    assert not owner.node.done.done()
    status = NodeStatus(node="/recorder", role="recorder", state=NodeStatus.FAULT, detail="disk full", period_steps=1)
    status.plant_period, status.interface_hash = 2_000_000, owner.handshake._hash
    owner.callbacks["flight/nodes"](status)
    assert (owner.node.done.done(), owner.node.exit_code) == (True, 1)


def test_while_it_waits_it_says_who_was_heard_and_does_not_belong(owner, monkeypatch):
    said = []
    monkeypatch.setattr(owner._flight_state, "publish", said.append)
    owner.callbacks["flight/nodes"](NodeStatus(node="/eight", role="traject"))
    owner.publish_flight_state()
    assert said[0].reason.startswith("waiting for trajectory, ")
    assert "; flight/nodes of /eight has role 'traject', expected one of trajectory, " in said[0].reason


def test_an_acknowledgement_of_another_run_is_foreign_whatever_its_step(start_node, callbacks):
    owner = owning(start_node, callbacks, "flight.run_id:=a1")
    for run, counted in ((7, "foreign_run"), (owner.node.run, "rejected_future")):
        before = owner.node.events.counts[counted]
        owner.callbacks["flight/recorded"](RecorderAck(step=5, run=run))
        assert owner.node.events.counts[counted] == before + 1
    assert (owner.node.events.counts["rejected"], owner.recorded_step) == (1, -1)
