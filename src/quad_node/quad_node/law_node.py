"""A responder that runs one control law and publishes its internals."""

import time
from typing import Any

from rclpy.publisher import Publisher

from quad_core.parameters import Value
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.codec import packer
from quad_node.conversion import all_finite, extra_names
from quad_node.responder import Held, Moment, Responder, age

_CATCH_UP = 2.0  # s that a shadow has for its last answers


class LawNode(Responder):
    """Holds a law's memory between steps."""

    def __init__(self, role: str, internals_type: type[Any]) -> None:
        """Load the law of parameter ``law``; raises as FlightNode."""
        super().__init__(role)
        self.law = self.resolved.plugins["law"]
        self._last: tuple[FlightState, float] | None = None
        self._memory = self.law.module.init(self.law.parameters, self.vehicle)
        internals = self.law.module.Internals
        self._pack_internals = packer(internals, internals_type)
        self._internals: Any = None
        self._internals_out = self.publisher(f"{role}/internals")
        self.internals_names = extra_names(internals, internals_type)
        self.say_parameters()

    def run_law(self, inputs: Any, moment: Moment) -> Any:
        """Step the law; returns its output, None (and the memory unchanged) if a number in it is not finite."""
        output, memory, internals = self.law.module.step(
            self.law.parameters, self.vehicle, self._memory, inputs, moment.dt
        )
        if not (all_finite(output) and all_finite(memory)):
            self.event(FlightEvent.ERROR, "law_nonfinite", f"{self.law.name}: non-finite output", moment.stamp_ns)
            self.finish(1, f"{self.law.name}: non-finite output at step {moment.step}")
            return None
        self._memory, self._internals = memory, internals
        return output

    def internals_answer(self, moment: Moment) -> tuple[Publisher, bytes]:
        """Return the internals of the last step as an answer to ``moment``."""
        return self._internals_out, self._pack_internals(self._internals, moment.step, moment.step, moment.stamp_ns)

    def on_flight_ended(self, message: FlightState) -> None:
        """Leave; a shadow first answers what it has not answered yet, because nobody waited for it."""
        if self._last is None:
            self._last = (message, time.monotonic())
        if not self.shadow or self._caught_up():
            super().on_flight_ended(message)

    def on_tick(self) -> None:
        """Let a shadow leave."""
        if self._last is not None and self._caught_up():
            super().on_flight_ended(self._last[0])

    def _caught_up(self) -> bool:
        assert self._last is not None
        message, since = self._last
        due = message.step // self.period_steps * self.period_steps
        return not self.lockstep or self.step >= due or time.monotonic() - since > _CATCH_UP

    def stale(self, topic: str, held: Held) -> None:
        """Report that a held input is too old to be used as it is."""
        self.event(FlightEvent.WARNING, "stale_input", f"{topic}: {age(held) * 1e3:.0f} ms old; safe output")

    def on_parameters(self, changes: dict[str, Value]) -> None:  # noqa: ARG002
        """Let the law run on with its new parameters; its memory is kept."""
        self.law = self.resolved.plugins["law"]
        self.say_parameters()
