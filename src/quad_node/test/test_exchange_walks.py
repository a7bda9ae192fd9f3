"""Two controllers in lockstep, asked, killed and started again at random moments, their messages late at will.

Whatever happens each step has one answer, and nobody flies with a memory that is not warm.
"""

import random
import struct
from collections import deque
from types import SimpleNamespace

import pytest

from quad_core.flight_parameters import FlightParameters
from quad_msgs.msg import NodeStatus
from quad_node.exchange import WARM, Paired

pytestmark = pytest.mark.unit

PERIOD = 2_000_000
EVERY = 5
WARM_STEPS = int(WARM * 1e9) // PERIOD
MAIN, SHADOW = "position_controller", "shadow_position_controller"
STAGE = SimpleNamespace(role=MAIN, gives="answer", internals_topic="inside")


class Sender:
    """A publisher on the wire."""

    def __init__(self, node, topic):
        self.node, self.topic, self.latched = node, topic, deque(maxlen=10)

    def publish(self, message):
        if self.topic == "flight/takeover":
            self.latched.append(message)
        self.node.wire.send(self.topic, message)


class Controller:
    """A node with an exchange; its answer to a step is when its memory began."""

    def __init__(self, wire, role):
        self.wire, self.role, self.shadow = wire, role, role == SHADOW
        self.flight, self.lockstep, self.period_steps = FlightParameters(standby=True), True, EVERY
        self.stage, self.events = STAGE, []
        self.inbox, self.senders, self.callbacks = deque(), [], {}
        aside = "aside/" if self.shadow else ""
        self.outputs, self.inside = [self.publisher(aside + "answer")], [self.publisher(aside + "inside")]
        self.answers, self.seen, self.due, self.began = [], -1, 0, -1
        self.exchange = Paired(self)
        wire.join(self)

    def publisher(self, topic, match=True, obeyed=False):
        self.senders.append(Sender(self, topic))
        return self.senders[-1]

    def subscribe(self, topic, callback, raw=False):
        self.callbacks[topic] = callback

    def create_service(self, kind, name, callback):
        self.service = callback

    def is_foreign(self, topic, run):
        return False

    def event(self, severity, kind, text, stamp_ns=0, always=False):
        self.events.append(kind)

    def set_status(self, state, detail):
        assert state == NodeStatus.READY

    def get_fully_qualified_name(self):
        return f"/{self.role}"

    def on_state(self, step):
        if self.seen < 0 < step:
            self.due = -(-step // EVERY) * EVERY
            assert self.exchange.comes_late(self.due)
        again, self.seen = step == self.seen, step
        if again:
            self.exchange.asked_again(step)
            for sender, message in self.answers:
                sender.publish(message)
        elif step >= self.due:
            self.due = step + EVERY
            self.began = step if self.began < 0 else self.began
            self.answers = []
            self.exchange.before(step)
            stamp = step * PERIOD
            message = struct.pack("<4xiIi", stamp // 10**9, stamp % 10**9, self.began)
            for place, senders in enumerate((self.outputs, self.inside)):
                self.exchange.keep(place, message)
                for sender in senders:
                    sender.publish(message)
                    self.answers.append((sender, message))

    def ask(self):
        response = SimpleNamespace()
        self.service(None, response)
        return response.success


class Wire:
    """A plant that waits for answers, and two controllers whose messages arrive in their own time."""

    def __init__(self, seed):
        self.chance = random.Random(seed)
        self.nodes, self.step, self.repeats, self.answers = {}, 0, 0, {"answer": {}, "inside": {}}
        for role in (MAIN, SHADOW):
            Controller(self, role)

    def join(self, node):
        self.nodes[node.role] = node
        for other in self.nodes.values():
            for sender in other.senders:
                for message in sender.latched:
                    self.give(node, sender.topic, message)

    def kill(self, role):
        self.nodes.pop(role)

    def send(self, topic, message):
        if topic in self.answers:
            seconds, nanoseconds, began = struct.unpack("<4xiIi", message)
            step = (seconds * 10**9 + nanoseconds) // PERIOD
            self.answers[topic].setdefault(step, set()).add(began)
        for node in self.nodes.values():
            self.give(node, topic, message)

    def give(self, node, topic, message):
        if topic in node.callbacks:
            node.inbox.append((node.callbacks[topic], message))

    def go_on(self):
        """Let one thing happen: a message is received, or the plant takes a step, or asks again."""
        waiting = [node for node in self.nodes.values() if node.inbox]
        if self.step in self.answers["answer"] or self.step % EVERY:
            if not waiting or self.chance.random() < 0.7:
                self.step, self.repeats = self.step + 1, 0
                self.publish_state()
                return
        elif not waiting:
            self.repeats += 1
            self.publish_state()
            return
        callback, message = self.chance.choice(waiting).inbox.popleft()
        callback(message)

    def publish_state(self):
        for node in self.nodes.values():
            node.inbox.append((node.on_state, self.step))

    def fly(self, steps):
        """Go on for some steps; returns whether somebody answered until then."""
        end = self.step + steps
        while self.step < end and self.repeats <= 6:
            self.go_on()
        return self.step >= end

    def flying(self):
        return [role for role, node in self.nodes.items() if node.exchange.flies]


@pytest.mark.parametrize("seed", range(40))
def test_each_step_has_one_answer_of_a_warm_memory(seed):
    wire = Wire(seed)
    chance = wire.chance
    exchanges = 0
    for _ in range(8):
        assert wire.fly(chance.randrange(WARM_STEPS + 100, WARM_STEPS + 400))
        flying, standing = (MAIN, SHADOW) if MAIN in wire.flying() else (SHADOW, MAIN)
        assert wire.flying() == [flying]
        happens = chance.choice(
            ["ask", "kill the flier", "kill the standby", "ask and kill the flier", "ask and kill the standby"]
        )
        if "ask" in happens:
            assert wire.nodes[standing].ask()
            exchanges += "standby" not in happens
            assert wire.fly(chance.randrange(0, 130))
        if "kill" in happens:
            killed = flying if "flier" in happens else standing
            exchanges += happens == "kill the flier"
            wire.kill(killed)
            assert wire.fly(chance.randrange(0, 50))
            Controller(wire, killed)
    assert wire.fly(WARM_STEPS)
    for topic, steps in wire.answers.items():
        assert sorted(steps)[:-1] == list(range(0, wire.step - wire.step % EVERY + 1, EVERY))[: len(steps) - 1], topic
        assert [step for step, begun in steps.items() if len(begun) != 1] == [], topic
        for step, begun in steps.items():
            assert all(began == 0 or step - began >= WARM_STEPS for began in begun)
    assert exchanges


def test_a_cold_standby_leaves_a_dead_flier_s_steps_to_the_guard():
    wire = Wire(1)
    wire.fly(100)
    wire.kill(MAIN)
    assert wire.fly(100)
    Controller(wire, MAIN)
    assert wire.fly(WARM_STEPS - 10)
    wire.kill(SHADOW)
    assert not wire.fly(10)
    assert wire.flying() == []
    assert "not_warm" in wire.nodes[MAIN].events


def test_both_started_again_fly_no_more():
    wire = Wire(1)
    wire.fly(100)
    for role in (MAIN, SHADOW):
        wire.kill(role)
    for role in (MAIN, SHADOW):
        Controller(wire, role)
    assert not wire.fly(10)
    assert wire.flying() == []
