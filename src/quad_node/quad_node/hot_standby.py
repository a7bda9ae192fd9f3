"""Hot standby in real time: of two controllers of one stage one flies; the other computes along and takes over.

Both run the same code. The controller flies first and its shadow stands by; after that the newest message on
``flight/takeover`` says which one flies, latched, so that a process that was started again knows it too. The standby
receives the answers of the other one, and its own are not flown. It takes over when they are ``flight.takeover_age``
behind the state, in steps and by the clock, or on request: and only with a settled memory. A controller that was
replaced, or that joins a flight under way, stands by in turn.

In lockstep the plant waits for a controller that does not answer, and the guard then lands.
"""

import time
from contextlib import suppress
from typing import Any

from std_srvs.srv import Trigger

from quad_core.cascade import COMMAND, SHADOW
from quad_core.cycle import seconds
from quad_core.roles import Stage
from quad_msgs.msg import FlightEvent, NodeStatus, Takeover
from quad_node.codec import MALFORMED, head_of, unpack_wrench
from quad_node.conversion import NANOSECONDS
from quad_node.flight_node import FlightNode
from quad_node.handshake import is_foreign
from quad_node.state_filter import LARGEST_GAP

_NEVER = 2**62

WARM = 2.0
"""s of answers without a gap after which a memory that began in flight may fly: four times what the filters of our laws
need to settle, 0.5 s. What integrates does not settle by computing along (docs/explanation/safety.md)."""

_AHEAD = 20
"""On request: answers between the announcement and the takeover."""


class HotStandby:
    """One of two controllers of a stage. ``flies``: it is the one that flies; otherwise it stands by."""

    def __init__(self, node: FlightNode, stage: Stage) -> None:
        """Subscribe to takeovers and to the other's answers; offer the service `<role>/take_over`."""
        self.node, self.flies = node, not node.shadow
        self._topic, self._other = stage.gives, stage.role if node.shadow else SHADOW + stage.role
        # the newest takeover: from which step on, and whether by the controller; of equal steps that one counts
        self._takeover = (-1, True)
        self._asked, self._from = False, _NEVER
        self._last = self._memory_step = -1
        self._steady = -_NEVER
        self._newest, self._heard = -1, time.monotonic()
        self._takeover_out = node.publisher("flight/takeover", match=False)
        node.subscribe("flight/takeover", self._on_takeover)
        node.subscribe(self._topic, self._on_answer, raw=True)
        node.subscribe(stage.internals_topic, lambda _: None, raw=True)  # matched with both before the flight
        self._service = node.ros.create_service(Trigger, f"{node.role}/take_over", self._on_call)

    def comes_late(self, step: int) -> bool:
        """Stand by with a memory that begins now, whatever the role."""
        node = self.node
        self._steady = _NEVER
        self.flies, self._heard = False, time.monotonic()
        text = f"step {step}: the flight is under way; {node.role} stands by, its memory begins"
        node.event(FlightEvent.WARNING, "stands_by", text, step * node.flight.plant_period, always=True)
        # latched, for the event may come before others have found this node; no node waits for its links
        node.set_status(NodeStatus.READY, text)
        return True

    def before(self, step: int) -> None:
        """Leave if the other flies from ``step`` on; take over if asked to, or if the other is silent."""
        self._remember(step)
        if self.flies:
            if self._takeover[1] == self.node.shadow and step >= self._takeover[0]:
                self._leave(step)
            return
        quiet, limit = time.monotonic() - self._heard, self.node.flight.takeover_age
        late = seconds(step - self._newest, self.node.flight.plant_period)
        # both: a standby that was stopped itself finds a queue of old states, but the other's answers among them
        if self._newest >= 0 and late > limit and quiet > limit:
            self._seize(step, f"nothing from {self._other} for {quiet * 1e3:.0f} ms")
        elif self._asked:
            self._asked = False
            self._from = max(step, self._newest) + _AHEAD * self.node.period_steps
            self._say(self._from, "asked for by service")
        if step >= self._from:
            self.flies, self._asked, self._from = True, False, _NEVER

    def _remember(self, step: int) -> None:
        """Note since when this node has answered without a gap."""
        node = self.node
        bearable = int(node.flight.takeover_age * NANOSECONDS) // node.flight.plant_period
        if self._memory_step < 0:
            self._memory_step = step
            self._steady = min(self._steady, step)
        elif step - self._last > max(bearable, node.period_steps):
            self._steady = step
        self._last = step

    def _refusal(self) -> str:
        """Return why this node must not fly yet, empty if it may."""
        age = seconds(self._last - self._steady, self.node.flight.plant_period)
        if age < WARM:
            return f"its memory is {max(age, 0.0):.2f} s old, expected {WARM:g} s of answers without a gap"
        return f"nothing heard of {self._other}" if self._newest < self._steady else ""

    def _seize(self, step: int, why: str) -> None:
        """Fly from ``step`` on if the memory is settled."""
        refusal = self._refusal()
        if refusal:
            text = f"step {step}: {why}; {self.node.role} does not take over: {refusal}"
            self.node.event(FlightEvent.WARNING, "not_warm", text, step * self.node.flight.plant_period)
            return
        self._say(step, why)
        self._from = step

    def _leave(self, step: int) -> None:
        """Stand by from ``step`` on."""
        node = self.node
        self.flies, self._heard = False, time.monotonic()
        self._newest = step - node.period_steps
        text = f"{self._other} flies since step {self._takeover[0]}; this node stands by"
        node.event(FlightEvent.WARNING, "replaced", text, step * node.flight.plant_period, always=True)

    def _say(self, step: int, why: str) -> None:
        """Publish from which ``step`` on this node flies, and why; always newer than what the other has said."""
        node = self.node
        if self._takeover[1] == node.shadow:
            step = max(step, self._takeover[0] + 1)
        self._takeover = max(self._takeover, (step, not node.shadow))
        message = Takeover(
            node=node.name,
            role=node.role,
            run_id=node.flight.run_id,
            step=step,
            memory_step=self._memory_step,
            detail=why,
        )
        self._takeover_out.publish(message)
        text = f"step {step}: {node.role} flies: {why}"
        node.event(FlightEvent.WARNING, "taken_over", text, step * node.flight.plant_period, always=True)

    def _on_takeover(self, message: Takeover) -> None:
        node = self.node
        if message.role not in (node.role, self._other) or is_foreign(message.run_id, node.flight.run_id):
            return
        self._takeover = max(self._takeover, (int(message.step), (message.role == node.role) != node.shadow))

    def _on_answer(self, payload: bytes) -> None:
        """Note the newest answer of the other controller."""
        topic, period = self._topic, self.node.flight.plant_period
        step, run = head_of(payload)
        if topic == COMMAND:  # a wrench, which names no run
            with suppress(*MALFORMED):
                step, run = unpack_wrench(payload, period).step, self.node.run
        if self.flies or step < 0 or self.node.is_foreign(topic, run):
            return
        if step - self._last > LARGEST_GAP * NANOSECONDS / period:  # accepted, it would hide silence
            return
        self._newest, self._heard = max(self._newest, step), time.monotonic()

    def _on_call(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        refusal = self._refusal()
        if self.flies:
            refusal = f"{self.node.role} flies already; the other one is asked by {self._other}/take_over"
        elif self._asked or self._from < _NEVER:
            refusal = "asked for already"
        self._asked = self._asked or not refusal
        response.success, response.message = not refusal, refusal or f"takes effect {_AHEAD} answers later"
        return response
