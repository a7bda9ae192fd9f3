"""The floor of the ROS loop: nodes of plain rclpy that pass the messages of a flight round and compute nothing.

Topics, types, QoS, executor, scheduling, order of waiting and rates are those of the flight stack; messages are filled
once and published again and again. The recorder subscribes raw and counts; with --record it writes a bag. Run by
``ros_loop``.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from quad_core.cascade import ATTITUDE, POSITION, RECORDER, SIMULATOR, TRAJECTORY
from quad_flight_log.payload_check import definition_of
from quad_flight_log.writer import BagWriter
from quad_node import topics
from quad_node.executor import SPIN_TIMEOUT, init, settle

PERIOD = 2_000_000
SLOW = 5
ACK = 20
SETTLED = 25  # ticks of 20 ms


class Relay(Node):
    """One role of the flight; ``done`` completes when the simulator has flown ``steps``."""

    def __init__(self, role: str, steps: int, roles: tuple[str, ...], bag: BagWriter | None = None) -> None:
        super().__init__(role, enable_rosout=False, start_parameter_services=False)
        self.role, self.steps, self.roles, self.bag = role, steps, roles, bag
        self.done = Future()
        self.out = {}
        self.have = dict.fromkeys(("state", "reference", "attitude_setpoint", "actuation"), -1)
        self.answered, self.count, self.step, self.began, self.ticks = -1, 0, 0, 0.0, 0
        for name, topic in topics.TOPICS.items():
            if role in topic.publishers and (topic.step or name == "flight/recorded"):
                publisher = self.create_publisher(topic.type, name, topic.qos(topic.history(lockstep=True)))
                message = topic.type()
                self.out[name] = (publisher, message, getattr(message, "header", message))
            if role in topic.subscribers and (topic.step or name == "flight/recorded"):
                raw = role == RECORDER
                depth = 1000 if raw else 10
                self.create_subscription(topic.type, name, self.hearer(name), topic.qos(depth), raw=raw)
        self.create_timer(0.02, self.tick)

    def send(self, name: str, step: int) -> None:
        """Publish the prepared message of a topic with step and stamp of ``step``."""
        publisher, message, stamped = self.out[name]
        if stamped is message:
            message.step = step
        if name != "flight/recorded":
            stamped.stamp.sec, stamped.stamp.nanosec = divmod(step * PERIOD, 1_000_000_000)
        publisher.publish(message)

    def hearer(self, name: str) -> Callable[[Any], None]:
        """Return the callback of a topic."""
        if self.role == RECORDER:
            return self.on_raw(name)
        if name == "wrench_setpoint":
            return self.on_wrench
        if name == "flight/recorded":
            return lambda _message: None

        def on_message(message: Any) -> None:
            self.have[name] = message.step
            self.answer()

        return on_message

    def answer(self) -> None:
        """Answer a state when all that belongs to it is there."""
        step, have = self.have["state"], self.have
        if step <= self.answered:
            return
        slow = step - step % SLOW
        if self.role == TRAJECTORY and step == slow:
            self.answered = step
            self.send("reference", step)
        elif self.role == POSITION and step == slow:
            if have["reference"] >= step and have["actuation"] >= step - 1:
                self.answered = step
                self.send("attitude_setpoint", step)
                self.send("position_controller/internals", step)
        elif self.role == ATTITUDE and have["attitude_setpoint"] >= slow and have["actuation"] >= step - 1:
            self.answered = step
            self.send("wrench_setpoint", step)
            self.send("attitude_controller/internals", step)

    def on_raw(self, name: str) -> Callable[[bytes], None]:
        """Return what keeps or counts the messages of a topic, and acknowledges now and then."""
        kind: Any = topics.TOPICS[name].type
        handle = self.bag.add_topic(f"/{name}", definition_of(kind)) if self.bag else 0

        def keep(payload: bytes) -> None:
            self.count += 1
            if self.bag:
                self.bag.write(handle, payload, self.count, time.time_ns())
            if self.count % (6 * ACK) == 0:
                self.send("flight/recorded", self.count // 6)

        return keep

    def on_wrench(self, message: Any) -> None:
        """Go on with the next step once the answer to this one has come."""
        stamp = message.header.stamp
        if (stamp.sec * 1_000_000_000 + stamp.nanosec) // PERIOD != self.step:
            return
        self.send("actuation", self.step)
        self.step += 1
        if self.step < self.steps:
            self.publish_step()
            return
        say({"steps": self.steps, "wall": time.monotonic() - self.began})
        self.done.set_result(None)

    def publish_step(self) -> None:
        """Publish a state and what only the recorder takes."""
        self.send("state", self.step)
        self.send("truth", self.step)
        self.send("disturbance", self.step)

    def tick(self) -> None:
        """Begin when everyone is matched."""
        if self.role != SIMULATOR or self.began or not all(self.matched(name) for name in self.out):
            return
        self.ticks += 1  # the others need a moment more, which nobody reports: a sample before it is lost
        if self.ticks <= SETTLED:
            return
        if self.count_publishers("wrench_setpoint") and self.count_subscribers("wrench_setpoint") > 1:
            self.began = time.monotonic()
            say({"began": True})
            self.publish_step()

    def matched(self, name: str) -> bool:
        """Tell whether all subscribers of a topic are there."""
        expected = sum(role in self.roles for role in topics.TOPICS[name].subscribers)
        return self.out[name][0].get_subscription_count() >= expected


def say(facts: dict[str, object]) -> None:
    """Tell the parent one line."""
    sys.stdout.write(json.dumps(facts) + "\n")
    sys.stdout.flush()


def main() -> None:
    """Run one role, or all in this process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", choices=["all", *topics._ALL])
    parser.add_argument("--steps", type=int, default=5000)
    parser.add_argument("--record", type=Path, metavar="DIR", help="write a bag there")
    options = parser.parse_args()
    init([])
    everyone = tuple(topics._ALL)
    bag = BagWriter(options.record) if options.record else None
    roles = everyone if options.role == "all" else (options.role,)
    relays = [Relay(role, options.steps, everyone, bag) for role in roles]
    settle(0, aside=roles == (RECORDER,))
    try:
        executor = EventsExecutor()
        for relay in relays:
            executor.add_node(relay)
        while rclpy.ok() and not relays[0].done.done():
            executor.spin_until_future_complete(relays[0].done, timeout_sec=SPIN_TIMEOUT)
    except KeyboardInterrupt:
        pass
    finally:
        if bag:
            bag.close({})
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
