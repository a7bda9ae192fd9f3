"""A plant whose rotors an autopilot drives through its simulator interface: model, sensors, motors, connection."""

from typing import Any

from quad_core.cycle import is_flyable, seconds
from quad_core.types import VehicleState, Wrench
from quad_dynamics.plant_model import PlantModel
from quad_mavlink import link
from quad_mavlink.hil import motors
from quad_mavlink.hil.exchange import Exchange
from quad_mavlink.hil.server import Server
from quad_mavlink.hil.sleepers import Watch, name, parties
from quad_mavlink.hil.suite import Suite
from quad_msgs.msg import FlightEvent
from quad_node.flight_node import FlightNode
from quad_px4 import mapping

BEFORE_STEP_0 = -1
"""Step of the plant while the flight has not begun: what acts is what acts at its beginning."""


class HilVehicle:
    """The plant of ``node``; ``answer`` is the autopilot's first, until it is flown."""

    def __init__(self, node: FlightNode) -> None:
        """Make plant and sensors and open the port; raises ParameterError for what cannot fly."""
        self._node, self.settings = node, node.resolved.node
        mavlink = link.load()
        self.airframe = motors.airframe(node.vehicle, self.settings.thrust_curve)
        self._mapping = mapping.build(self.airframe)
        self.model = PlantModel(node.resolved)
        self._period = node.flight.plant_period
        suite = Suite(self.settings, node.flight.seed, self._period, node.vehicle.gravity)
        self.exchange = Exchange(mavlink, Server(mavlink, self.settings.listen), suite)
        self.answer: motors.Answer | None = None
        self._is_connected = False
        node.event(FlightEvent.INFO, "airframe", f"PX4 must have {motors.described(self.airframe)}", always=True)

    @property
    def time_usec(self) -> int:
        """Time of the last reading in us: the autopilot's clock."""
        return self.exchange.suite.time_usec

    @property
    def is_left(self) -> bool:
        """Whether the autopilot has closed the connection."""
        return self.exchange.server.is_closed

    def boot(self, until: float) -> str:
        """Run the clock of an autopilot that boots until the steady time ``until`` s.

        Returns what has not come of it yet, empty once ``answer`` is its first; raises RefusedError.
        """
        if not self.exchange.server.accept():
            return f"an autopilot on tcp {self.settings.listen}"
        if not self._is_connected:
            self._is_connected = True
            text = f"connected on tcp {self.settings.listen}"
            self._node.event(FlightEvent.INFO, "autopilot", text, always=True)
        wind = self.model.conditions.wind_w
        self.answer = self.exchange.boot(self.model.truth, wind, seconds(1, self._period), until)
        return "" if self.answer is not None else "the autopilot's first HIL_ACTUATOR_CONTROLS"

    def ask(self) -> None:
        """Send what the sensors read."""
        self.exchange.send(self.model.truth, self.model.conditions.wind_w)

    def listen(self, patience: float) -> motors.Answer | None:
        """Return the answer to what was sent; None after ``patience`` s; raises RefusedError."""
        found, self.answer = self.answer or self.exchange.answer(patience), None
        return found

    def newest(self, patience: float) -> motors.Answer | None:
        """Return the newest outputs, whatever they answer; None if none come in ``patience`` s; raises RefusedError."""
        found, self.answer = self.answer or self.exchange.answer(patience, newest=True), None
        while found is not None and (later := self.exchange.answer(0.0, newest=True)) is not None:
            found = later
        return found

    def watch(self) -> Watch | None:
        """Return who must sleep before the autopilot is done; None, and an event, if it is not on this machine."""
        connection = self.exchange.server.peer
        found = parties(connection) if connection is not None else []
        if not found:
            text = "PX4 is no process of this machine that can be watched: the plant waits gate.settle and gate.linger"
            self._node.event(FlightEvent.WARNING, "not_watched", text, always=True)
            return None
        text = f"the plant waits until these sleep: {', '.join(f'{name(process)} ({process})' for process in found)}"
        self._node.event(FlightEvent.INFO, "watched", text, always=True)
        return Watch(found)

    def integrate(self, step: int, answer: motors.Answer) -> VehicleState:
        """Return the true state after ``step``, over which the motors do what ``answer`` says."""
        wrench = motors.wrench(self._mapping, answer)
        if step > BEFORE_STEP_0:
            wrench = self.model.receive(step, wrench, step).wrench
        return self.model.advance(step, wrench if answer.armed else Wrench())

    def divergence(self, truth: VehicleState, step: int) -> str:
        """Return why ``truth`` after ``step`` cannot be flown on from, empty if it can."""
        after = seconds(step + 1, self._period)
        return "" if is_flyable(truth) else f"diverged: the state left its bounds at t = {after:.3f} s"

    def measurements(self) -> dict[str, Any]:
        """Return diagnostics: answers that came late, bytes that were no message."""
        return {"stale_answers": self.exchange.stale, "lost_bytes": self.exchange.server.lost}

    def close(self) -> None:
        """Close the connection."""
        self.exchange.server.close()
