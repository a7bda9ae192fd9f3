"""`ros2 run quad_mavlink hil_plant`: our plant under an autopilot's simulator interface, in lockstep.

It owns the vehicle and the autopilot's clock: sensors go out over TCP, motor outputs come back, and the plant advances
only with them. ``state``, ``truth``, ``actuation`` and ``disturbance`` are published as the simulator does.
"""

import sys
import time

from quad_core.cascade import RECORDER
from quad_core.cycle import seconds
from quad_core.parameters import ParameterError
from quad_core.types import VehicleState
from quad_dynamics.plant_output import PlantOutput
from quad_mavlink.hil import motors
from quad_mavlink.hil.exchange import RefusedError
from quad_mavlink.hil.vehicle import HilVehicle
from quad_mavlink.interface import HIL
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.main import run
from quad_node.vehicle_node import VehicleNode

_SLICE = 0.02  # s of steps between two looks at the other nodes
_BOOT_SLICE = 0.045
_REPORT_EVERY, _NOW = 2.0, 0.01  # s: the shortest time of which a pace is said

SUMMARY = """Our plant under PX4's simulator interface: sensors over TCP, motor outputs back, in lockstep.

  ros2 run quad_mavlink hil_plant --ros-args --params-file x500.yaml -p rigid_body.ground.enabled:=true
  ros2 run quad_mavlink hil_plant --ros-args --params-file x500.yaml --params-file wind.yaml -p duration:=60.0
  ros2 run quad_mavlink hil_plant --ros-args --params-file x500.yaml -p flight.roles:=simulator,recorder
Then start PX4: it connects to port 4560 by itself. Exit codes: 0 flown to the end, 1 failed, 2 bad set-up."""
ALONE = ["-p", "flight.roles:=simulator", "-p", "flight.plant_period:=4000000"]
"""What this node takes if it is not told otherwise: no other client, and the 250 Hz of PX4's simulated IMU."""


class HilPlant(VehicleNode):
    """Integrates the plant under an autopilot's motor outputs and publishes what it does."""

    def __init__(self) -> None:
        """Make plant and sensors and open the port; raises as FlightNode, ParameterError for what cannot fly."""
        super().__init__(HIL)
        self.settings = self.resolved.node
        if not self.lockstep:
            raise ParameterError("flight.mode: found realtime, expected lockstep: the autopilot's clock is ours")
        if self.commanded:
            raise ParameterError("flight.roles: found commander, expected none: the autopilot has its own modes")
        self.armed = False  # the autopilot is its own guard
        self.hil = HilVehicle(self)
        self.model = self.hil.model
        self.was_armed = False
        self._output = PlantOutput(self, self.model)
        self._is_asked = self._is_scheduled = self._is_over = False
        self._reported = (0.0, 0)

    def prepare(self) -> list[str]:
        """Wait for the autopilot, and run its clock until its first answer."""
        if self.hil.answer is not None:
            return []
        missing = ""
        try:
            missing = self.hil.boot(time.monotonic() + _BOOT_SLICE)
        except RefusedError as error:
            self.end(FlightState.FAILED, str(error))
        if self.hil.is_left:
            self.end(FlightState.FAILED, "the autopilot closed the connection before its first answer")
        return [missing] if missing else []

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
            self.hil.ask()
        answer = self.hil.listen(_SLICE)
        if answer is not None:
            self._integrate(answer)
        elif self.hil.is_left:
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
        truth = self.hil.integrate(step, answer)
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
        if diverged := self.hil.divergence(truth, self.current_step):
            return FlightState.FAILED, diverged
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
        self._report(_NOW)

    def _report(self, every: float = _REPORT_EVERY) -> None:
        (last, step), now = self._reported, time.monotonic()
        if now - last < every:
            return
        pace = seconds(self.current_step - step, self.flight.plant_period) / (now - last)
        self._reported = (now, self.current_step)
        state = "armed" if self.was_armed else "disarmed"
        flown = seconds(self.current_step, self.flight.plant_period)
        height = self.model.truth.p_w.z
        self.get_logger().info(f"t = {flown:.1f} s, {pace:.1f} x real time, {state}, height {height:.2f} m")

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the base's, answers that came late, bytes that were no message."""
        return {**super().measurements(), **self.hil.measurements()}

    def close(self) -> None:
        """Close the connection."""
        self.hil.close()


def main() -> None:
    """Run the plant under an autopilot."""
    program, *given = sys.argv
    words = [program, "--ros-args", *ALONE, "--", *given]
    sys.exit(run(HIL, HilPlant, SUMMARY, words))
