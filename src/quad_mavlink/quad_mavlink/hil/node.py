"""`ros2 run quad_mavlink hil_plant`: our plant under an autopilot's simulator interface, in lockstep.

It owns the vehicle and the autopilot's clock: sensors go out over TCP, motor outputs come back, and the plant advances
only with them. ``state``, ``truth``, ``actuation`` and ``disturbance`` are published as the simulator does.
"""

import sys
import time

from quad_core.cascade import HIL, RECORDER
from quad_core.cycle import is_flyable, seconds
from quad_core.parameters import ParameterError
from quad_core.types import VehicleState, Wrench
from quad_dynamics.plant_model import PlantModel
from quad_dynamics.plant_output import PlantOutput
from quad_mavlink import link
from quad_mavlink.hil import motors
from quad_mavlink.hil.exchange import Exchange, RefusedError
from quad_mavlink.hil.server import Server
from quad_mavlink.hil.suite import Suite
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.main import run
from quad_node.native import NATIVE, native_or_python
from quad_node.vehicle_node import VehicleNode
from quad_px4 import mapping

_SLICE = 0.02  # s of steps between two looks at the other nodes
_BOOT_SLICE = 0.045
_REPORT_EVERY = 2.0  # s

SUMMARY = """Our plant under PX4's simulator interface: sensors over TCP, motor outputs back, in lockstep.

  ros2 run quad_mavlink hil_plant --ros-args --params-file x500.yaml -p rigid_body.ground.enabled:=true
  ros2 run quad_mavlink hil_plant --ros-args --params-file x500.yaml --params-file wind.yaml -p duration:=60.0
  ros2 run quad_mavlink hil_plant --ros-args --params-file x500.yaml -p flight.roles:=simulator,recorder
Then start PX4: it connects to port 4560 by itself. Exit codes: 0 flown to the end, 1 failed, 2 bad set-up."""
ALONE = ["-p", "flight.roles:=simulator", "-p", "flight.plant_period:=4000000"]
"""What this node takes if it is not told otherwise: nobody else, and the 250 Hz of PX4's simulated IMU."""


class HilPlant(VehicleNode):
    """Integrates the plant under an autopilot's motor outputs and publishes what it does."""

    def __init__(self) -> None:
        """Make plant and sensors and open the port; raises as FlightNode, ParameterError for what cannot fly."""
        super().__init__(HIL)
        settings = self.settings = self.resolved.node
        if not self.lockstep:
            raise ParameterError("flight.mode: found realtime, expected lockstep: the autopilot's clock is ours")
        if self.commanded:
            raise ParameterError("flight.roles: found commander, expected none: the autopilot has its own modes")
        self.armed = False  # the autopilot is its own guard
        mavlink = link.load()
        airframe = motors.airframe(self.vehicle, settings.thrust_curve)
        self.mapping = mapping.build(airframe)
        self.model = PlantModel(self.resolved)
        self.model.step, self.engine = native_or_python(self, self.model.step)
        self.model.lumped, _ = native_or_python(self, self.model.lumped)
        suite = Suite(settings, self.flight.seed, self.flight.plant_period, self.vehicle.gravity)
        self.exchange = Exchange(mavlink, Server(mavlink, settings.listen), suite)
        self.answer: motors.Answer | None = None
        self.was_armed = False
        self._output = PlantOutput(self, self.model)
        self._is_asked = self._is_scheduled = self._is_connected = self._is_over = False
        self._reported = (0.0, 0)
        self.event(FlightEvent.INFO, "airframe", f"PX4 must have {motors.described(airframe)}", always=True)

    def prepare(self) -> list[str]:
        """Wait for the autopilot, and run its clock until its first answer."""
        exchange = self.exchange
        if self.answer is not None:
            return []
        if not exchange.server.accept():
            return [f"an autopilot on tcp {self.settings.listen}"]
        if not self._is_connected:
            self._is_connected = True
            self.event(FlightEvent.INFO, "autopilot", f"connected on tcp {self.settings.listen}", always=True)
        period, until = seconds(1, self.flight.plant_period), time.monotonic() + _BOOT_SLICE
        try:
            self.answer = exchange.boot(self.model.truth, self.model.conditions.wind_w, period, until)
        except RefusedError as error:
            self.end(FlightState.FAILED, str(error))
        if exchange.server.is_closed:
            self.end(FlightState.FAILED, "the autopilot closed the connection before its first answer")
        return [] if self.answer is not None else ["the autopilot's first HIL_ACTUATOR_CONTROLS"]

    def begin(self) -> None:
        """Publish step 0, which the autopilot has answered."""
        self._is_asked = True
        self.asked_at = time.monotonic()
        self._reported = (self.asked_at, 0)
        self._output.announce(self.current_step, self.elapsed_ns)
        self._output.publish(0, 0)
        self.progress()

    def progress(self) -> None:
        """Go on, unless a slice is under way."""
        if self.phase == FlightState.FLYING and not self._is_scheduled and self.executor is not None:
            self._is_scheduled = True
            self.executor.create_task(self._on_slice)

    def _on_slice(self) -> None:
        """Fly for a while, then let the other callbacks have their turn."""
        self._is_scheduled = False
        until = time.monotonic() + _SLICE
        while self.phase == FlightState.FLYING and time.monotonic() < until:
            if RECORDER in self.roles and self.current_step > self.recorded_step + self.settings.window:
                return  # its next acknowledgement goes on
            try:
                self._fly()
            except RefusedError as error:
                self.end(FlightState.FAILED, f"step {self.current_step}: {error}")
        self.progress()

    def _fly(self) -> None:
        if not self._is_asked:
            self._is_asked, self.asked_at = True, time.monotonic()
            self.exchange.send(self.model.truth, self.model.conditions.wind_w)
        answer, self.answer = self.answer or self.exchange.answer(_SLICE), None
        if answer is not None:
            self._integrate(answer)
        elif self.exchange.server.is_closed:
            self._on_left()
        elif time.monotonic() - self.asked_at > self.settings.answer_timeout:
            text = f"the autopilot does not answer step {self.current_step}: silent for"
            self.end(FlightState.FAILED, f"{text} {self.settings.answer_timeout:g} s")

    def _on_left(self) -> None:
        if self.was_armed:
            self.end(FlightState.FAILED, f"step {self.current_step}: the autopilot closed the connection while armed")
        else:
            self._is_over = True
            self._integrate(motors.AT_REST)

    def _integrate(self, answer: motors.Answer) -> None:
        step = self.current_step
        self._on_arming(answer.armed)
        wrench, _ = self.model.receive(step, motors.wrench(self.mapping, answer), step)
        truth = self.model.advance(step, wrench if answer.armed else Wrench())
        self._is_asked = False
        self._output.publish_actuation()
        if ending := self._ending(truth):
            self.end(*ending)
            return
        self.current_step += 1
        self._output.announce(self.current_step, self.elapsed_ns)
        self._output.publish(self.current_step, self.elapsed_ns)
        self._report()

    def _ending(self, truth: VehicleState) -> tuple[int, str] | None:
        """Return phase and reason if the flight ends with the step that led to ``truth``."""
        after = seconds(self.current_step + 1, self.flight.plant_period)
        if not is_flyable(truth):
            return FlightState.FAILED, f"diverged: the state left its bounds at t = {after:.3f} s"
        is_over = self._is_over or 0.0 < self.settings.duration <= after
        return (FlightState.ENDED, "") if is_over else None

    def _on_arming(self, armed: bool) -> None:
        if armed == self.was_armed:
            return
        self.was_armed = armed
        kind = "armed" if armed else "disarmed"
        at = f"step {self.current_step}, height {self.model.truth.p_w.z:.2f} m"
        self.event(FlightEvent.INFO, kind, f"by the autopilot at {at}", self.elapsed_ns, always=True)
        self._is_over = self._is_over or (not armed and self.settings.end_disarmed)

    def _report(self) -> None:
        (last, step), now = self._reported, time.monotonic()
        if now - last < _REPORT_EVERY:
            return
        pace = seconds(self.current_step - step, self.flight.plant_period) / (now - last)
        self._reported = (now, self.current_step)
        state = "armed" if self.was_armed else "disarmed"
        flown = seconds(self.current_step, self.flight.plant_period)
        height = self.model.truth.p_w.z
        self.get_logger().info(f"t = {flown:.1f} s, {pace:.1f} x real time, {state}, height {height:.2f} m")

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the base's, answers that came late, bytes that were no message, engine."""
        found = {"stale_answers": self.exchange.stale, "lost_bytes": self.exchange.server.lost}
        return {**super().measurements(), **found, "machine_code": int(self.engine == NATIVE)}

    def close(self) -> None:
        """Close the connection."""
        self.exchange.server.close()


def main() -> None:
    """Run the plant under an autopilot."""
    program, *given = sys.argv
    words = [program, "--ros-args", *ALONE, "--", *given]
    sys.exit(run(HIL, HilPlant, SUMMARY, words))
