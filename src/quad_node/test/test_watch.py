"""FlightWatch has the newest flight/state of its run at once, however late it joins."""

import time

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from quad_msgs.msg import FlightEvent, FlightState
from quad_node import topics, watch
from quad_node.handshake import run_number

DOMAIN = 87


@pytest.mark.ros
def test_who_joins_late_has_the_newest_state_and_none_of_another_run():
    context = Context()
    rclpy.init(args=[], context=context, domain_id=DOMAIN, signal_handler_options=SignalHandlerOptions.NO)
    node = Node("simulator", context=context, enable_rosout=False, start_parameter_services=False)
    entry = topics.TOPICS["flight/state"]
    states = node.create_publisher(entry.type, entry.name, entry.qos())
    for step in range(6):
        phase = FlightState.WAITING if step < 2 else FlightState.FLYING
        states.publish(FlightState(state=phase, step=step, run=run_number("mine")))
    states.publish(FlightState(state=FlightState.FAILED, step=9, run=run_number("another")))
    late = watch.FlightWatch("mine", DOMAIN)
    try:
        seen, deadline = None, time.monotonic() + 20.0
        while seen is None and time.monotonic() < deadline:
            seen = late.poll(0.1)
        assert seen is not None
        time.sleep(0.2)  # what was said before is sent one after the other
        seen = late.poll(0.1)
        assert (seen.state, seen.step) == (watch.FLYING, 5)
    finally:
        late.close()
        node.destroy_node()
        context.try_shutdown()


def test_what_acts_from_the_first_step_on_is_news():
    seen = watch.FlightWatch.__new__(watch.FlightWatch)
    seen.news, seen._warned = watch.deque(), {}
    seen._on_event(FlightEvent(node="/simulator", kind="payload", text="begins: payload start=0 mass=0.3"))
    assert list(seen.news) == [(0.0, "begins: payload start=0 mass=0.3")]


def test_of_a_kind_of_warning_from_a_node_the_first_is_news():
    seen = watch.FlightWatch.__new__(watch.FlightWatch)
    seen.news, seen._warned = watch.deque(), {}
    for node, severity, kind, text in (
        ("/relay", FlightEvent.WARNING, "late", "nothing for 60 ms"),
        ("/relay", FlightEvent.WARNING, "late", "nothing for 70 ms"),
        ("/relay", FlightEvent.INFO, "parameter_set", "delay = 0.1"),
        ("/relay", FlightEvent.ERROR, "silent", "est/odom: silent"),
        ("/uav/simulator", FlightEvent.ERROR, "handshake", "relay failed: est/odom: silent"),
        ("/uav/simulator", FlightEvent.WARNING, "late", "state: late"),
        ("/commander", FlightEvent.INFO, "mode", "HOLD to LAND"),
        ("/uav/simulator", FlightEvent.INFO, "gust", "begins: gust start=4 end=5 velocity=0,6,0"),
    ):
        event = FlightEvent(node=node, severity=severity, kind=kind, text=text)
        event.stamp.sec = 4
        seen._on_event(event)
    assert [text for _, text in seen.news] == [
        "relay: nothing for 60 ms",
        "relay: est/odom: silent",
        "simulator: state: late",
        "HOLD to LAND",
        "begins: gust start=4 end=5 velocity=0,6,0",
    ]
    assert {time for time, _ in seen.news} == {4.0}
