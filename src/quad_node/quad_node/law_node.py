"""The node of any stage: it runs the stage's law, and keeps the law's memory between steps.

Subscribes: state (VehicleState), and the topics that the stage takes (``stage.py`` of each controller's package).
Publishes: what the stage gives, and the law's internals.
"""

import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from rclpy.publisher import Publisher

from quad_core.cascade import SHADOW, SIGNALS, STAGE
from quad_core.records import field_kinds, flattener, numbers_finite
from quad_core.resolution import Plugin
from quad_core.types import InputSteps, StepRecord
from quad_core.vehicle import safe_input
from quad_msgs.msg import FlightState
from quad_node import topics
from quad_node.codec import Stamped, extra_names, numbers_packer, packer
from quad_node.flight_node import FlightNode
from quad_node.responder import Responder, Sample

_CATCH_UP = 2.0  # s that a shadow has for its last answers


class LawNode:
    """``law``: the law with the parameters that it runs with; a live change keeps its ``memory``.

    ``on_internals``: called with what the law showed of itself in each step.
    """

    def __init__(self, role: str) -> None:
        """Load the law of parameter ``law``; raises as FlightNode."""
        self.node = node = FlightNode(role, watch=self._watch, deactivate=self.deactivate)
        self.responder = Responder(node, self.step)
        self._ended: tuple[FlightState, float] | None = None
        self.on_internals: Callable[[Any, Sample], None] | None = None
        stage = STAGE[node.role.removeprefix(SHADOW)]
        self._resolved = node.resolved
        self.law: Plugin = node.resolved.law
        module = self.law.module
        self.compute, self.memory = module.step, module.init(self.law.parameters, node.vehicle)
        self._flat_output, self._flat_memory = flattener(stage.output_type), flattener(module.Memory)
        self._inputs = stage.inputs_type
        for taken in stage.inputs:
            self.responder.take(taken.topic, taken.lag)
        self._unsaid = [SIGNALS[taken.topic].kind() for taken in stage.inputs]  # before the first value of an input
        self._output_out = node.links.publisher(stage.output)
        self._internals_out = node.links.publisher(stage.internals_topic)
        self._pack = packer(stage.output_type, topics.message_type(stage.output_type), node.run)
        message = topics.message_type(stage.internals)
        self._flat_internals = flattener(module.Internals)
        fields = [*field_kinds(StepRecord).items(), *field_kinds(module.Internals).items()]
        recorded: Any = NamedTuple("Recorded", fields)  # type: ignore[misc]
        self._pack_internals = numbers_packer(recorded, message, node.run)
        node.internals_names = extra_names(module.Internals, message)
        node.publish_parameters()

    def step(self, sample: Sample, arrivals: list[Stamped | None]) -> Iterator[tuple[Publisher, Any]]:
        """Give the output and the internals of one step."""
        node, step = self.node, sample.step
        if self._resolved is not node.resolved:  # a live change
            self._resolved, self.law = node.resolved, node.resolved.law
        law, (values, replaced) = self.law, self._values_of(sample, arrivals)
        if values is None:
            return
        if sample.state.on_ground:  # what was learnt in an earlier flight is of no use for the next one
            self.memory = law.module.init(law.parameters, node.vehicle)
        inputs = self._inputs(sample.state, *values)
        output, memory, internals = self.compute(law.parameters, node.vehicle, self.memory, inputs, sample.dt)
        if not (numbers_finite(self._flat_output(output)) and numbers_finite(self._flat_memory(memory))):
            node.events.error("law_nonfinite", f"{law.name}: non-finite output", sample.stamp_ns)
            node.finish(1, f"{law.name}: non-finite output at step {step}")
            return
        self.memory = memory
        if self.on_internals is not None:
            self.on_internals(internals, sample)
        yield self._output_out, self._pack(output, step, step + node.period_steps, sample.stamp_ns)
        steps = [arrival.step if arrival else -1 for arrival in arrivals]
        steps += [-1] * (len(InputSteps._fields) - len(steps))
        numbers = (sample.dt, *steps, replaced, *self._flat_internals(internals))
        yield self._internals_out, self._pack_internals(numbers, step, step, sample.stamp_ns)

    def _values_of(self, sample: Sample, arrivals: list[Stamped | None]) -> tuple[list[Any] | None, int]:
        """Return the law's inputs other than the state, None if one is too old and has no replacement.

        The second result has bit k set if a safe value replaces input k.
        """
        node, replaced = self.node, 0
        values = [arrival.value if arrival else self._unsaid[place] for place, arrival in enumerate(arrivals)]
        for place, taken in enumerate(() if node.lockstep else self.responder.inputs):
            age = time.monotonic() - taken.heard if arrivals[place] else 0.0
            if not taken.lag and age > node.settings.input_timeout:
                node.events.warn("stale_input", f"{taken.topic}: {age * 1e3:.0f} ms old; safe output")
                values[place] = safe_input(taken.topic, values[place], node.vehicle, sample.state)
                replaced |= 1 << place
                if values[place] is None:
                    return None, replaced
        return values, replaced

    def deactivate(self, ended: FlightState) -> None:
        """Leave, a shadow a little later."""
        self._ended = self._ended or (ended, time.monotonic())
        self._watch()

    def _watch(self) -> None:
        """Leave after the end; a shadow in lockstep first answers what is due, because no node waited for it."""
        if self._ended is not None:
            ended, since = self._ended
            node = self.node
            due = ended.step // node.period_steps * node.period_steps if node.shadow and node.lockstep else 0
            if node.current_step >= due or time.monotonic() - since > _CATCH_UP:
                node.leave(ended)
