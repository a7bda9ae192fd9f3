"""A responder that runs one control law and publishes its internals."""

import time
from typing import Any

from rclpy.publisher import Publisher

from quad_core import programs
from quad_core.machine_code import MachineCode, stepper
from quad_core.node_parameters import ROLES, SHADOW
from quad_core.parameters import Value
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.codec import numbers_packer
from quad_node.conversion import extra_names
from quad_node.responder import Held, Moment, Responder, age

_CATCH_UP = 2.0  # s that a shadow has for its last answers


class LawNode(Responder):
    """Holds a law's memory between steps."""

    def __init__(self, role: str, internals_type: type[Any]) -> None:
        """Load the law of parameter ``law``; raises as FlightNode."""
        super().__init__(role)
        self.law = self.resolved.plugins["law"]
        self._last: tuple[FlightState, float] | None = None
        group = ROLES[self.role.removeprefix(SHADOW)].slots["law"]
        memory = self.law.module.init(self.law.parameters, self.vehicle)
        start = {"parameters": self.law.parameters, "vehicle": self.vehicle, "memory": memory}
        self._stepper = stepper(programs.law(group, self.law.module), self.flight.machine_code, start)
        internals = self.law.module.Internals
        self._pack_internals = numbers_packer(internals, internals_type)
        self._internals_out = self.publisher(f"{role}/internals")
        self.internals_names = extra_names(internals, internals_type)
        self.say_parameters()

    def run_law(self, inputs: Any, moment: Moment) -> Any:
        """Step the law; returns its output, None (and the memory unchanged) if a number in it is not finite."""
        law = self._stepper
        law.put("inputs", inputs)
        law.put("dt", moment.dt)
        law.run("step")
        if not (law.is_finite("output") and law.is_finite("next")):
            self.event(FlightEvent.ERROR, "law_nonfinite", f"{self.law.name}: non-finite output", moment.stamp_ns)
            self.finish(1, f"{self.law.name}: non-finite output at step {moment.step}")
            return None
        law.copy("next", "memory")
        return law.get("output")

    def internals_answer(self, moment: Moment) -> tuple[Publisher, bytes]:
        """Return the internals of the last step as an answer to ``moment``."""
        numbers = self._stepper.numbers("internals")
        return self._internals_out, self._pack_internals(numbers, moment.step, moment.step, moment.stamp_ns)

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

    def measurements(self) -> dict[str, Any]:
        """Return whether the law is run as machine code, 1 or 0."""
        return {"machine_code": int(isinstance(self._stepper, MachineCode))}

    def stale(self, topic: str, held: Held) -> None:
        """Report that a held input is too old to be used as it is."""
        self.event(FlightEvent.WARNING, "stale_input", f"{topic}: {age(held) * 1e3:.0f} ms old; safe output")

    def on_parameters(self, changes: dict[str, Value]) -> None:  # noqa: ARG002
        """Let the law run on with its new parameters; its memory is kept."""
        self.law = self.resolved.plugins["law"]
        self._stepper.put("parameters", self.law.parameters)
        self.say_parameters()
