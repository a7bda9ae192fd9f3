"""Nodes that answer states by one rule in both clocks: ``Responder``, and ``LawNode`` that runs a stage's law.

A node answers the state of step k when its inputs of that step are there, or when its deadline has passed. Lockstep has
no deadline; in real time it is the next state.

Every responder subscribes to ``state``; a ``LawNode`` to the topics that its stage takes, and it publishes what the
stage gives and its internals (see the ``stage.py`` of each controller's package).
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from rclpy.publisher import Publisher

from quad_core.cascade import SHADOW, SIGNALS, STAGE
from quad_core.cycle import is_flyable, seconds
from quad_core.enumerations import NodeState
from quad_core.parameters import Value
from quad_core.records import field_kinds, finite_check, flattener
from quad_core.resolution import Plugin, Resolved
from quad_core.safe import safe_input
from quad_core.types import InputSteps, StepRecord, VehicleState
from quad_msgs.msg import FlightEvent, FlightState
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import (
    UNUSABLE,
    Stamped,
    extra_names,
    head_of,
    numbers_packer,
    packer,
    unpacker,
)
from quad_node.conversion import NANOSECONDS
from quad_node.flight_node import FlightNode
from quad_node.handshake import is_foreign
from quad_node.state_filter import LARGEST_GAP, SequenceFilter, saw_start

_LARGEST = 1e12  # in SI units no number of a flight is larger; with such inputs every law stays finite
_MOST_KEPT = 8192  # values of an input: more than the steps that may lie ahead of the last state
_CATCH_UP = 2.0  # s that a shadow has for its last answers


class Sample(NamedTuple):
    """One state to be answered. ``dt`` is the time in s since the last answer."""

    step: int
    stamp_ns: int
    state: VehicleState
    dt: float


class InputTopic:
    """What has arrived of one topic that a step needs in addition to the state: one value for each step.

    ``newest``: the value that came last, None before the first, and ``heard``: when it came, in s of the steady clock.
    """

    def __init__(self, topic: str, lag: int) -> None:
        """``lag`` 0: the value whose [step, next_step) holds the step; 1: of the step before."""
        self.topic, self.lag = topic, lag
        self.one_step = "next_step" not in topics.TOPICS[topic].type.get_fields_and_field_types()
        self._arrivals: dict[int, Stamped] = {}
        self.newest: Stamped | None = None
        self.heard = 0.0

    def put(self, arrival: Stamped, replaces: bool = True) -> None:
        """Keep a value; of two for the same step the last, or the first unless it ``replaces``."""
        if replaces or arrival.step not in self._arrivals:
            self._arrivals[arrival.step] = arrival
        self.newest, self.heard = self._arrivals[arrival.step], time.monotonic()
        if len(self._arrivals) > _MOST_KEPT:
            del self._arrivals[next(iter(self._arrivals))]

    def at(self, step: int) -> Stamped | None:
        """Return the value that belongs to ``step``, None if it has not come."""
        due = step - self.lag
        begun = [first for first, arrival in self._arrivals.items() if first <= due < arrival.next_step]
        return self._arrivals[max(begun)] if begun else None

    def forget_before(self, step: int) -> None:
        """Drop what no step from ``step`` on needs."""
        for first, arrival in list(self._arrivals.items()):
            if arrival.next_step <= step - self.lag:
                del self._arrivals[first]

    def now(self, period: int, is_due: bool) -> Stamped | None:
        """Return the newest value if a step in real time need not wait for its own.

        ``period``: plant steps between two answers of the node. A slower input does not delay it, nor one of a step
        before; another one does until the step ``is_due``.
        """
        newest = self.newest
        waits = newest is not None and not (is_due or self.lag or newest.next_step - newest.step > period)
        return None if waits else newest

    def is_lost(self, step: int) -> bool:
        """Return whether the value that belongs to ``step`` never comes: later ones have."""
        late = self.newest is not None and self.newest.step > step - self.lag
        return late and step >= self.lag and self.at(step) is None


class Responder(FlightNode):
    """A node that answers states at multiples of its period."""

    def __init__(self, role: str) -> None:
        """Subscribe to ``state``; raises as FlightNode."""
        self._pending: deque[Stamped] = deque()
        self._due = 0
        self._ready = math.inf
        self._began: float | None = None
        super().__init__(role)
        self._unpack_state = unpacker(VehicleState, VehicleStateMsg, run=self.run)
        self.inputs: list[InputTopic] = []
        self._states = SequenceFilter(self.flight.plant_period, self.lockstep)
        self._answered_stamp = -1
        self.states_seen = 0
        self.state_heard = self.started
        self.subscribe("state", self._on_state, raw=True)

    @property
    def next_step(self) -> int:
        """First plant step that is not answered yet."""
        return self._pending[0].step if self._pending else self._due

    @property
    def waits(self) -> bool:
        """Whether a state waits for its inputs."""
        return bool(self._pending)

    def take(self, topic: str, lag: int = 0, kind: type[Any] | None = None) -> InputTopic:
        """Subscribe to a topic whose values belong to steps; malformed messages are rejected.

        ``kind``: the NamedTuple that it carries, for a topic that is not among the signals.
        """
        taken = InputTopic(topic, lag)
        kind, message = kind or SIGNALS[topic].kind, topics.TOPICS[topic].type
        unpack, flat = unpacker(kind, message, self.flight.plant_period, self.run), flattener(kind)

        def keep(payload: bytes) -> None:
            if self.lockstep and not self._pending and taken.one_step and 0 <= head_of(payload)[0] < self._due - lag:
                return  # no step that this node answers needs it
            try:
                stamped = unpack(payload)
            except UNUSABLE as error:
                self.unusable(topic, payload, error)
                return
            numbers = flat(stamped.value)
            if not (stamped.finite and min(numbers) >= -_LARGEST and max(numbers) <= _LARGEST):
                self.reject(topic, "a number that is not finite or out of range", stamped.stamp_ns)
            elif stamped.next_step <= stamped.step:
                text = f"step {stamped.step}, next_step {stamped.next_step}, expected a later one"
                self.reject(topic, text, stamped.stamp_ns, "rejected_malformed")
            elif self.lockstep and self._states.is_far_ahead(stamped.step):
                text = f"step {stamped.step}, more than {LARGEST_GAP:g} s after the last state"
                self.reject(topic, text, stamped.stamp_ns, "rejected_future")
            else:
                taken.put(stamped, replaces=not self.lockstep)
                self.answer_ready()

        self.subscribe(topic, keep, raw=True)
        self.inputs.append(taken)
        return taken

    def answer(self, sample: Sample, arrivals: list[Stamped | None]) -> Iterator[tuple[Publisher, Any]]:
        """Compute the messages of one step, what others wait for first; ``arrivals``: inputs in the order taken."""
        raise NotImplementedError

    def is_needed(self, taken: InputTopic, step: int) -> bool:
        """Return whether ``step`` waits for an input that has not come."""
        return step >= taken.lag and (self.lockstep or taken.lag == 0)

    def leaves_out(self, step: int) -> bool:  # noqa: ARG002
        """Return whether not to answer ``step``, which lacks an input."""
        return False

    def comes_late(self, step: int) -> bool:
        """Return whether to take part, from ``step`` on, in a flight that began without this node.

        It does not: what the process before it knew of the flight is lost. It reports that once.
        """
        if not self.counters["came_late"]:
            text = f"step {step}: the flight is under way without {self.role}; this process stays silent"
            self.event(FlightEvent.WARNING, "came_late", text, step * self.flight.plant_period, always=True)
            self.publish_status(text)  # latched: a node that has not found this one yet still receives it
        return False

    def set_status(self, state: int, detail: str) -> None:
        """Change this node's state and publish it."""
        if state == NodeState.READY:  # noted before it is sent: the flight may begin at once
            self._ready = min(self._ready, time.monotonic())
        super().set_status(state, detail)

    def answer_ready(self, is_due: bool = False) -> None:
        """Answer the states whose inputs are there; ``is_due``: in real time their deadline has passed."""
        while self._pending:
            step, _, stamp, state, _ = self._pending[0]
            arrivals = self._arrivals_of(step, is_due)
            if arrivals is None and not self.leaves_out(step):
                return
            self._pending.popleft()
            if arrivals is None:
                continue
            sample = Sample(step, stamp, state, self._elapsed(stamp))
            self._answered_stamp, self.current_step = stamp, step
            for taken in self.inputs:
                taken.forget_before(step)
            for publisher, message in self.answer(sample, arrivals):
                publisher.publish(message)

    def _arrivals_of(self, step: int, is_due: bool) -> list[Stamped | None] | None:
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
        if not is_foreign(message.run, self.run):
            # a latched message may have been sent long before
            began = time.monotonic() - message.wall_time if message.state == FlightState.FLYING else math.inf
            self._began = began if self._began is None else min(self._began, began)

    def _joins(self, step: int) -> bool:
        """Return whether to take part, the first state being that of ``step``; asked until it does."""
        saw = saw_start(self.lockstep, step, self._ready, self._began)
        if saw is not False:
            return bool(saw)
        begin = self._next_multiple(step)
        if not self.comes_late(begin):
            return False
        self._due = begin
        return True

    def _next_multiple(self, step: int) -> int:
        return -(-step // self.period_steps) * self.period_steps

    def _on_state(self, payload: bytes) -> None:
        (step, run), last = head_of(payload), self._states.last
        if step >= 0 and self.is_foreign("state", run):
            return
        self.last_heard = self.state_heard = time.monotonic()
        self.flying = True
        self.states_seen += step != last
        if last < step < self._due:  # none to answer, but the deadline of the one before
            self._states.take(step)
            self._on_deadline()
            return
        try:
            stamped = self._unpack_state(payload)
        except UNUSABLE as error:
            self.unusable("state", payload, error)
            return
        if not self._is_next(stamped):
            return
        step = stamped.step
        if self._states.take(step):  # the later states before it were another run's
            self._pending.clear()
            self._due = self._next_multiple(step)
        if step >= self._due:
            self._due = step + self.period_steps
            self._on_deadline()
            if not self.lockstep:
                self._pending.clear()
            self._pending.append(stamped)
            self.answer_ready()

    def _is_next(self, stamped: Stamped) -> bool:
        """Return whether a state continues the flight; one that does not is reported."""
        step, stamp, last = stamped.step, stamped.stamp_ns, self._states.last
        if not self._states.allows(step):
            if self._states.is_far_ahead(step):
                text = f"step {step}, more than {LARGEST_GAP:g} s after {last}"
                self.reject("state", text, stamp, "rejected_future")
            return False
        if abs(stamp - step * self.flight.plant_period) > LARGEST_GAP * NANOSECONDS:
            self.reject("state", f"stamp {stamp} ns is not that of step {step}", stamp, "rejected_stamp")
            return False
        if (step >= self._due or step < last) and not is_flyable(stamped.value):
            self.reject("state", "a number that is not finite or out of range", stamp)
            return False
        return last >= 0 or self._joins(step)

    def _on_deadline(self) -> None:
        """Real time: the next state is here. Answer the one that waits with the inputs that there are."""
        if self._pending and not self.lockstep:
            self.answer_ready(is_due=True)


class LawNode(Responder):
    """Holds a law's memory between steps. ``on_internals``: called with what the law showed of itself in each step.

    ``law``: the law with the parameters that it runs with; a live change keeps its memory.
    """

    def __init__(self, role: str) -> None:
        """Load the law of parameter ``law``; raises as FlightNode."""
        super().__init__(role)
        self.stage = STAGE[self.role.removeprefix(SHADOW)]
        self._ended: tuple[FlightState, float] | None = None
        self.on_internals: Callable[[Any, Sample], None] | None = None
        self.law: Plugin = self.resolved.law
        module = self.law.module
        self.step = module.step
        self.memory = module.init(self.law.parameters, self.vehicle)
        self._is_finite, self._is_memory_finite = finite_check(self.stage.output), finite_check(module.Memory)
        for taken in self.stage.takes:
            self.take(taken.topic, taken.lag)
        self._output_out = self.publisher(self.stage.gives)
        self._internals_out = self.publisher(self.stage.internals_topic)
        self._pack = packer(self.stage.output, topics.message_type(self.stage.output), self.run)
        internals_message = topics.message_type(self.stage.internals)
        self._flat_internals = flattener(module.Internals)
        fields = [*field_kinds(StepRecord).items(), *field_kinds(module.Internals).items()]
        recorded: Any = NamedTuple("Recorded", fields)  # type: ignore[misc]
        self._pack_internals = numbers_packer(recorded, internals_message, self.run)
        self.internals_names = extra_names(module.Internals, internals_message)
        self.publish_parameters()

    def answer(self, sample: Sample, arrivals: list[Stamped | None]) -> Iterator[tuple[Publisher, Any]]:
        """Give the output and the internals of one step."""
        law, (values, replaced) = self.law, self._values_of(sample, arrivals)
        if values is None:
            return
        if sample.state.on_ground:  # what was learnt in an earlier flight is of no use for the next one
            self.memory = law.module.init(law.parameters, self.vehicle)
        inputs = self.stage.inputs(sample.state, *values)
        output, memory, internals = self.step(law.parameters, self.vehicle, self.memory, inputs, sample.dt)
        if not (self._is_finite(output) and self._is_memory_finite(memory)):
            self.event(FlightEvent.ERROR, "law_nonfinite", f"{law.name}: non-finite output", sample.stamp_ns)
            self.finish(1, f"{law.name}: non-finite output at step {sample.step}")
            return
        self.memory = memory
        if self.on_internals is not None:
            self.on_internals(internals, sample)
        yield self._output_out, self._pack(output, sample.step, sample.step + self.period_steps, sample.stamp_ns)
        steps = [arrival.step if arrival else -1 for arrival in arrivals]
        steps += [-1] * (len(InputSteps._fields) - len(steps))
        numbers = (sample.dt, *steps, replaced, *self._flat_internals(internals))
        yield self._internals_out, self._pack_internals(numbers, sample.step, sample.step, sample.stamp_ns)

    def comes_late(self, step: int) -> bool:
        """Return whether to compute from ``step`` on: as a shadow."""
        return self.shadow or super().comes_late(step)

    def leaves_out(self, step: int) -> bool:
        """Return whether not to answer a step: no node waits for a shadow, so its inputs may be lost."""
        return self.shadow and any(taken.is_lost(step) for taken in self.inputs)

    def _on_parameters(self, resolved: Resolved, changes: dict[str, Value]) -> None:
        self.law = resolved.law
        super()._on_parameters(resolved, changes)

    def _values_of(self, sample: Sample, arrivals: list[Stamped | None]) -> tuple[list[Any] | None, int]:
        """Return the law's inputs other than the state, None if one is too old and has no replacement.

        The second result has bit k set if a safe value replaces input k.
        """
        values, replaced = [], 0
        for place, (taken, arrival) in enumerate(zip(self.inputs, arrivals, strict=True)):
            value = arrival.value if arrival else SIGNALS[taken.topic].kind()
            age = time.monotonic() - taken.heard if arrival else 0.0
            if not self.lockstep and not taken.lag and age > self.resolved.node.input_timeout:
                text = f"{taken.topic}: {age * 1e3:.0f} ms old; safe output"
                self.event(FlightEvent.WARNING, "stale_input", text)
                value = safe_input(taken.topic, value, self.vehicle, sample.state)
                replaced |= 1 << place
                if value is None:
                    return None, replaced
            values.append(value)
        return values, replaced

    def on_flight_ended(self, message: FlightState) -> None:
        """Leave, a shadow a little later."""
        self._ended = self._ended or (message, time.monotonic())
        self.on_tick()

    def on_tick(self) -> None:
        """Leave after the end; a shadow in lockstep first answers what is due, because no node waited for it."""
        if self._ended is not None:
            message, since = self._ended
            due = message.step // self.period_steps * self.period_steps if self.shadow and self.lockstep else 0
            if self.current_step >= due or time.monotonic() - since > _CATCH_UP:
                super().on_flight_ended(message)
