"""A node that answers states by one rule in both clocks.

It answers the state of step k when its inputs of that step are there, or when its deadline has passed. Lockstep has no
deadline; in real time it is the next state.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from rclpy.publisher import Publisher

from quad_core.cascade import SIGNALS
from quad_core.cycle import is_flyable, seconds
from quad_core.records import flattener
from quad_core.types import VehicleState
from quad_msgs.msg import FlightEvent, FlightState, NodeStatus
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import MALFORMED, ForeignRunError, Stamped, head_of, step_of, unpacker
from quad_node.conversion import NANOSECONDS
from quad_node.flight_node import FlightNode
from quad_node.handshake import is_foreign
from quad_node.inputs import Arrival, InputTopic
from quad_node.sequence_filter import LARGEST_GAP, SequenceFilter
from quad_node.start_detector import Start, StartDetector

_LARGEST = 1e12  # in SI units no number of a flight is larger; with such inputs every law stays finite


class Sample(NamedTuple):
    """One state to be answered. ``dt`` is the time in s since the last answer."""

    step: int
    stamp_ns: int
    state: VehicleState
    dt: float


class Responder(FlightNode):
    """A node that answers states at multiples of its period."""

    def __init__(self, role: str) -> None:
        """Subscribe to ``state``; raises as FlightNode."""
        self._pending: deque[tuple[int, int, VehicleState]] = deque()
        self._due = 0
        self._start = StartDetector()
        super().__init__(role)
        self._read_state = unpacker(VehicleState, VehicleStateMsg, run=self.run)
        self.inputs: list[InputTopic] = []
        self._states = SequenceFilter(self.flight.plant_period)
        self._answered_stamp = -1
        self.states_seen = 0
        self.state_heard = self.started
        self.subscribe("state", self._on_state, raw=True)

    @property
    def next_step(self) -> int:
        """First plant step that is not answered yet."""
        return self._pending[0][0] if self._pending else self._due

    @property
    def waits(self) -> bool:
        """Whether a state waits for its inputs."""
        return bool(self._pending)

    def take(self, topic: str, lag: int = 0, kind: type[Any] | None = None) -> InputTopic:
        """Subscribe to a topic whose values belong to steps; malformed messages are refused.

        ``kind``: the NamedTuple that it carries, for a topic that is not among the signals.
        """
        taken = InputTopic(topic, lag)
        kind, message = kind or SIGNALS[topic].kind, topics.TOPICS[topic].type
        read, flat = unpacker(kind, message, self.flight.plant_period, self.run), flattener(kind)
        run_id = self.flight.run_id.encode() if "run_id" in message.get_fields_and_field_types() else b""

        def keep(payload: bytes) -> None:
            if self._is_needless(taken, payload):
                return
            stamped = self._read(topic, payload, read)
            if stamped is None:
                return
            if run_id not in payload:
                self.event(FlightEvent.WARNING, "foreign_run", f"{topic} of another run ignored")
                return
            numbers = flat(stamped.value)
            if not (stamped.finite and min(numbers) >= -_LARGEST and max(numbers) <= _LARGEST):
                self.reject(topic, "a number that is not finite or out of range", stamped.stamp_ns)
                return
            taken.put(Arrival(stamped.step, stamped.next_step, stamped.value, time.monotonic()))
            self.answer_ready()

        self.subscribe(topic, keep, raw=True)
        self.inputs.append(taken)
        return taken

    def answer(self, sample: Sample, arrivals: list[Arrival | None]) -> Iterator[tuple[Publisher, Any]]:
        """Compute the messages of one step, what others wait for first; ``arrivals``: inputs in the order taken."""
        raise NotImplementedError

    def is_needed(self, taken: InputTopic, step: int) -> bool:
        """Return whether ``step`` waits for an input that has not come."""
        return step >= taken.lag and (self.lockstep or taken.lag == 0)

    def leaves_out(self, step: int) -> bool:  # noqa: ARG002
        """Return whether not to answer ``step``, which lacks an input."""
        return False

    def reject(self, topic: str, found: str, stamp: int, kind: str = "rejected_nonfinite") -> None:
        """Count and report a message that is not acted on."""
        self.counters["rejected"] += 1
        self.event(FlightEvent.WARNING, kind, f"{topic}: {found}; message ignored", stamp)

    def comes_late(self, step: int) -> bool:
        """Return whether to take part, from ``step`` on, in a flight that began without this node.

        Not in command: what the process before it knew of the flight is lost. So it says that, once.
        """
        if not self.counters["came_late"]:
            text = f"step {step}: the flight is under way without {self.role}; this process stays silent"
            self.event(FlightEvent.WARNING, "came_late", text, step * self.flight.plant_period, always=True)
            self.publish_status(text)  # latched: a node that has not found this one yet still receives it
        return False

    def set_status(self, state: int, detail: str) -> None:
        """Change this node's state and publish it."""
        if state == NodeStatus.READY:  # noted before it is said: the flight may begin at once
            self._start.on_ready(time.monotonic())
        super().set_status(state, detail)

    def answer_ready(self, is_due: bool = False) -> None:
        """Answer the states whose inputs are there; ``is_due``: in real time their deadline has passed."""
        while self._pending:
            step, stamp, state = self._pending[0]
            arrivals = self._arrivals_of(step, is_due)
            if arrivals is None and not self.leaves_out(step):
                return
            self._pending.popleft()
            if arrivals is None:
                continue
            sample = Sample(step, stamp, state, self._elapsed(stamp))
            self._answered_stamp, self.current_step = stamp, step
            for publisher, message in self.answer(sample, arrivals):
                publisher.publish(message)

    def _arrivals_of(self, step: int, is_due: bool) -> list[Arrival | None] | None:
        """Return the inputs of ``step`` in the order taken, None while it waits for one."""
        arrivals = []
        for taken in self.inputs:
            arrival = taken.at(step)
            if arrival is None and not self.lockstep:
                arrival = taken.now(self.period_steps, is_due)
            if arrival is None and self.is_needed(taken, step):
                return None
            arrivals.append(arrival)
        return arrivals

    def _elapsed(self, stamp: int) -> float:
        """Return the s since the last answer, by the stamps; what is far from nominal is counted."""
        nominal = self.period_steps * self.flight.plant_period
        elapsed = stamp - self._answered_stamp if self._answered_stamp >= 0 else nominal
        if not nominal // 2 <= elapsed <= 2 * nominal:
            self.counters["dt_odd"] += 1
        return seconds(elapsed if elapsed > 0 else nominal, 1)

    def _on_flight_state(self, message: FlightState) -> None:
        super()._on_flight_state(message)
        if not is_foreign(message.run_id, self.flight.run_id):
            flying = message.state == FlightState.FLYING
            self._start.on_flight_state(flying, message.wall_time, time.monotonic())

    def _joins(self, step: int) -> bool:
        """Return whether to take part, the first state being that of ``step``; asked until it does."""
        start = self._start.find(self.lockstep, step)
        if start is not Start.MISSED:
            return start is Start.SEEN
        begin = -(-step // self.period_steps) * self.period_steps
        if not self.comes_late(begin):
            return False
        self._due = begin
        return True

    def _read(self, topic: str, payload: bytes, read: Callable[[bytes], Stamped]) -> Stamped | None:
        """Return what a payload holds; None, reported, if it is not the message that the topic carries."""
        try:
            return read(payload)
        except ForeignRunError:
            self.is_foreign(topic, -1)
            return None
        except MALFORMED as error:
            self.reject(topic, f"a malformed message of {len(payload)} bytes ({error})", 0, "rejected_malformed")
            return None

    def _on_state(self, payload: bytes) -> None:
        (step, run), last = head_of(payload), self._states.last
        if step >= 0 and self.is_foreign("state", run):
            return
        now = self.last_heard = self.state_heard = time.monotonic()
        self.flying = True
        self.states_seen += step != last
        if last < step < self._due:  # none to answer, but the deadline of the one before
            self._states.take(step, now)
            self._on_deadline()
            return
        stamped = self._read("state", payload, self._read_state)
        if stamped is None:
            return
        step, _, stamp, state, _ = stamped
        if not self._is_next(step, stamp, state, now):
            return
        if self._states.take(step, now):  # the later states before it were another run's
            self._pending.clear()
            self._due = -(-step // self.period_steps) * self.period_steps
        if step >= self._due:
            self._due = step + self.period_steps
            self._on_deadline()
            if not self.lockstep:
                self._pending.clear()
            self._pending.append((step, stamp, state))
            self.answer_ready()

    def _is_next(self, step: int, stamp: int, state: VehicleState, now: float) -> bool:
        """Return whether a state continues the flight; one that does not is reported."""
        last = self._states.last
        if not self._states.allows(step, now):
            if self._states.is_far_ahead(step):
                text = f"step {step}, more than {LARGEST_GAP:g} s after {last}"
                self.reject("state", text, stamp, "rejected_future")
            return False
        if abs(stamp - step * self.flight.plant_period) > LARGEST_GAP * NANOSECONDS:
            self.reject("state", f"stamp {stamp} ns is not that of step {step}", stamp, "rejected_stamp")
            return False
        if (step >= self._due or step < last) and not is_flyable(state):
            self.reject("state", "a number that is not finite or out of range", stamp)
            return False
        return last >= 0 or self._joins(step)

    def _on_deadline(self) -> None:
        """Real time: the next state is here. Answer the one that waits with the inputs that there are."""
        if self._pending and not self.lockstep:
            self.answer_ready(is_due=True)

    def _is_needless(self, taken: InputTopic, payload: bytes) -> bool:
        """Return whether to skip this value: no step this node answers will use it."""
        if not self.lockstep or self._pending or not taken.one_step:
            return False
        step = step_of(payload)
        return 0 <= step < self._due - taken.lag
