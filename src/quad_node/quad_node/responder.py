"""A node that answers states: it waits for what belongs to the step, computes once, repeats on demand."""

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
from quad_node.joining import Joining, Place
from quad_node.succession import LARGEST_GAP, Succession

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
        self._joining = Joining()
        super().__init__(role)
        self._read_state = unpacker(VehicleState, VehicleStateMsg, run=self.run)
        self._inputs: list[InputTopic] = []
        self.answers: list[tuple[Publisher, Any]] = []
        self._answered = -1
        self._states = Succession(self.flight.plant_period)
        self._answered_stamp = 0
        self.states_seen = 0
        self.state_heard = self.started
        self.subscribe("state", self._on_state, raw=True)

    @property
    def next_step(self) -> int:
        """First plant step that is not answered yet."""
        return self._pending[0][0] if self._pending else self._due

    def take(self, topic: str, lag: int = 0) -> InputTopic:
        """Subscribe to a topic whose values belong to steps; malformed messages are refused."""
        taken = InputTopic(topic, lag, topics.TOPICS[topic].giver(self.roles))
        kind, message = SIGNALS[topic].kind, topics.TOPICS[topic].type
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
            self._answer_pending()

        self.subscribe(topic, keep, raw=True)
        self._inputs.append(taken)
        return taken

    def answer(self, sample: Sample, arrivals: list[Arrival | None]) -> Iterator[tuple[Publisher, Any]]:
        """Compute the messages of one step, what others wait for first; ``arrivals``: inputs in the order taken."""
        raise NotImplementedError

    def on_repeat(self, step: int) -> None:
        """React to a state that was answered and came again."""

    def reject(self, topic: str, found: str, stamp: int, kind: str = "rejected_nonfinite") -> None:
        """Count and report a message that is not acted on."""
        self.counters["rejected"] += 1
        self.event(FlightEvent.WARNING, kind, f"{topic}: {found}; message ignored", stamp)

    def comes_late(self, step: int) -> bool:
        """Return whether to take part, from ``step`` on, in a flight that began without this node.

        Not in command: what it knew of the flight died with the process before it. So it says that, once.
        """
        if not self.counters["came_late"]:
            text = f"step {step}: the flight is under way without {self.role}; this process stays silent"
            self.event(FlightEvent.WARNING, "came_late", text, step * self.flight.plant_period, always=True)
            self.publish_status(text)  # latched: who has not found this node yet still hears it
        return False

    def set_status(self, state: int, detail: str, waiting: tuple[str, str] = ("", "")) -> None:
        """Change this node's state and publish it."""
        if state == NodeStatus.READY:  # noted before it is said: the flight may begin at once
            self._joining.on_ready(time.monotonic())
        super().set_status(state, detail, waiting)

    def _on_flight_state(self, message: FlightState) -> None:
        super()._on_flight_state(message)
        if not is_foreign(message.run_id, self.flight.run_id):
            flying = message.state == FlightState.FLYING
            self._joining.on_flight_state(flying, message.wall_time, time.monotonic())

    def _joins(self, step: int) -> bool:
        """Return whether to take part, the first state being that of ``step``; asked until it does."""
        place = self._joining.place(self.lockstep, step)
        if place is not Place.LATE:
            return place is Place.FROM_THE_START
        begin = -(-step // self.period_steps) * self.period_steps
        if not self.comes_late(begin):
            return False
        self._due = begin
        return True

    def leaves_out(self, missing: InputTopic, step: int) -> bool:  # noqa: ARG002
        """Return whether not to wait for what ``step`` lacks."""
        return False

    def is_needed(self, taken: InputTopic, step: int) -> bool:
        """Return whether ``step`` waits for an input that has not come."""
        return step >= taken.lag and (self.lockstep or taken.lag == 0)

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
        if last < step < self._due:
            self._states.take(step, now)
            self._answer_late()
            return
        stamped = self._read("state", payload, self._read_state)
        if stamped is None:
            return
        step, _, stamp, state, _ = stamped
        if not self._states.allows(step, now):
            if self._states.is_far_ahead(step):
                text = f"step {step}, more than {LARGEST_GAP:g} s after {last}"
                self.reject("state", text, stamp, "rejected_future")
            return
        if abs(stamp - step * self.flight.plant_period) > LARGEST_GAP * NANOSECONDS:
            self.reject("state", f"stamp {stamp} ns is not that of step {step}", stamp, "rejected_stamp")
            return
        if (step >= self._due or step < last) and not is_flyable(state):
            self.reject("state", "a number that is not finite or out of range", stamp)
            return
        if last < 0 and not self._joins(step):
            return
        if self._states.take(step, now):
            self._go_back(step)
        if step == last and self._pending:
            self.report_waiting(step)
            self._answer_pending()
        elif step == last:
            self.counters["repeated"] += 1
            self.on_repeat(step)
            for publisher, message in self.answers:
                publisher.publish(message)
        elif step >= self._due:
            self._due = step + self.period_steps
            if not self.lockstep:
                self._answer_late()
                self._pending.clear()
            self._pending.append((step, stamp, state))
            self._answer_pending()

    def _go_back(self, step: int) -> None:
        """Answer from ``step`` on: the later states that were believed did not belong to this flight."""
        self._pending.clear()
        self._due = -(-step // self.period_steps) * self.period_steps

    def _is_needless(self, taken: InputTopic, payload: bytes) -> bool:
        """Return whether to skip this value: no step this node answers will use it."""
        if not self.lockstep or self._pending or not taken.one_step:
            return False
        step = step_of(payload)
        return 0 <= step < self._due - taken.lag

    def _answer_late(self) -> None:
        """Answer in real time what has waited for an input of its step until the next state: with what there is."""
        if self._pending and not self.lockstep:
            self._answer_pending(late=True)

    def _answer_pending(self, late: bool = False) -> None:
        while self._pending:
            step, stamp, state = self._pending[0]
            if not (self.lockstep or late) and self._comes_soon(step):
                return
            arrivals = [taken.at(step) if self.lockstep else taken.newest() for taken in self._inputs]
            missing = self._missing(step, arrivals)
            if missing is not None and not self.leaves_out(missing, step):
                return
            self._pending.popleft()
            if missing is not None:
                continue
            if self._state_waiting():
                self.set_status(NodeStatus.READY, "going on")
            sample = Sample(step, stamp, state, self._elapsed(stamp))
            self._answered, self._answered_stamp, self.current_step = step, stamp, step
            self.answers = []
            for publisher, message in self.answer(sample, arrivals):
                publisher.publish(message)
                self.answers.append((publisher, message))

    def _comes_soon(self, step: int) -> bool:
        """Return whether an input for ``step`` is on its way: its giver has got the state of ``step`` as we have."""
        return any(not taken.lag and taken.has_run_out(step, self.period_steps) for taken in self._inputs)

    def _missing(self, step: int, arrivals: list[Arrival | None]) -> InputTopic | None:
        for taken, arrival in zip(self._inputs, arrivals, strict=True):
            if arrival is None and self.is_needed(taken, step):
                return taken
        return None

    def _elapsed(self, stamp: int) -> float:
        nominal = self.period_steps * self.flight.plant_period
        if self.lockstep or self._answered < 0:
            return seconds(self.period_steps, self.flight.plant_period)
        elapsed = stamp - self._answered_stamp
        bounded = min(max(elapsed, nominal // 2), 2 * nominal)
        if bounded != elapsed:
            self.counters["dt_clamped"] += 1
        return seconds(bounded, 1)

    def _state_waiting(self) -> bool:
        return self.status == NodeStatus.WAITING

    def report_waiting(self, step: int) -> None:
        """Say what is missing: the state of ``step`` came again and could not be answered."""
        first = self._pending[0][0]
        missing = self._missing(first, [taken.at(first) for taken in self._inputs])
        if missing is not None:
            text = f"step {step}: no {missing.topic} from {missing.role}"
            self.set_status(NodeStatus.WAITING, text, (missing.topic, missing.role))
