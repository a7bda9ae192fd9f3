"""The simulator node: plant behind `state` and `wrench_setpoint`; in lockstep it owns time."""

import sys
import time
from collections import deque

from rclpy.clock import Clock, ClockType

from quad_core.bounds import is_flyable
from quad_core.program import all_finite
from quad_core.timing import seconds
from quad_core.types import Actuation, Disturbance, VehicleState, Wrench
from quad_dynamics.plant_model import PlantModel
from quad_dynamics.tools_output import ToolsOutput
from quad_msgs.msg import Actuation as ActuationMsg
from quad_msgs.msg import Disturbance as DisturbanceMsg
from quad_msgs.msg import FlightEvent, FlightPlan, FlightState, NodeStatus, RecorderAck
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import packer, unpack_wrench
from quad_node.conversion import set_stamp
from quad_node.flight_node import FlightNode
from quad_node.handshake import Handshake
from quad_node.interface import interface_hash
from quad_node.main import run


class Simulator(FlightNode):
    """Integrates the plant and publishes what it does."""

    def __init__(self) -> None:
        """Build plant and disturbance from the parameters; raises as FlightNode."""
        super().__init__(topics.SIMULATOR)
        self.settings = self.resolved.node
        self.model = PlantModel(self.resolved)
        self.handshake = Handshake(self.flight, interface_hash(), [role for role in self.roles if role != self.role])
        self._state_out = None
        if self.settings.publish_state:
            self._state_out = (self.publisher("state"), packer(VehicleState, VehicleStateMsg))
        self._truth_out = (self.publisher("truth"), packer(VehicleState, VehicleStateMsg))
        self._actuation_out = (self.publisher("actuation"), packer(Actuation, ActuationMsg))
        self._disturbance_out = (self.publisher("disturbance"), packer(Disturbance, DisturbanceMsg))
        self._flight_state = self.publisher("flight/state")
        self._tools = ToolsOutput(self)
        self.subscribe("wrench_setpoint", self._on_wrench, raw=True)
        self.subscribe("flight/plan", self._on_plan)
        self.subscribe("flight/nodes", self._on_node, depth=64)
        self.subscribe("flight/recorded", self._on_recorded)
        self._phase = FlightState.WAITING
        self._end_step = 0
        self._announcements = deque(self.model.announcements())
        self._acked = -1
        self._command: tuple[int, Wrench] | None = None
        self._applied = Wrench()
        self._command_arrived = 0.0
        self._asked = 0.0
        self._repeats = 0
        self._begun = 0.0
        self._reason = ""
        self._farewell = 0.0
        self._missed = 0
        self._latencies: list[float] = []
        self._ticks_since_state = 0
        self._timer = None

    def on_ready(self) -> None:
        """Publish that a flight is waiting for its nodes."""
        self._say_flight("")

    def _on_node(self, message: NodeStatus) -> None:
        problem = self.handshake.hear(message)
        if problem:
            self.event(FlightEvent.ERROR, "handshake", problem)
            self._end(FlightState.FAILED, problem)
        elif self._phase in (FlightState.ENDED, FlightState.FAILED):
            self._leave_when_recorded()

    def _on_plan(self, message: FlightPlan) -> None:
        if not self._end_step:
            self.model.cover(message.end_step)
        self._end_step = message.end_step
        self._advance()

    def _on_recorded(self, message: RecorderAck) -> None:
        self._acked = max(self._acked, message.step)
        self._advance()

    def _on_wrench(self, payload: bytes) -> None:
        wrench, stamp = unpack_wrench(payload)
        if not all_finite(wrench):
            self.counters["rejected"] += 1
            self.event(
                FlightEvent.WARNING, "rejected_nonfinite", "wrench_setpoint: a non-finite number; ignored", stamp
            )
            return
        self._command = (stamp // self.flight.plant_period, wrench)
        self._command_arrived = time.monotonic()
        if self._command[0] == self.step:
            self._latencies.append(self._command_arrived - self._asked)
        if self.lockstep:
            self._advance()

    def _begin(self) -> None:
        self._phase = FlightState.FLYING
        self.flying = True
        self._begun = self._command_arrived = time.monotonic()
        self._say_flight("")
        self._announce()
        self._publish_step()
        if not self.lockstep:
            period = seconds(1, self.flight.plant_period)
            self._timer = self.create_timer(period, self._on_period, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _advance(self) -> None:
        """Lockstep: integrate [k, k+1) once the command for k, the plan and the recorder's leave are there."""
        if self._phase != FlightState.FLYING or not self.lockstep or not self._end_step:
            return
        if self.step % self.handshake.period(topics.ATTITUDE) == 0:
            if self._command is None or self._command[0] != self.step:
                return
            self._applied = self._command[1]
        if topics.RECORDER in self.roles and self.step > self._acked + self.settings.window:
            return
        self._integrate()

    def _on_period(self) -> None:
        """Real time: catch up with the steady clock, holding the newest command."""
        if self._phase != FlightState.FLYING:
            return
        due = int((time.monotonic() - self._begun) * 1e9) // self.flight.plant_period
        quiet = time.monotonic() - self._command_arrived
        if quiet > self.settings.loss_timeout:
            self._end(FlightState.FAILED, f"wrench_setpoint: nothing from attitude_controller for {quiet:.2f} s")
            return
        self._applied = self._command[1] if self._command and quiet <= self.settings.command_timeout else Wrench()
        if self._command and self._command[0] < self.step:
            self._missed += 1
        behind = due - self.step
        self.counters["overruns"] += max(behind - 1, 0)
        for _ in range(behind):
            if self._phase == FlightState.FLYING:
                self._integrate(publish=False)
        if self._phase == FlightState.FLYING and behind > 0:
            self._publish_step()

    def _integrate(self, publish: bool = True) -> None:
        truth = self.model.advance(self.step, self._applied)
        if not is_flyable(truth):
            self._publish_actuation()
            time_left = seconds(self.step + 1, self.flight.plant_period)
            self._end(FlightState.FAILED, f"diverged: the state left its bounds at t = {time_left:.3f} s")
        elif self._end_step and self.step + 1 >= self._end_step:
            self._publish_actuation()
            self._end(FlightState.ENDED, "")
        else:
            self.step += 1
            self._repeats = 0
            self._announce()
            if publish:
                self._publish_step()

    def _announce(self) -> None:
        """Report what begins or ends to act at this step."""
        time_now = seconds(self.step, self.flight.plant_period)
        while self._announcements and self._announcements[0][0] <= time_now:
            _, kind, text = self._announcements.popleft()
            self.event(FlightEvent.INFO, kind, text, self.step * self.flight.plant_period, always=True)

    def _publish_step(self) -> None:
        stamp = self.step * self.flight.plant_period
        truth, state = self.model.truth, self.model.state
        if self.step > 0:
            self._publish_actuation()
        self._asked = time.monotonic()
        if self._state_out is None:
            self._tools.publish(self.step, stamp, state)
        else:
            self._send(self._state_out, state, self.step, stamp)
        # what no controller waits for goes out while they compute
        self._send(self._truth_out, truth, self.step, stamp)
        self._send(self._disturbance_out, self.model.disturbance(), self.step, stamp)
        if self._state_out is not None:
            self._tools.publish(self.step, stamp, state)

    def _publish_actuation(self) -> None:
        step = self.model.actuated_step
        self._send(self._actuation_out, self.model.actuation, step, step * self.flight.plant_period)

    @staticmethod
    def _send(output: tuple, value: tuple, step: int, stamp: int) -> None:
        publisher, pack = output
        publisher.publish(pack(value, step, step + 1, stamp))

    def on_tick(self) -> None:
        """Watch the start, a silent node, the end."""
        now = time.monotonic()
        self._ticks_since_state += 1
        if self._phase == FlightState.WAITING:
            missing = self.handshake.missing() + self.missing_links()
            if not missing:
                self._begin()
            elif now - self.started > self.flight.start_timeout:
                self._end(FlightState.FAILED, f"not ready after {self.flight.start_timeout:g} s: {', '.join(missing)}")
        elif self._phase == FlightState.FLYING:
            if self.lockstep and now - self._asked > self.settings.repeat_after:
                self._ask_again()
        elif now > self._farewell:
            self.finish(self.exit_code, self._reason or "recorder did not finish in time")
        if self._ticks_since_state >= 10:
            self._say_flight(self._reason)

    def _ask_again(self) -> None:
        self._repeats += 1
        if self._repeats <= self.settings.repeat_limit:
            self.counters["repeats"] += 1
            self._publish_step()
            return
        self._end(FlightState.FAILED, self._culprit())

    def _culprit(self) -> str:
        answered = self._command is not None and self._command[0] == self.step
        return self.handshake.culprit(self.step, self._acked, answered, self._end_step > 0)

    def _end(self, phase: int, reason: str) -> None:
        if self._phase in (FlightState.ENDED, FlightState.FAILED):
            return
        self._phase, self._reason = phase, reason
        self.flying = False
        self.exit_code = 0 if phase == FlightState.ENDED else 1
        if reason:
            self.event(FlightEvent.ERROR, "flight_failed", reason, self.step * self.flight.plant_period)
        self._say_flight(reason)
        self._publish_diagnostics()
        self._farewell = time.monotonic() + (self.flight.silence_timeout if topics.RECORDER in self.roles else 0.5)
        self._leave_when_recorded()

    def _leave_when_recorded(self) -> None:
        recorder = self.handshake.state(topics.RECORDER)
        if recorder == NodeStatus.DONE:
            self.finish(self.exit_code, self._reason)
        elif recorder == NodeStatus.FAULT:
            self.finish(1, f"recorder failed: {self.handshake.detail(topics.RECORDER)}")

    def _say_flight(self, reason: str) -> None:
        self._ticks_since_state = 0
        waiting = self._phase == FlightState.WAITING
        message = FlightState(
            step=self.step,
            end_step=self._end_step,
            state=self._phase,
            reason="waiting for " + ", ".join(self.handshake.missing()) if waiting else reason,
            run_id=self.flight.run_id,
            interface_hash=interface_hash(),
            wall_time=time.monotonic() - self._begun if self._begun else 0.0,
        )
        set_stamp(message.stamp, self.step * self.flight.plant_period)
        self._flight_state.publish(message)

    def on_interrupt(self, name: str) -> None:
        """Tell the others that the flight is over."""
        self._end(FlightState.FAILED, f"simulator stopped by {name}")
        self.exit_code = 1

    def measurements(self) -> dict[str, float]:
        """Return how the plant is run, commands missed, and how long (ms) after a state its command came of late."""
        found: dict[str, float] = {"missed_commands": self._missed, "machine_code": self.model.machine_code}
        taken, self._latencies = sorted(self._latencies), []
        if taken:
            for name, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0)):
                found[f"latency_{name}"] = round(1e3 * taken[round(share * (len(taken) - 1))], 4)
        return found


def main() -> None:
    """Run the simulator node."""
    sys.exit(run(topics.SIMULATOR, Simulator, "Simulated quadrotor: takes wrench_setpoint, publishes state and truth."))
