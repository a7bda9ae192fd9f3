"""The simulator node: plant behind `state` and the command; in lockstep it owns time.

Subscribes: wrench_setpoint (WrenchStamped), flight/plan (FlightPlan), flight/nodes (NodeStatus),
flight/recorded (RecorderAck).
Publishes: state (VehicleState), truth (VehicleState), actuation (Actuation), disturbance (Disturbance),
odom (Odometry), clock (Clock), flight/state (FlightState), flight/guard (GuardStatus).
With a commander it subscribes also: flight/mode/steps (FlightMode).
With a commander it publishes also: flight/request (FlightRequest).
In real time it watches the setpoints' age as well (``quad_node.command_link``). Topics that every node has:
``quad_node.flight_node``; what leads the flight: ``quad_node.flight_leader``.
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
from quad_msgs.msg import FlightState
from quad_node.codec import Packer, set_stamp
from quad_node.flight_leader import FlightLeader
from quad_node.flight_node import FlightNode
from quad_node.main import run

_WAITING = 0.05  # s between two messages on odom before a flight in lockstep
_DRAWN_AHEAD = 1800.0  # s; a plan of a day must not take the machine's memory
_STANDS = "at rest, but too high above the ground for its motors to stop"
_UNGUARDED_PATIENCE = 1.0  # s without a command after which a flight in real time fails if its guard is off


def announce(leader: FlightLeader, model: PlantModel, step: int) -> None:
    """Report as events what begins or ends to act on ``model`` at ``step``."""
    for kind, text in model.announced(step):
        leader.node.events.info(kind, text, step * leader.node.flight.plant_period, always=True)


class Simulator:
    """Integrates the plant and publishes what it does."""

    def __init__(self) -> None:
        """Build plant and disturbance from the parameters; raises as FlightNode."""
        self.node = node = FlightNode(SIMULATOR, watch=self._watch, deactivate=self.deactivate)
        self.leader = leader = FlightLeader(node, activate=self.activate, progress=self._progress)
        self.settings, self._period = node.settings, node.flight.plant_period
        self.model = PlantModel(node.resolved)
        self.model.stand(leader.guard.parameters.ground_height)
        self._is_drawn = False
        if node.commanded and not node.lockstep:  # no plan says how long it flies, and drawing holds up the plant
            self._draw(sys.maxsize)
        self._state_out = leader.output("state") if self.settings.publish_state else None
        self._truth_out, self._actuation_out = leader.output("truth"), leader.output("actuation")
        self._disturbance_out = leader.output("disturbance")
        self._odom_out = node.links.publisher("odom", match=self._state_out is None)
        self._clock_out = node.links.publisher("clock", match=False)
        self._odom, self._clock = Odometry(), Clock()
        self._published_step = -1
        self._timer: Any = None
        self._clock_start = 0.0
        self._before_flight: Any = None
        if not self.settings.publish_state:  # an estimator has to be seen before it is flown with
            rate = _WAITING if node.lockstep else seconds(1, self._period)
            self._before_flight = node.every(rate, lambda: self._publish_for_tools(0, self._published_step))

    def activate(self) -> None:
        """Begin the flight: publish step 0."""
        if self._before_flight is not None:
            self._before_flight.cancel()
        announce(self.leader, self.model, self.node.current_step)
        self._publish_step()

    def _progress(self) -> None:
        """Lockstep: integrate [k, k+1) once the command for k, the plan and the recorder's leave are there.

        With a commander its mode of step k instead of the plan. In real time the steady clock drives the plant from the
        first command on; until then the vehicle rests. It also does once the flight was given up.
        """
        leader, node = self.leader, self.node
        if leader.end_step and not self._is_drawn:
            self._draw(leader.end_step)
        if leader.phase != FlightState.FLYING:
            return
        if leader.gives_up or not node.lockstep:
            if leader.gives_up or leader.wrenches.newest is not None:
                self._start_clock()
            return
        recorded = leader.unrecorded or node.current_step <= leader.recorded_step + self.settings.window
        if self._is_answered() and (recorded or RECORDER not in node.roles):
            self.step()

    def _is_answered(self) -> bool:
        """Return whether all that this step of a lockstep flight needs is there, the recorder's leave aside."""
        leader, step = self.leader, self.node.current_step
        if not (leader.link.holds(step) if leader.link else leader.end_step):
            return False
        return step % leader.handshake.period(COMMANDING) != 0 or leader.wrenches.answers(step)

    def _draw(self, end_step: int) -> None:
        """Draw what is random for the whole flight, or for the first part of a very long one."""
        self._is_drawn = True
        self.model.cover(min(end_step, round(_DRAWN_AHEAD / seconds(1, self._period))))

    def _start_clock(self) -> None:
        if self._timer is None:
            self._clock_start = time.monotonic() - seconds(self.node.current_step, self._period)
            self._timer = self.node.every(seconds(1, self._period), self._on_period)

    def _on_period(self) -> None:
        """Real time: catch up with the steady clock, holding the newest command."""
        leader, wrenches, step = self.leader, self.leader.wrenches, self.node.current_step
        if leader.phase != FlightState.FLYING:
            return
        now = time.monotonic()
        if wrenches.newest is not None and not leader.gives_up:
            quiet = now - wrenches.at
            if quiet > _UNGUARDED_PATIENCE and not leader.guard.parameters.enabled:
                leader.end(FlightState.FAILED, f"{COMMAND}: nothing from {COMMANDING} for {quiet:.2f} s")
                return
            wrenches.missed += wrenches.newest.step < step - step % leader.handshake.period(COMMANDING)
        behind = int((now - self._clock_start) * 1e9) // self._period - step
        late = max(behind - 1, 0)
        self.node.events.counts["overruns"] += late
        leader.note_pause(seconds(late, self._period))
        for _ in range(behind):
            if leader.phase == FlightState.FLYING:
                self.step(publish=self.node.lockstep)
        if leader.phase == FlightState.FLYING and behind > 0 and not self.node.lockstep:
            self._publish_step()

    def step(self, publish: bool = True) -> None:
        """Integrate one plant period under the wrench that the guard lets through, and publish the next state."""
        leader, step = self.leader, self.node.current_step
        # a step that was caught up with is not published: no controller could answer it
        sample = StateSample(self.model.state, step, self._published_step == step)
        flown = leader.guarded(self._received(step), sample)
        self.model.armed = leader.armed
        truth = self.model.advance(step, flown)
        ending = self._ending(truth)
        if ending is not None:
            self._send(self._actuation_out, self.model.actuation, step)
            leader.end(*ending)
        else:
            self.node.current_step = step + 1
            announce(leader, self.model, step + 1)
            if publish:
                self._publish_step()

    def _received(self, step: int) -> WrenchCommand:
        """Return the newest command that came through the link; none new once the flight was given up."""
        newest = self.leader.wrenches.newest
        if newest is None or self.leader.gives_up:
            return WrenchCommand()
        return self.model.receive(step, newest.value, newest.step)

    def _ending(self, truth: VehicleState) -> tuple[int, str] | None:
        """Return phase and reason if the flight ends with the step that led to ``truth``."""
        leader, link, period = self.leader, self.leader.link, self._period
        after, memory = self.node.current_step + 1, leader.guard.memory
        if not is_flyable(truth):
            return FlightState.FAILED, f"diverged: the state left its bounds at t = {seconds(after, period):.3f} s"
        if link is not None and link.is_over:
            reason = leader.failure if leader.gives_up else link.outcome or leader.failure
            if reason and leader.suspect not in reason:
                reason = f"{reason}; {leader.suspect}"
            return FlightState.FAILED if reason else FlightState.ENDED, reason
        if link is not None and not leader.gives_up:
            stands = memory.descent.rest_time > self.settings.descent_timeout
            return (FlightState.FAILED, f"{leader.failure}; {_STANDS}") if stands else None
        is_planned_end = leader.end_step and after >= leader.end_step
        if not leader.guard.taken_over:
            return (FlightState.ENDED, "") if is_planned_end else None
        if is_down(leader.guard.parameters, memory, truth, self.model.has_ground):
            return FlightState.FAILED, f"{leader.failure}; down at step {after}"
        if self.node.lockstep and not leader.gives_up and is_planned_end:
            return FlightState.FAILED, f"{leader.failure}; the plan ended before the vehicle was down"
        if seconds(after - memory.since, period) > self.settings.descent_timeout:
            return FlightState.FAILED, f"{leader.failure}; not down after {self.settings.descent_timeout:g} s"
        return None

    def _publish_step(self) -> None:
        """Publish the state first: what no controller waits for goes out while they compute."""
        step, model, before = self.node.current_step, self.model, self._published_step
        if step > 0:
            self._send(self._actuation_out, model.actuation, model.actuated_step)
        self._published_step = step
        self.leader.asks()
        if self._state_out is None:
            self._publish_for_tools(step, before)
        else:
            self._send(self._state_out, model.state, step)
        self._send(self._truth_out, model.truth, step)
        self._send(self._disturbance_out, model.disturbance(), step)
        if self._state_out is not None:
            self._publish_for_tools(step, before)

    def _send(self, output: tuple[Publisher, Packer], value: Any, step: int) -> None:
        publisher, pack = output
        publisher.publish(pack(value, step, step + 1, step * self._period))

    def _publish_for_tools(self, step: int, before: int) -> None:
        """Publish odom (pose in map, twist in base_link) and clock if due since step ``before``; no law needs them."""
        stamp, settings = step * self._period, self.settings
        if step // settings.clock_period_steps > before // settings.clock_period_steps:
            set_stamp(self._clock.clock, stamp)
            self._clock_out.publish(self._clock)
        if step // settings.odom_period_steps > before // settings.odom_period_steps:
            self._odom_out.publish(fill(self._odom, self.model.state, stamp))

    def _watch(self) -> None:
        """Give up a flight whose step is not answered: in lockstep any, in real time the first."""
        leader, node = self.leader, self.node
        if not leader.watch() or self._timer is not None:
            return
        if time.monotonic() - leader.wrenches.asked_at <= self.settings.answer_timeout:
            return
        if node.commanded and node.lockstep and self._is_answered():
            leader.unrecorded = True
            text = f"{leader.blame()}; what is flown from now on is not recorded"
            node.events.warn("recorder_lost", text, leader.elapsed_ns)
            self._progress()
        else:
            leader.give_up(leader.blame())

    def deactivate(self, ended: FlightState) -> None:
        """End the flight because of a signal."""
        self.leader.end(ended.state, ended.reason)
        self.node.exit_code = 1


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
