"""A node that answers states: it waits for what belongs to the step, computes once, repeats on demand."""

import time
from collections import deque
from collections.abc import Iterator
from typing import Any, NamedTuple

from rclpy.publisher import Publisher

from quad_core.bounds import is_flyable
from quad_core.timing import seconds
from quad_core.types import VehicleState
from quad_msgs.msg import FlightEvent, NodeStatus
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import step_of, unpacker
from quad_node.flight_node import FlightNode

_MEMORY = 64


class Held(NamedTuple):
    """A companion of the state: for which steps it holds and when it came (steady s)."""

    step: int
    next_step: int
    value: Any
    arrived: float


class Moment(NamedTuple):
    """One state to be answered. ``dt`` is the time in s since the last answer."""

    step: int
    stamp_ns: int
    state: VehicleState
    dt: float


class Companion:
    """One topic that a step needs beside the state."""

    def __init__(self, topic: str, lag: int) -> None:
        """``lag`` 0: the value whose [step, next_step) holds the step; 1: the value of the step before."""
        self.topic, self.lag = topic, lag
        self.one_step = "next_step" not in topics.TOPICS[topic].type.get_fields_and_field_types()
        self.role = topics.TOPICS[topic].publishers[0]
        self._held: deque[Held] = deque(maxlen=_MEMORY)

    def put(self, held: Held) -> None:
        """Keep a value."""
        self._held.append(held)

    def newest(self) -> Held | None:
        """Return the value that came last."""
        return self._held[-1] if self._held else None

    def at(self, step: int) -> Held | None:
        """Return the value that belongs to ``step``, None if it has not come."""
        wanted = step - self.lag
        for held in reversed(self._held):
            if held.step <= wanted < held.next_step:
                return held
        return None


class Responder(FlightNode):
    """A node that answers states at multiples of its period."""

    def __init__(self, role: str) -> None:
        """Subscribe to ``state``; raises as FlightNode."""
        super().__init__(role)
        self._read_state = unpacker(VehicleState, VehicleStateMsg)
        self._companions: list[Companion] = []
        self._pending: deque[tuple[int, int, VehicleState]] = deque()
        self._answers: list[tuple[Publisher, Any]] = []
        self._answered = -1
        self._seen = -1
        self._answered_stamp = 0
        self._due = 0
        self.subscribe("state", self._on_state, raw=True)

    def companion(self, topic: str, cls: type[Any], lag: int = 0) -> Companion:
        """Subscribe to a topic whose values belong to steps; messages that are not finite are refused."""
        found = Companion(topic, lag)
        read = unpacker(cls, topics.TOPICS[topic].type)

        def keep(payload: bytes) -> None:
            if self._is_spared(found, payload):
                return
            step, next_step, stamp, value, finite = read(payload)
            if not finite:
                self.reject(topic, "a non-finite number", stamp)
                return
            found.put(Held(step, next_step, value, time.monotonic()))
            self._answer_pending()

        self.subscribe(topic, keep, raw=True)
        self._companions.append(found)
        return found

    def answer(self, moment: Moment, values: list[Held | None]) -> Iterator[tuple[Publisher, Any]]:
        """Compute the messages of one step, what others wait for first; ``values``: companions as declared."""
        raise NotImplementedError

    def reject(self, topic: str, found: str, stamp: int) -> None:
        """Count and report a message that is not acted on."""
        self.counters["rejected"] += 1
        self.event(FlightEvent.WARNING, "rejected_nonfinite", f"{topic}: {found}; message ignored", stamp)

    def _on_state(self, payload: bytes) -> None:
        self.heard = time.monotonic()
        self.flying = True
        step = step_of(payload)
        if self._seen < step < self._due:
            self._seen = step
            return
        step, _, stamp, state, _ = self._read_state(payload)
        asked_again, self._seen = step == self._seen, step
        if asked_again and self._pending:
            self._say_waiting(step)
        elif asked_again:
            self.counters["repeated"] += 1
            for publisher, message in self._answers:
                publisher.publish(message)
        elif step >= self._due:
            if not is_flyable(state):
                self.reject("state", "a number that is not finite or out of range", stamp)
                return
            self._due = step + self.period_steps
            if not self.lockstep:
                self._pending.clear()
            self._pending.append((step, stamp, state))
            self._answer_pending()

    def _is_spared(self, companion: Companion, payload: bytes) -> bool:
        """Tell that a value belongs to no step which this node will answer: most of a slow node's are not even read."""
        if not self.lockstep or self._pending or not companion.one_step:
            return False
        step = step_of(payload)
        return 0 <= step < self._due - companion.lag

    def _answer_pending(self) -> None:
        while self._pending:
            step, stamp, state = self._pending[0]
            values = [companion.at(step) if self.lockstep else companion.newest() for companion in self._companions]
            if self._missing(step, values) is not None:
                return
            self._pending.popleft()
            if self._state_waiting():
                self.set_status(NodeStatus.READY, "going on")
            moment = Moment(step, stamp, state, self._elapsed(stamp))
            self._answered, self._answered_stamp, self.step = step, stamp, step
            self._answers = []
            for publisher, message in self.answer(moment, values):
                publisher.publish(message)
                self._answers.append((publisher, message))

    def _missing(self, step: int, values: list[Held | None]) -> Companion | None:
        for companion, value in zip(self._companions, values, strict=True):
            if value is None and step >= companion.lag and (self.lockstep or companion.lag == 0):
                return companion
        return None

    def _elapsed(self, stamp: int) -> float:
        nominal = self.period_steps * self.flight.plant_period
        if self.lockstep or self._answered < 0:
            return seconds(self.period_steps, self.flight.plant_period)
        return seconds(min(max(stamp - self._answered_stamp, nominal // 2), 2 * nominal), 1)

    def _state_waiting(self) -> bool:
        return self._state == NodeStatus.WAITING

    def _say_waiting(self, step: int) -> None:
        first = self._pending[0][0]
        missing = self._missing(first, [companion.at(first) for companion in self._companions])
        if missing is not None:
            text = f"step {step}: no {missing.topic} from {missing.role}"
            self.set_status(NodeStatus.WAITING, text, (missing.topic, missing.role))


def age(held: Held) -> float:
    """Return how long ago a companion came, s on the steady clock."""
    return time.monotonic() - held.arrived
