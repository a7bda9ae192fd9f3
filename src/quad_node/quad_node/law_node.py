"""A node that runs one stage of the cascade: its law, its inputs and its output are those of the table's row."""

import time
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.publisher import Publisher

from quad_core.cascade import SHADOW, SIGNALS, STAGE
from quad_core.cycle import finite_check
from quad_core.parameters import Value
from quad_core.records import flattener, joined
from quad_core.safe import safe_input
from quad_core.types import InputSteps, StepRecord
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.codec import numbers_packer, packer
from quad_node.conversion import extra_names
from quad_node.hot_standby import standby_of
from quad_node.inputs import Arrival, age
from quad_node.responder import Responder, Sample
from quad_node.topics import message_type

_CATCH_UP = 2.0  # s that a shadow has for its last answers


class LawNode(Responder):
    """Holds a law's memory between steps. ``on_internals``: called with what the law showed of itself in each step."""

    def __init__(self, role: str) -> None:
        """Load the law of parameter ``law``; raises as FlightNode."""
        super().__init__(role)
        self.stage = STAGE[self.role.removeprefix(SHADOW)]
        self._ended: tuple[FlightState, float] | None = None
        self.on_internals: Callable[[Any, Sample], None] | None = None
        self.law = self.resolved.law
        module = self.law.module
        self.step = module.step
        self.memory = module.init(self.law.parameters, self.vehicle)
        self._is_finite = finite_check(self.stage.output)
        self._is_memory_finite = finite_check(module.Memory)
        for taken in self.stage.takes:
            self.take(taken.topic, taken.lag)
        self.outputs = [self.publisher(self.stage.gives)]
        self._pack = packer(self.stage.output, message_type(self.stage.output), self.run)
        internals_message = message_type(self.stage.internals)
        self.inside = [self.publisher(self.stage.internals_topic)]
        self._flat_internals = flattener(module.Internals)
        recorded = joined("Recorded", StepRecord, module.Internals)
        self._pack_internals = numbers_packer(recorded, internals_message, self.run)
        self.internals_names = extra_names(module.Internals, internals_message)
        self.standby = standby_of(self)
        self.publish_parameters()

    def answer(self, sample: Sample, arrivals: list[Arrival | None]) -> Iterator[tuple[Publisher, Any]]:
        """Give the output and the internals of one step."""
        values, replaced = self._values_of(sample, arrivals)
        if values is None:
            return
        if sample.state.on_ground:  # what was learnt in an earlier flight is of no use for the next one
            self.memory = self.law.module.init(self.law.parameters, self.vehicle)
        inputs = self.stage.inputs(sample.state, *values)
        output, memory, internals = self.step(self.law.parameters, self.vehicle, self.memory, inputs, sample.dt)
        if not (self._is_finite(output) and self._is_memory_finite(memory)):
            self.event(FlightEvent.ERROR, "law_nonfinite", f"{self.law.name}: non-finite output", sample.stamp_ns)
            self.finish(1, f"{self.law.name}: non-finite output at step {sample.step}")
            return
        self.memory = memory
        if self.on_internals is not None:
            self.on_internals(internals, sample)
        self.standby.before(sample.step)
        answer = self._pack(output, sample.step, sample.step + self.period_steps, sample.stamp_ns)
        for publisher in self.outputs:
            yield publisher, answer
        steps = [arrival.step if arrival else -1 for arrival in arrivals]
        steps += [-1] * (len(InputSteps._fields) - len(steps))
        numbers = (sample.dt, *steps, replaced, *self._flat_internals(internals))
        shown = self._pack_internals(numbers, sample.step, sample.step, sample.stamp_ns)
        for publisher in self.inside:
            yield publisher, shown

    def comes_late(self, step: int) -> bool:
        """Return whether to compute from ``step`` on: as a shadow or a standby."""
        return self.standby.comes_late(step) or super().comes_late(step)

    def leaves_out(self, step: int) -> bool:
        """Return whether not to answer a step: no node waits for a shadow, so its inputs may be lost."""
        return not self.standby.flies and any(taken.is_lost(step) for taken in self.inputs)

    def _values_of(self, sample: Sample, arrivals: list[Arrival | None]) -> tuple[list[Any] | None, int]:
        """Return the law's inputs other than the state, None if one is too old and has no replacement.

        The second result has bit k set if a safe value replaces input k.
        """
        values, replaced = [], 0
        for place, (taken, arrival) in enumerate(zip(self.stage.takes, arrivals, strict=True)):
            value = arrival.value if arrival else SIGNALS[taken.topic].kind()
            if arrival and not self.lockstep and not taken.lag and age(arrival) > self.resolved.node.input_timeout:
                self._report_stale(taken.topic, arrival)
                value = safe_input(taken.topic, value, self.vehicle, sample.state)
                replaced |= 1 << place
                if value is None:
                    return None, replaced
            values.append(value)
        return values, replaced

    def on_flight_ended(self, message: FlightState) -> None:
        """Leave; a shadow first answers what it has not answered yet, because no node waited for it."""
        if self._ended is None:
            self._ended = (message, time.monotonic())
        if not self.shadow or self._caught_up():
            super().on_flight_ended(message)

    def on_tick(self) -> None:
        """Let a shadow leave."""
        if self._ended is not None and self._caught_up():
            super().on_flight_ended(self._ended[0])

    def _caught_up(self) -> bool:
        assert self._ended is not None
        message, since = self._ended
        due = message.step // self.period_steps * self.period_steps
        return not self.lockstep or self.current_step >= due or time.monotonic() - since > _CATCH_UP

    def _report_stale(self, topic: str, arrival: Arrival) -> None:
        self.event(FlightEvent.WARNING, "stale_input", f"{topic}: {age(arrival) * 1e3:.0f} ms old; safe output")

    def on_parameters(self, changes: dict[str, Value]) -> None:  # noqa: ARG002
        """Let the law run on with its new parameters; its memory is kept."""
        self.law = self.resolved.law
