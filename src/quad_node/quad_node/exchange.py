"""Exchange in flight: a shadow controller takes the place of its own, which is silent, or when it is asked to.

Both see the same inputs from step 0, so the memory of the shadow is warm. The decision is the shadow's: it hears what
the other answers, and takes over when that is ``flight.takeover_age`` behind the state, in steps and by the clock, or,
in lockstep, when the plant asks a second time for a step. What the other sent last, or
did not get out before it died, is then sent in its place: who dies in the middle of sending has reached some readers
only, and the recorder would wait for ever. From then on it sends on the flying topics too, and says so
on ``flight/takeover``, latched: who was replaced sends nothing any more, and neither does it when it is started again.
On request that is said some answers ahead, so that of each step there is one answer.
"""

import struct
import time
from collections import deque
from collections.abc import Callable
from itertools import chain
from typing import Any

from rclpy.publisher import Publisher
from std_srvs.srv import Trigger

from quad_core.cascade import SHADOW, Stage
from quad_core.cycle import seconds
from quad_msgs.msg import FlightEvent, NodeStatus
from quad_node.conversion import NANOSECONDS
from quad_node.flight_node import FlightNode
from quad_node.handshake import is_foreign

_STAMP = struct.Struct("<iI")
_NEVER = 2**62

_ASKED_AGAIN = 2
"""In lockstep: times that the plant repeats a state before the shadow answers in the other's place."""

_ASKED_IN_VAIN = 10
"""The same where the shadow has heard an answer that may have reached nobody else, and nothing since."""

_RECENT = 64
"""Answers, the other's and its own, that a standby can send again: more than the window of the lockstep."""

_AHEAD = 20
"""On request: answers between the announcement and the takeover."""


class StageNode(FlightNode):
    """What is used here of a `LawNode`, which uses this module: its stage, where it sends, and what it sent last."""

    stage: Stage
    outputs: list[Publisher]
    inside: list[Publisher]
    answers: list[tuple[Publisher, Any]]


class Exchange:
    """A controller that nothing stands in for, and that stands in for nothing."""

    def before(self, step: int) -> None:
        """Decide who is obeyed, before the answer to ``step`` is sent."""

    def asked_again(self, step: int) -> None:
        """Decide who is obeyed, the state of ``step`` having come again."""


class Flying(Exchange):
    """The controller that flies from the start; it is silent once it was replaced."""

    def __init__(self, node: StageNode) -> None:
        """Listen for who takes over."""
        self._node, self._until, self._why = node, _NEVER, ""
        node.subscribe("flight/takeover", self._on_takeover)

    def before(self, step: int) -> None:
        """Be silent from the step on at which the other flies."""
        node = self._node
        if step >= self._until and node.outputs:
            node.outputs, node.inside = [], []
            stamp = step * node.flight.plant_period
            node.event(FlightEvent.WARNING, "replaced", f"{self._why}; this node is silent", stamp, always=True)

    def asked_again(self, step: int) -> None:
        """Do not repeat what the other has answered."""
        if step >= self._until:
            self._node.answers = []

    def _on_takeover(self, message: NodeStatus) -> None:
        node = self._node
        if message.role == SHADOW + node.role and not is_foreign(message.run_id, node.flight.run_id):
            self._until = int(message.step)
            self._why = f"{message.role} flies since step {message.step}: {message.detail}"


class Standby(Exchange):
    """A shadow that may take over."""

    def __init__(self, node: StageNode) -> None:
        """Read the other's answers, offer the service `<role>/take_over`, and have what it takes to be obeyed."""
        self._node, stage = node, node.stage
        self._flies, self._requested, self._from = False, False, _NEVER
        self._others = {topic: deque[bytes](maxlen=_RECENT) for topic in (stage.gives, stage.internals_topic)}
        self._newest = dict.fromkeys((stage.gives, stage.internals_topic), -1)
        self._heard, self._repeats = time.monotonic(), 0
        self._recent: deque[list[tuple[Publisher, Any]]] = deque(maxlen=_RECENT)
        self._main = [node.publisher(stage.gives, obeyed=True), node.publisher(stage.internals_topic, obeyed=True)]
        self._announce = node.publisher("flight/takeover", match=False)
        for topic in self._newest:
            node.subscribe(topic, self._hears(topic), raw=True)
        self._service = node.create_service(Trigger, f"{stage.role}/take_over", self._on_call)

    def before(self, step: int) -> None:
        """Take over if that was asked for, or in real time if the other is silent."""
        self._recent.append(self._node.answers)
        newest = self._newest[self._node.stage.gives]
        late = seconds(step - newest, self._node.flight.plant_period)
        quiet, limit = time.monotonic() - self._heard, self._node.flight.takeover_age
        # both: who was stopped itself finds a queue of old states, but the other's answers among them
        silent = not self._node.lockstep and newest >= 0 and late > limit and quiet > limit
        if self._flies:
            return
        if silent:
            self._say(step, f"nothing from {self._node.stage.role} for {quiet * 1e3:.0f} ms")
        elif self._requested and self._from == _NEVER:
            self._say(step + _AHEAD * self._node.period_steps, "asked for by service")
        if step >= self._from:
            self._fly()

    def asked_again(self, step: int) -> None:
        """Lockstep: answer in the other's place what it has not answered."""
        if not self._node.lockstep or self._flies:
            return
        self._repeats += 1
        # who lives sends its answer again, too: then the plant waits for somebody else
        if self._repeats >= (_ASKED_AGAIN if min(self._newest.values()) < step else _ASKED_IN_VAIN):
            self._say(step, f"{self._node.stage.role} does not answer step {step}")
            self._fly()
            self._node.answers = [*self._lost(), *self._node.answers]

    def _lost(self) -> list[tuple[Publisher, Any]]:
        """Return for the other's topics what it sent last, and in its place what it has not sent."""
        node = self._node
        own = (node.outputs[1], node.inside[1])
        twins = dict(zip(own, zip(self._main, self._newest.values(), strict=True), strict=True))
        again = [
            (main, sent) for main, all_sent in zip(self._main, self._others.values(), strict=True) for sent in all_sent
        ]
        every = chain.from_iterable((*self._recent, node.answers))
        lost = [(twins[sender][0], message) for sender, message in every if self._step_of(message) > twins[sender][1]]
        return again + lost

    def _fly(self) -> None:
        node, self._flies = self._node, True
        node.outputs, node.inside = [self._main[0], *node.outputs], [self._main[1], *node.inside]

    def _say(self, step: int, why: str) -> None:
        """Publish from which ``step`` on this node flies, and why."""
        node, self._from = self._node, step
        self._announce.publish(
            NodeStatus(
                node=node.get_fully_qualified_name(),
                role=node.role,
                run_id=node.flight.run_id,
                step=step,
                detail=why,
            )
        )
        text = f"step {step}: {node.role} flies: {why}"
        node.event(FlightEvent.WARNING, "taken_over", text, step * node.flight.plant_period, always=True)

    def _step_of(self, payload: bytes) -> int:
        seconds_part, nanoseconds = _STAMP.unpack_from(payload, 4)
        return int(seconds_part * NANOSECONDS + nanoseconds) // self._node.flight.plant_period

    def _hears(self, topic: str) -> Callable[[bytes], None]:
        def on_other(payload: bytes) -> None:
            if not self._flies and len(payload) >= 12:
                self._newest[topic] = max(self._newest[topic], self._step_of(payload))
                self._others[topic].append(payload)
                self._heard, self._repeats = time.monotonic(), 0

        return on_other

    def _on_call(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = not self._flies
        response.message = "it flies already" if self._flies else f"takes effect {_AHEAD} answers later"
        self._requested = True
        return response


def exchange_of(node: StageNode) -> Exchange:
    """Return what ``node`` has to do with another controller of its stage."""
    if not node.flight.standby:
        return Exchange()
    if node.shadow:
        return Standby(node)
    return Flying(node) if SHADOW + node.role in node.roles else Exchange()
