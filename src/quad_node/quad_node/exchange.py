"""Exchange in flight: of two controllers of one stage one flies; the other stands by and computes along.

Both are the same machine. The first to fly is the controller, its shadow stands by; after that the newest message on
``flight/takeover`` says who flies, latched, so that also a process that was started again knows. Who stands by hears
what the other answers and sends nothing that is obeyed. It takes over when that is ``flight.takeover_age`` behind the
state, in steps and by the clock, or, in lockstep, when the plant asks again for a step, or on request: and only with a
warm memory. Who was replaced, and who came into the flight late, stands by in turn.

In lockstep each step must have one answer. What a dead one sent last, or did not get out, is sent in its place: who
dies in the middle of sending has reached some readers only, and the recorder would wait for ever. On request who
leaves says at which step, for who comes does not know what the other has answered.
"""

import time
from collections.abc import Callable
from typing import Any

from rclpy.publisher import Publisher
from std_srvs.srv import Trigger

from quad_core.cascade import COMMAND, SHADOW, Stage
from quad_core.cycle import seconds
from quad_msgs.msg import FlightEvent, NodeStatus, Takeover
from quad_node.codec import head_of
from quad_node.conversion import NANOSECONDS
from quad_node.flight_node import FlightNode
from quad_node.handshake import is_foreign
from quad_node.recent_answers import Placed, RecentAnswers

_NEVER = 2**62

WARM = 2.0
"""s of answers without a gap after which a memory that began in flight may fly: four times what the filters of our laws
need to settle, 0.5 s. What integrates does not settle by computing along, however long (docs/explanation/safety.md)."""

_ASKED_AGAIN = 2
"""In lockstep: times that the plant repeats a state before who stands by answers in the other's place."""

_ASKED_IN_VAIN = 4
"""The same where one more repeat is cheaper than a wrong guess: the other has answered and may live, or its memory is
another, so that two answers to one step would differ. Less than the plant's patience, simulator.repeat_limit."""

_AHEAD = 20
"""On request: answers between the announcement and the takeover."""


class StageNode(FlightNode):
    """What is used here of a `LawNode`, which uses this module: its stage, where it sends, and what it sent last."""

    stage: Stage
    outputs: list[Publisher]
    inside: list[Publisher]
    answers: list[tuple[Publisher, Any]]


class Exchange:
    """A controller that nothing stands in for, and that stands in for nothing. ``flies``: others wait for it."""

    def __init__(self, node: StageNode) -> None:
        """A shadow computes, and is obeyed by nobody."""
        self.node = node
        self.flies = not node.shadow

    def comes_late(self, step: int) -> bool:  # noqa: ARG002
        """Return whether to take part from ``step`` on: a controller that flew would do so with an empty memory."""
        return self.node.shadow

    def before(self, step: int) -> None:
        """Decide who is obeyed, before the answer to ``step`` is sent."""

    def keep(self, place: int, message: bytes) -> None:
        """Take in what was computed: the answer, ``place`` 0, or its internals, 1."""

    def asked_again(self, step: int) -> None:
        """Decide who is obeyed, the state of ``step`` having come again."""


class Paired(Exchange):
    """One of two controllers of a stage: it flies, or it stands by."""

    def __init__(self, node: StageNode) -> None:
        """Listen for who flies and for what the other answers; offer the service `<role>/take_over`."""
        super().__init__(node)
        stage = node.stage
        topics = (stage.gives, stage.internals_topic)
        self._other = stage.role if node.shadow else SHADOW + stage.role
        # what a shadow answers itself is recorded whether it flies or not
        self._aside = [list(sent) if node.shadow else [] for sent in (node.outputs, node.inside)]
        own = [node.outputs[0], node.inside[0]]
        self._obeyed = [node.publisher(topic, obeyed=True) for topic in topics] if node.shadow else own
        # the newest takeover: from which step on, and whether by the controller; of equal steps that one counts
        self._takeover = (-1, True)
        self._message: Takeover | None = None
        self._asked, self._announced, self._from = False, _NEVER, _NEVER
        self._last = self._memory_step = -1
        self._steady, self._is_exact = -_NEVER, True
        self._recent = RecentAnswers(node.flight.plant_period)
        self._heard, self._repeats = time.monotonic(), 0
        self._takeover_out = node.publisher("flight/takeover", match=False)
        node.subscribe("flight/takeover", self._on_takeover)
        for place, topic in enumerate(topics):
            node.subscribe(topic, self._hears(place, topic), raw=True)
        self._service = node.create_service(Trigger, f"{node.role}/take_over", self._on_call)

    def comes_late(self, step: int) -> bool:
        """Stand by with a memory that begins now, whatever the role."""
        node = self.node
        self._steady, self._is_exact = _NEVER, False
        self._stand_by()
        text = f"step {step}: the flight is under way; {node.role} stands by, its memory begins"
        node.event(FlightEvent.WARNING, "stands_by", text, step * node.flight.plant_period, always=True)
        # latched, for the event may come before others have found this node; nobody waits for its links
        node.set_status(NodeStatus.READY, text)
        return True

    def before(self, step: int) -> None:
        """Leave if the other flies from ``step`` on; take over if asked to, or in real time if the other is silent."""
        self._remember(step)
        if self.flies:
            if self._is_replaced(step):
                self._leave(step)
            return
        newest, node = self._recent.newest[0], self.node
        quiet, limit = time.monotonic() - self._heard, node.flight.takeover_age
        late = seconds(step - newest, node.flight.plant_period)
        # both: who was stopped itself finds a queue of old states, but the other's answers among them
        if not node.lockstep and newest >= 0 and late > limit and quiet > limit:
            self._seize(step, f"nothing from {self._other} for {quiet * 1e3:.0f} ms")
        elif self._asked:
            self._asked = False
            self._announced = max(step, newest) + _AHEAD * node.period_steps
            self._say(self._announced, "asked for by service")
            if not node.lockstep:  # there it waits to hear that the other has left
                self._from = self._announced
        if step >= self._from:
            self._fly()

    def keep(self, place: int, message: bytes) -> None:
        """Keep what was computed, for it may be needed in the other's place."""
        self._recent.keep(place, message)

    def asked_again(self, step: int) -> None:
        """Lockstep: answer in the other's place what it has not answered, and do not repeat what it has."""
        if not self.node.lockstep:
            return
        if self.flies:
            if self._is_replaced(step):
                self.node.answers = []
            return
        self._repeats += 1
        # who lives sends its answer again, too: then the plant waits for somebody else
        is_plain = self._is_exact and min(self._recent.newest) < step
        if self._repeats < (_ASKED_AGAIN if is_plain else _ASKED_IN_VAIN):
            return
        if self._seize(step, f"{self._other} does not answer step {step}"):
            lost = self._recent.computed_since([newest + 1 for newest in self._recent.newest])
            self.node.answers = [*self._to_send(self._recent.of_the_other() + lost), *self.node.answers]

    def _to_send(self, messages: Placed) -> list[tuple[Publisher, Any]]:
        return [(self._obeyed[place], message) for place, message in messages]

    def _is_replaced(self, step: int) -> bool:
        return self._takeover[1] == self.node.shadow and step >= self._takeover[0]

    def _remember(self, step: int) -> None:
        """Note since when this node has answered without a gap."""
        node = self.node
        bearable = 0 if node.lockstep else int(node.flight.takeover_age * NANOSECONDS) // node.flight.plant_period
        if self._memory_step < 0:
            self._memory_step = step
            self._steady = min(self._steady, step)
        elif step - self._last > max(bearable, node.period_steps):
            self._steady, self._is_exact = step, False
        self._last = step

    def _refusal(self) -> str:
        """Return why this node must not fly yet, empty if it may."""
        age = seconds(self._last - self._steady, self.node.flight.plant_period)
        if age < WARM:
            return f"its memory is {max(age, 0.0):.2f} s old, expected {WARM:g} s of answers without a gap"
        return f"nothing heard of {self._other}" if self._recent.newest[0] < self._steady else ""

    def _seize(self, step: int, why: str) -> bool:
        """Fly from ``step`` on if the memory is warm; returns whether it is."""
        refusal = self._refusal()
        if refusal:
            text = f"step {step}: {why}; {self.node.role} does not take over: {refusal}"
            self.node.event(FlightEvent.WARNING, "not_warm", text, step * self.node.flight.plant_period)
            return False
        self._say(step, why)
        self._fly()
        return True

    def _fly(self) -> None:
        self.flies, self._asked, self._announced, self._from = True, False, _NEVER, _NEVER
        self._send_on(self._obeyed)

    def _stand_by(self) -> None:
        self.flies, self._heard, self._repeats = False, time.monotonic(), 0
        self._send_on([])

    def _send_on(self, obeyed: list[Publisher]) -> None:
        answers, inside = self._aside
        self.node.outputs, self.node.inside = [*obeyed[:1], *answers], [*obeyed[1:], *inside]

    def _leave(self, step: int) -> None:
        """Stand by from ``step`` on; in lockstep say so, for the other answers that step once it knows."""
        node = self.node
        self._stand_by()
        self._recent.forget_the_other(step - node.period_steps)
        said = self._message
        assert said is not None  # who replaces this node has said so
        text = f"{said.role} flies since step {said.step}: {said.detail}; this node stands by"
        node.event(FlightEvent.WARNING, "replaced", text, step * node.flight.plant_period, always=True)
        if node.lockstep:
            self._publish(self._other, step, said.memory_step, said.detail)

    def _say(self, step: int, why: str) -> None:
        """Publish from which ``step`` on this node flies, and why; always newer than what the other has said."""
        node = self.node
        if self._takeover[1] == node.shadow:
            step = max(step, self._takeover[0] + 1)
        self._takeover = max(self._takeover, (step, not node.shadow))
        self._publish(node.role, step, self._memory_step, why)
        text = f"step {step}: {node.role} flies: {why}"
        node.event(FlightEvent.WARNING, "taken_over", text, step * node.flight.plant_period, always=True)

    def _publish(self, role: str, step: int, memory_step: int, why: str) -> None:
        node = self.node
        sender, run_id = node.get_fully_qualified_name(), node.flight.run_id
        self._takeover_out.publish(
            Takeover(node=sender, role=role, run_id=run_id, step=step, memory_step=memory_step, detail=why)
        )

    def _on_takeover(self, message: Takeover) -> None:
        node = self.node
        if message.role not in (node.role, self._other) or is_foreign(message.run_id, node.flight.run_id):
            return
        self._is_exact = self._is_exact and message.memory_step == 0
        step, is_mine = int(message.step), message.role == node.role
        found = (step, is_mine != node.shadow)
        if found > self._takeover:
            self._takeover, self._message = found, message
        if is_mine and message.node != node.get_fully_qualified_name() and step >= self._announced:
            self._come(step)

    def _come(self, step: int) -> None:
        """Lockstep, on request: the other has left at ``step``; answer it at once if it was computed already."""
        self._announced, self._from = _NEVER, step
        if self._last < step:
            return
        lost = self._to_send(self._recent.computed_since([step, step]))
        self._fly()
        self.node.answers = [*lost, *self.node.answers]
        for sender, message in lost:
            sender.publish(message)

    def _hears(self, place: int, topic: str) -> Callable[[bytes], None]:
        def on_other(payload: bytes) -> None:
            if topic != COMMAND and self.node.is_foreign(topic, head_of(payload)[1]):
                return
            if not self.flies and self._recent.hear(place, payload):
                self._heard, self._repeats = time.monotonic(), 0

        return on_other

    def _on_call(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = self._refusal()
        if self.flies:
            refusal = f"{self.node.role} flies already; the other one is asked by {self._other}/take_over"
        elif self._asked or self._announced < _NEVER:
            refusal = "asked for already"
        self._asked = self._asked or not refusal
        response.success, response.message = not refusal, refusal or f"takes effect {_AHEAD} answers later"
        return response


def exchange_of(node: StageNode) -> Exchange:
    """Return what ``node`` has to do with another controller of its stage."""
    is_paired = node.flight.standby and (node.shadow or SHADOW + node.role in node.roles)
    return Paired(node) if is_paired else Exchange(node)
