"""The simulator node: plant behind `state` and the command; in lockstep it owns time.

Subscribes: wrench_setpoint (WrenchStamped), flight/plan (FlightPlan), flight/nodes (NodeStatus),
flight/recorded (RecorderAck).
Publishes: state (VehicleState), truth (VehicleState), actuation (Actuation), disturbance (Disturbance),
odom (Odometry), clock (Clock), flight/state (FlightState), flight/guard (GuardStatus).
With a commander it subscribes also: flight/mode/steps (FlightMode).
With a commander it publishes also: flight/request (FlightRequest).
In real time it watches the setpoints' age as well (``quad_node.command_link``). Topics that every node has:
``quad_node.flight_node``.
"""

import sys
import time
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock

from quad_core.cascade import COMMAND, COMMANDING, RECORDER, SIMULATOR
from quad_core.cycle import is_flyable, seconds
from quad_core.geometry import rotate_inverse
from quad_core.types import VehicleState
from quad_dynamics.plant_model import PlantModel
from quad_guard.checks import StateSample, WrenchCommand
from quad_guard.ending import is_down
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.codec import Packer
from quad_node.conversion import set_stamp
from quad_node.main import run
from quad_node.vehicle_node import VehicleNode

_WAITING = 0.05  # s between two messages on odom before a flight in lockstep
_DRAWN_AHEAD = 1800.0  # s; a plan of a day must not take the machine's memory
_STANDS = "at rest, but too high above the ground for its motors to stop"
_UNGUARDED_PATIENCE = 1.0  # s without a command after which a flight in real time fails if its guard is off


def announce(node: VehicleNode, model: PlantModel, step: int) -> None:
    """Report as events of ``node`` what begins or ends to act on ``model`` at ``step``."""
    for kind, text in model.announced(step):
        node.event(FlightEvent.INFO, kind, text, step * node.flight.plant_period, always=True)


class Simulator(VehicleNode):
    """Integrates the plant and publishes what it does."""

    def __init__(self) -> None:
        """Build plant and disturbance from the parameters; raises as FlightNode."""
        super().__init__(SIMULATOR)
        self.settings = self.resolved.node
        self.model = PlantModel(self.resolved)
        self.model.stand(self.guard.parameters.ground_height)
        if self.commanded and not self.lockstep:  # no plan says how long it flies, and drawing holds up the plant
            self.on_plan(sys.maxsize)
        self._state_out = self.output("state") if self.settings.publish_state else None
        self._truth_out, self._actuation_out = self.output("truth"), self.output("actuation")
        self._disturbance_out = self.output("disturbance")
        self._odom_out = self.publisher("odom", match=self._state_out is None)
        self._clock_out = self.publisher("clock", match=False)
        self._odom, self._clock = Odometry(), Clock()
        self._published_step = -1
        self._timer: Any = None
        self._clock_start = 0.0
        self._before_flight: Any = None
        if not self.settings.publish_state:  # an estimator has to be seen before it is flown with
            rate = _WAITING if self.lockstep else seconds(1, self.flight.plant_period)
            self._before_flight = self.every(rate, lambda: self._publish_for_tools(0))

    def on_plan(self, end_step: int) -> None:
        """Draw what is random for the whole flight, or for the first part of a very long one."""
        self.model.cover(min(end_step, round(_DRAWN_AHEAD / seconds(1, self.flight.plant_period))))

    def begin(self) -> None:
        """Publish step 0."""
        if self._before_flight is not None:
            self._before_flight.cancel()
        announce(self, self.model, self.current_step)
        self._publish_step()

    def progress(self) -> None:
        """Lockstep: integrate [k, k+1) once the command for k, the plan and the recorder's leave are there.

        With a commander its mode of step k instead of the plan. In real time the steady clock drives the plant from the
        first command on; until then the vehicle rests.
        """
        if self.phase != FlightState.FLYING or self.gives_up:
            return
        if not self.lockstep:
            if self.command is not None:
                self._start_clock()
            return
        recorded = self.unrecorded or self.current_step <= self.recorded_step + self.settings.window
        if self._is_answered() and (recorded or RECORDER not in self.roles):
            self._integrate()

    def _is_answered(self) -> bool:
        """Return whether all that this step of a lockstep flight needs is there, the recorder's leave aside."""
        if not (self.link.holds(self.current_step) if self.link else self.end_step):
            return False
        due = self.current_step % self.handshake.period(COMMANDING) == 0
        return not due or (self.command is not None and self.command.step == self.current_step)

    def on_given_up(self) -> None:
        """Go on at the pace of the steady clock, without commands: no node is waited for."""
        if self._timer is None:
            self._start_clock()

    def _start_clock(self) -> None:
        if self._timer is not None:
            return
        self._clock_start = time.monotonic() - seconds(self.current_step, self.flight.plant_period)
        self._timer = self.every(seconds(1, self.flight.plant_period), self._on_period)

    def _on_period(self) -> None:
        """Real time: catch up with the steady clock, holding the newest command."""
        if self.phase != FlightState.FLYING:
            return
        now = time.monotonic()
        if self.command is not None and not self.gives_up:
            quiet = now - self.command_at
            if quiet > _UNGUARDED_PATIENCE and not self.guard.parameters.enabled:
                self.end(FlightState.FAILED, f"{COMMAND}: nothing from {COMMANDING} for {quiet:.2f} s")
                return
            self.missed_commands += self.command.step < self.current_step
        behind = int((now - self._clock_start) * 1e9) // self.flight.plant_period - self.current_step
        self.counters["overruns"] += max(behind - 1, 0)
        self.note_pause(seconds(behind, self.flight.plant_period))
        for _ in range(behind):
            if self.phase == FlightState.FLYING:
                self._integrate(publish=self.lockstep)
        if self.phase == FlightState.FLYING and behind > 0 and not self.lockstep:
            self._publish_step()

    def _integrate(self, publish: bool = True) -> None:
        step = self.current_step
        # a step that was caught up with is not published: no controller could answer it
        sample = StateSample(self.model.state, step, self._published_step == step)
        flown = self.guarded(self._received(), sample)
        self.model.armed = self.armed
        truth = self.model.advance(step, flown)
        ending = self._ending(truth)
        if ending is not None:
            self._send(self._actuation_out, self.model.actuation, step)
            self.end(*ending)
        else:
            self.current_step += 1
            announce(self, self.model, self.current_step)
            if publish:
                self._publish_step()

    def _received(self) -> WrenchCommand:
        """Return the newest command that came through the link; none new once the flight was given up."""
        if self.command is None or self.gives_up:
            return WrenchCommand()
        return self.model.receive(self.current_step, self.command.value, self.command.step)

    def _ending(self, truth: VehicleState) -> tuple[int, str] | None:
        """Return phase and reason if the flight ends with the step that led to ``truth``."""
        after, memory = self.current_step + 1, self.guard.memory
        if not is_flyable(truth):
            left = seconds(after, self.flight.plant_period)
            return FlightState.FAILED, f"diverged: the state left its bounds at t = {left:.3f} s"
        if self.link is not None and self.link.is_over:
            reason = self.failure if self.gives_up else self.link.outcome or self.failure
            if reason and self.suspect not in reason:
                reason = f"{reason}; {self.suspect}"
            return FlightState.FAILED if reason else FlightState.ENDED, reason
        if self.link is not None and not self.gives_up:
            stands = memory.descent.rest_time > self.settings.descent_timeout
            return (FlightState.FAILED, f"{self.failure}; {_STANDS}") if stands else None
        if not self.guard.taken_over:
            return (FlightState.ENDED, "") if self.end_step and after >= self.end_step else None
        if is_down(self.guard.parameters, memory, truth, self.model.has_ground):
            return FlightState.FAILED, f"{self.failure}; down at step {after}"
        if self.lockstep and not self.gives_up and self.end_step and after >= self.end_step:
            return FlightState.FAILED, f"{self.failure}; the plan ended before the vehicle was down"
        if seconds(after - memory.since, self.flight.plant_period) > self.settings.descent_timeout:
            return FlightState.FAILED, f"{self.failure}; not down after {self.settings.descent_timeout:g} s"
        return None

    def _publish_step(self) -> None:
        """Publish the state first: what no controller waits for goes out while they compute."""
        step, model = self.current_step, self.model
        if step > 0:
            self._send(self._actuation_out, model.actuation, model.actuated_step)
        self.asked_at, self._published_step = time.monotonic(), step
        self.input_watch.note_state()
        if self._state_out is None:
            self._publish_for_tools(step)
        else:
            self._send(self._state_out, model.state, step)
        self._send(self._truth_out, model.truth, step)
        self._send(self._disturbance_out, model.disturbance(), step)
        if self._state_out is not None:
            self._publish_for_tools(step)

    def _send(self, output: tuple[Publisher, Packer], value: Any, step: int) -> None:
        publisher, pack = output
        publisher.publish(pack(value, step, step + 1, step * self.flight.plant_period))

    def _publish_for_tools(self, step: int) -> None:
        """Publish odom (pose in map, twist in base_link) and clock, where they are due; no control depends on them."""
        stamp = step * self.flight.plant_period
        if step % self.settings.clock_period_steps == 0:
            set_stamp(self._clock.clock, stamp)
            self._clock_out.publish(self._clock)
        if step % self.settings.odom_period_steps == 0:
            self._odom_out.publish(fill(self._odom, self.model.state, stamp))

    def watch(self) -> None:
        """Give up a flight whose step is not answered: in lockstep any, in real time the first."""
        if self._timer is not None or time.monotonic() - self.asked_at <= self.settings.answer_timeout:
            return
        if self.commanded and self.lockstep and self._is_answered():
            self.unrecorded = True
            text = f"{self.blame()}; what is flown from now on is not recorded"
            self.event(FlightEvent.WARNING, "recorder_lost", text, self.elapsed_ns)
            self.progress()
        else:
            self.give_up(self.blame())


def fill(message: Odometry, state: VehicleState, stamp: int) -> Odometry:
    """Return ``message`` with the pose of base_link in map and the twist in base_link; its covariances stay.

    A new message takes more than ten times as long to make as its numbers take to be set.
    """
    message.header.frame_id, message.child_frame_id = "map", "base_link"
    set_stamp(message.header.stamp, stamp)
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    position.x, position.y, position.z = state.p_w
    orientation.x, orientation.y, orientation.z, orientation.w = state.q_wb
    linear.x, linear.y, linear.z = rotate_inverse(state.q_wb, state.v_w)
    angular.x, angular.y, angular.z = state.omega_b
    return message


def main() -> None:
    """Run the simulator node."""
    sys.exit(run(SIMULATOR, Simulator, f"Simulated quadrotor: takes {COMMAND}, publishes state and truth."))
