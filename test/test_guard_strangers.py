"""What a stranger says in a flight: refused, counted and named, and the judge of the bag sees it."""

import time

import numpy as np
import pytest
from flying import LOW, PATIENT, domain_of, finish, run_id_of, start, stranger, wait_until, wait_until_flying
from geometry_msgs.msg import WrenchStamped

from quad_flight_log.reader import open_flight
from quad_msgs.msg import (
    AttitudeThrust,
    FlightPlan,
    FlightState,
    NodeStatus,
    RecorderAck,
    TrajectoryPoint,
    VehicleState,
)
from quad_node.codec import set_stamp
from quad_node.handshake import run_number
from quad_node.topics import TOPICS, latched, stream

pytestmark = pytest.mark.flight

SECONDS = 2.0
HOVER = ("hover", *LOW, "--duration", "7", "--limits", "position_max=5", *PATIENT)
CLOCKS = [pytest.param(("--realtime",), id="realtime", marks=pytest.mark.wall_clock), pytest.param((), id="lockstep")]


def wrench(thrust, stamp_ns):
    message = WrenchStamped()
    message.header.frame_id = "base_link"
    message.wrench.force.z = thrust
    set_stamp(message.header.stamp, stamp_ns)
    return message


@pytest.mark.wall_clock
def test_wrenches_and_plans_of_a_stranger_change_nothing(tmp_path):
    out = tmp_path / "bag"
    flight = start(*HOVER, "--realtime", "--out", out)
    wait_until_flying(flight, out)
    with stranger(domain_of(flight.pid)) as node:
        out_again = node.create_publisher(WrenchStamped, "wrench_setpoint", stream(10))
        plans = node.create_publisher(FlightPlan, "flight/plan", latched(2))
        nodes = node.create_publisher(NodeStatus, "flight/nodes", latched(2))
        states = node.create_publisher(FlightState, "flight/state", latched(2))
        wait_until(lambda: nodes.get_subscription_count() >= 2, 20.0, "simulator and recorder")
        wait_until(lambda: states.get_subscription_count() >= 4, 20.0, "the nodes")
        wait_until(lambda: out_again.get_subscription_count() >= 1, 20.0, "the simulator")
        wait_until(lambda: plans.get_subscription_count() >= 1, 20.0, "the simulator")
        run = run_number(run_id_of(flight.pid))  # as whoever means this flight would send it
        for end_step in (1, 2**63):
            plans.publish(FlightPlan(trajectory="stranger", start="printed", end_step=end_step, run=run))
            time.sleep(1.5)  # events of one kind are a second apart
        plans.publish(FlightPlan(trajectory="of another run", start="printed", end_step=1))
        # an empty run id belongs to nobody: this failure ends no flight
        nodes.publish(NodeStatus(node="/x", role="recorder", state=NodeStatus.FAULT, detail="I am a stranger"))
        states.publish(FlightState(state=FlightState.FAILED, reason="I am a stranger"))
        began = time.monotonic()
        sent = 0
        while time.monotonic() - began < SECONDS:
            # 100 m/s^2 up, for a step that is over and for one that is yet to come
            for message in (wrench(50.0, 2_000_000), wrench(50.0, 60_000_000_000)):
                out_again.publish(message)
                sent += 1
            time.sleep(0.01)
        done = finish(flight)
    # the flight flew on to its end, but its bag holds a stranger's messages, and the judge says so
    assert done.returncode == 1, done.stdout + done.stderr
    assert "different messages with equal stamps (wrench_setpoint: " in done.stderr
    bag = open_flight(out)
    assert bag.metadata["outcome"] == "ended"
    assert bag.array("flight/events")["kind"].tolist().count("far_ahead") >= 1
    assert int(bag.array("wrench_setpoint")["stamp_ns"].max()) < 30_000_000_000
    guard = bag.array("flight/guard")
    assert not guard["mode"].any()
    assert int(guard["refused_commands"][-1]) > 0.5 * sent
    events = bag.array("flight/events")
    assert "flight/plan of another run ignored" in events["text"][events["kind"] == "foreign_run"].tolist()
    texts = [str(text) for text in events["text"][events["kind"] == "guard_refused"]]
    second = [str(text) for text in events["text"][events["kind"] == "second_publisher"]]
    assert any("one publisher of wrench_setpoint, there are 2: /attitude_controller, /" in text for text in second)
    refused = [str(text) for text in events["text"][events["kind"] == "rejected_plan"]]
    assert any("end_step 1, " in text for text in refused), refused
    assert any(f"end_step {2**63}, " in text for text in refused), refused
    assert any("not newer than the last" in text for text in texts), texts
    assert any("not published yet" in text for text in texts), texts


def absurd(topic, step, run):
    """Return a message of ``topic`` for ``step`` and all later ones whose numbers are finite and larger than any."""
    message = TOPICS[topic].type(step=step, run=run)
    for name, kind in message.get_fields_and_field_types().items():
        if kind == "double":
            setattr(message, name, 1e300)
        elif kind.startswith("double["):
            setattr(message, name, [1e300] * len(getattr(message, name)))
    if hasattr(message, "next_step"):
        message.next_step = 2**64 - 1
    return message


@pytest.mark.parametrize("clock", CLOCKS)
def test_absurd_steps_and_numbers_and_those_of_another_run_change_nothing(tmp_path, clock):
    """Of another run: the vehicle 100 m away, a reference there, no thrust. Of this one: more than any number."""
    out = tmp_path / "bag"
    flight = start(*HOVER, *clock, "--out", out)
    wait_until_flying(flight, out)
    with stranger(domain_of(flight.pid)) as node:
        inputs = ("reference", "attitude_setpoint", "actuation")
        made = {topic: node.create_publisher(TOPICS[topic].type, topic, stream(10)) for topic in (*inputs, "state")}
        made["flight/recorded"] = node.create_publisher(RecorderAck, "flight/recorded", stream(10))
        wait_until(lambda: all(each.get_subscription_count() for each in made.values()), 20.0, "subscribers")
        away = {"p_w": [100.0, 0.0, 5.0], "run": run_number("another run")}
        far = VehicleState(**away, q_wb=[0.0, 0.0, 0.0, 1.0])
        good = (far, TrajectoryPoint(**away), AttitudeThrust(run=away["run"]))
        run = run_number(run_id_of(flight.pid))  # it has read whose messages are accepted
        for k in range(50):
            for topic, message in zip(("state", "reference", "attitude_setpoint"), good, strict=True):
                message.step = 4000 + k
                made[topic].publish(message)
            for _ in range(3):  # two that follow each other were accepted
                made["state"].publish(VehicleState(step=2**63, run=run))
            for topic in inputs:
                made[topic].publish(absurd(topic, 0, run))
            made["flight/recorded"].publish(RecorderAck(step=2**64 - 1, run=run))
            time.sleep(0.01)
        done = finish(flight)
    # flown as if nothing had been sent, but the bag shows more than one sender
    assert done.returncode == 1, done.stdout + done.stderr
    bag = open_flight(out)
    assert bag.metadata["outcome"] == "ended"
    verdict = done.stderr.partition("different messages with equal stamps (")[2]
    assert any(topic in verdict for topic in made), done.stderr
    assert not bag.array("flight/guard")["mode"].any()
    events = bag.array("flight/events")
    assert {"rejected_future", "rejected_nonfinite", "second_publisher", "foreign_run"} <= set(events["kind"])
    said = events["text"][events["kind"] == "foreign_run"].tolist()  # of one kind at most once a second
    assert {text.rpartition(" of another run ignored")[0] for text in said} <= {*made}
    truth = bag.array("truth")["p_w"]
    assert np.abs(truth[:, 0]).max() < 1.0
    assert abs(truth[-1] - [0.0, 0.0, 0.8]).max() < 0.1
