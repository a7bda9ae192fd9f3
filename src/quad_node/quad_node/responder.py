"""How a node answers states, by one rule in both clocks.

The state of step k is answered when the inputs of that step are there, or when its deadline has passed. Lockstep has no
deadline; in real time it is the next state.

Subscribes: state (VehicleState), and the inputs that the node takes.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from rclpy.publisher import Publisher

from quad_core.cascade import SIGNALS
from quad_core.cycle import is_flyable, seconds
from quad_core.records import flattener
from quad_core.types import VehicleState
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import NANOSECONDS, UNUSABLE, Stamped, head_of, unpacker
from quad_node.flight_node import FlightNode

LARGEST_GAP = 0.5  # s between two states that follow each other
QUIET = 0.03  # s that another run of states goes on without one that follows the last; the guard waits for 0.05


class SequenceFilter:
    """``last``: the step that was accepted last, -1 before the first.

    One accepted state of an absurd step would make every later one old. So in real time a state far from the last one
    is accepted where none follows the last one any more: after a real gap, or when the last one was foreign. For how
    long is told by the other run's own steps, not by the clock on the wall: states come more slowly than that where a
    plant waits. In lockstep no state is lost: the step before the last gap is the one that the flight goes on from.
    """

    def __init__(self, plant_period: int, lockstep: bool = False) -> None:
        """No state has come; ``plant_period`` in ns."""
        self.last = -1
        self._lockstep = lockstep
        self._largest, self._quiet = LARGEST_GAP * 1e9 / plant_period, QUIET * 1e9 / plant_period
        self._elsewhere = self._since = -1
        self._before_gap = math.inf

    def allows(self, step: int) -> bool:
        """Return whether the state of ``step`` may come next: it follows the last one, or another run has for QUIET."""
        if self.last < 0 or 0 <= step - self.last <= self._largest:
            return True
        if self._lockstep:
            return 0 < step - self._before_gap <= self._largest
        before, self._elsewhere = self._elsewhere, step
        if not (before >= 0 and 0 <= step - before <= self._largest):
            self._since = step
        return step - self._since > self._quiet

    def is_far_ahead(self, step: int) -> bool:
        """Return whether ``step`` lies farther ahead of the last state than a message may."""
        return self.last >= 0 and step - self.last > self._largest

    def take(self, step: int) -> bool:
        """Accept ``step``; return whether it lies before the last one, which then was another run's."""
        is_back = step < self.last
        if is_back or step - self.last > self._quiet:
            self._before_gap = math.inf if is_back else self.last
        self.last, self._elsewhere = step, -1
        return is_back


def saw_start(lockstep: bool, step: int, ready: float, began: float | None) -> bool | None:
    """Return whether the first state, that of ``step``, is of a flight that began with this node; None: unknown.

    ``ready``: when this node was READY, inf: never. ``began``: when the flight did by flight/state, inf: not yet, None:
    none has come. In lockstep a flight begins with step 0. In real time the first state may be a later one (of an
    estimator that was on before, or to a node that the system stopped); a flight starts after every node is READY.
    """
    if step == 0:
        return True
    if lockstep or (began is not None and began < ready):
        return False
    return None if began is None or ready == math.inf else True


_LARGEST = 1e12  # in SI units no number of a flight is larger; with such inputs every law stays finite
_MOST_KEPT = 8192  # values of an input: more than the steps that may lie ahead of the last state


class Sample(NamedTuple):
    """One state to be answered. ``dt`` is the time in s since the last answer."""

    step: int
    stamp_ns: int
    state: VehicleState
    dt: float


Step = Callable[[Sample, list[Stamped | None]], Iterable[tuple[Publisher, Any]]]
"""What a node gives for a sample and its inputs in the order taken: messages, what others wait for first."""


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
        if (arrival := self._arrivals.get(due)) is not None:
            return arrival
        begun = [first for first, arrival in self._arrivals.items() if first <= due < arrival.next_step]
        return self._arrivals[max(begun)] if begun else None

    def forget_before(self, step: int) -> None:
        """Drop what no step from ``step`` on needs; does nothing with a single value."""
        if len(self._arrivals) < 2:
            return
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


class Responder:
    """Calls ``step`` for the states at multiples of the node's period, and publishes what it gives.

    ``inputs``: the topics that a step needs besides the state; ``given_up``: those of them that no step waits for any
    more. ``states_seen`` counts plant steps, ``state_heard``: s of the steady clock at which a state came last.
    """

    def __init__(self, node: FlightNode, step: Step) -> None:
        self.node, self._step = node, step
        self._lockstep, self._period, self._every = node.lockstep, node.flight.plant_period, node.period_steps
        self._pending: deque[Stamped] = deque()
        self._due = 0
        self._unpack_state = unpacker(VehicleState, VehicleStateMsg, run=node.run)
        self.inputs: list[InputTopic] = []
        self.given_up: set[str] = set()
        self._states = SequenceFilter(self._period, self._lockstep)
        self._answered_stamp = -1
        self.states_seen, self.state_heard = 0, node.started
        node.next_step = lambda: self.next_step
        node.links.subscribe("state", self._on_state, raw=True)

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
        taken, events = InputTopic(topic, lag), self.node.events
        kind, message = kind or SIGNALS[topic].kind, topics.TOPICS[topic].type
        unpack, flat = unpacker(kind, message, self._period, self.node.run), flattener(kind)

        def keep(payload: bytes) -> None:
            if self._lockstep and not self._pending and taken.one_step and 0 <= head_of(payload)[0] < self._due - lag:
                return  # no step that this node answers needs it
            try:
                stamped = unpack(payload)
            except UNUSABLE as error:
                events.unusable(topic, payload, error)
                return
            numbers = flat(stamped.value)
            if not (stamped.finite and min(numbers) >= -_LARGEST and max(numbers) <= _LARGEST):
                events.reject(topic, "a number that is not finite or out of range", stamped.stamp_ns)
            elif stamped.next_step <= stamped.step:
                text = f"step {stamped.step}, next_step {stamped.next_step}, expected a later one"
                events.reject(topic, text, stamped.stamp_ns, "rejected_malformed")
            elif self._lockstep and self._states.is_far_ahead(stamped.step):
                text = f"step {stamped.step}, more than {LARGEST_GAP:g} s after the last state"
                events.reject(topic, text, stamped.stamp_ns, "rejected_future")
            else:
                taken.put(stamped, replaces=not self._lockstep)
                self.answer()

        self.node.links.subscribe(topic, keep, raw=True)
        self.inputs.append(taken)
        return taken

    def answer(self, is_due: bool = False) -> None:
        """Answer the states whose inputs are there; ``is_due``: in real time their deadline has passed."""
        while self._pending:
            step, _, stamp, state, _ = self._pending[0]
            arrivals = self._arrivals_of(step, is_due)
            if arrivals is None and not self._leaves_out(step):
                return
            self._pending.popleft()
            if arrivals is None:
                continue
            sample = Sample(step, stamp, state, self._elapsed(stamp))
            self._answered_stamp = stamp
            self.node.current_step = step
            for taken in self.inputs:
                taken.forget_before(step)
            for publisher, message in self._step(sample, arrivals):
                publisher.publish(message)

    def _arrivals_of(self, step: int, is_due: bool) -> list[Stamped | None] | None:
        """Return the inputs of ``step`` in the order taken, None while it waits for one."""
        arrivals = []
        for taken in self.inputs:
            arrival = taken.at(step)
            if arrival is None:
                if not self._lockstep:
                    arrival = taken.now(self._every, is_due)
                needed = step >= taken.lag and (self._lockstep or taken.lag == 0)
                if arrival is None and needed and taken.topic not in self.given_up:
                    return None
            arrivals.append(arrival)
        return arrivals

    def _leaves_out(self, step: int) -> bool:
        """Return whether not to answer a step: no node waits for a shadow, so its inputs may be lost."""
        return self.node.shadow and any(taken.is_lost(step) for taken in self.inputs)

    def _elapsed(self, stamp: int) -> float:
        """Return the s since the last answer, by the stamps; what is far from nominal is counted."""
        nominal = self._every * self._period
        elapsed = stamp - self._answered_stamp if self._answered_stamp >= 0 else nominal
        if not nominal // 2 <= elapsed <= 2 * nominal:
            self.node.events.counts["dt_odd"] += 1
        return seconds(elapsed if elapsed > 0 else nominal, 1)

    def _joins(self, step: int) -> bool:
        """Return whether to take part, the first state being that of ``step``; asked until it does.

        A node that comes into a flight under way does not: what the process before it knew of the flight is lost. It
        reports that once. A shadow computes from then on.
        """
        node = self.node
        saw = saw_start(self._lockstep, step, node.ready_at, node.began)
        if saw is not False:
            return bool(saw)
        begin = self._next_multiple(step)
        if node.shadow:
            self._due = begin
        elif not node.events.counts["came_late"]:
            text = f"step {begin}: the flight is under way without {node.role}; this process stays silent"
            node.events.warn("came_late", text, begin * self._period, always=True)
            node.publish_status(text)  # latched: a node that has not found this one yet still receives it
        return node.shadow

    def _next_multiple(self, step: int) -> int:
        return -(-step // self._every) * self._every

    def _on_state(self, payload: bytes) -> None:
        (step, run), node, last = head_of(payload), self.node, self._states.last
        if step >= 0 and run != node.run and node.is_foreign("state", run):
            return
        is_between = last < step < self._due  # none to answer, but the deadline of the one before
        try:
            stamped = None if is_between else self._unpack_state(payload)
        except UNUSABLE as error:
            node.events.unusable("state", payload, error)
            return
        node.last_heard = self.state_heard = time.monotonic()
        node.flying = True
        self.states_seen += step != last
        if stamped is None:
            self._states.take(step)
            self._on_deadline()
            return
        if not self._is_next(stamped):
            return
        step = stamped.step
        if self._states.take(step):  # the later states before it were another run's
            self._pending.clear()
            self._due = self._next_multiple(step)
        if step >= self._due:
            self._due = step + self._every
            self._on_deadline()
            if not self._lockstep:
                self._pending.clear()
            self._pending.append(stamped)
            self.answer()

    def _is_next(self, stamped: Stamped) -> bool:
        """Return whether a state continues the flight; one that does not is reported."""
        step, stamp, last, events = stamped.step, stamped.stamp_ns, self._states.last, self.node.events
        if not self._states.allows(step):
            if self._states.is_far_ahead(step):
                text = f"step {step}, more than {LARGEST_GAP:g} s after {last}"
                events.reject("state", text, stamp, "rejected_future")
            return False
        if abs(stamp - step * self._period) > LARGEST_GAP * NANOSECONDS:
            events.reject("state", f"stamp {stamp} ns is not that of step {step}", stamp, "rejected_stamp")
            return False
        if (step >= self._due or step < last) and not is_flyable(stamped.value):
            events.reject("state", "a number that is not finite or out of range", stamp)
            return False
        return last >= 0 or self._joins(step)

    def _on_deadline(self) -> None:
        """Real time: the next state is here. Answer the one that waits with the inputs that there are."""
        if self._pending and not self._lockstep:
            self.answer(is_due=True)
