"""What a vehicle interface has in addition: it leads the flight, from the handshake to the end, for all nodes.

Subscribes: wrench_setpoint (WrenchStamped), flight/plan (FlightPlan), flight/nodes (NodeStatus),
flight/recorded (RecorderAck); with a commander flight/mode/steps (FlightMode).
Publishes: flight/state (FlightState), flight/guard (GuardStatus); with a commander flight/request (FlightRequest).

Its parts, in the order in which a flight needs them: handshake, command link (the commander's modes), wrenches, guard,
input watch. The node itself publishes ``state`` and ``actuation``: it alone knows them. At a step it calls ``asks`` as
the state goes out, ``guarded`` once the wrench is there, and moves ``current_step`` on (``quad_dynamics.node``).
"""

import time
from collections.abc import Callable

from rclpy.publisher import Publisher

from quad_core.cascade import COMMAND, COMMANDER, RECORDER, SIGNALS, TRAJECTORY
from quad_core.cycle import seconds
from quad_core.enumerations import GuardReason, GuardRequest, NodeState
from quad_core.parameters import ParameterError
from quad_core.types import Wrench
from quad_guard.checks import StateSample, WrenchCommand
from quad_msgs.msg import FlightPlan, FlightState, NodeStatus, RecorderAck
from quad_node.codec import Packer, packer, set_stamp
from quad_node.command_link import CommandLink, InputWatch, WrenchLink
from quad_node.executor import STARTER_GONE
from quad_node.flight_node import ALL_SIGNALS, FlightNode
from quad_node.handshake import Handshake, interface_hash, plan_refusal
from quad_node.topics import message_type
from quad_node.vehicle_guard import VehicleGuard

_STATE_EVERY = 10  # ticks between two messages on flight/state
_UNRECORDED_PATIENCE = 0.5  # s for the nodes of a flight without recorder to receive its end
_STOOD_STILL = 0.03  # s late from which on this process, or its host, is to blame for what is old
_STATES_LOST = 0.1  # s without a state after which a commander asks for a descent
_HEARD = 0.04  # s since a wrench of any quality arrived: shorter than the guard's patience


class FlightLeader:
    """Starts the flight when all nodes are ready, and ends it for all of them.

    While ``armed`` is false the guard rests and the rotors get nothing. ``gives_up``: only the guard flies on, and of a
    commander's requests only KILL counts. ``unrecorded``: the recorder was given up. ``suspect``: the node that caused
    the last guard takeover. ``estimator``: the node that gives the state.
    """

    def __init__(
        self,
        node: FlightNode,
        *,
        activate: Callable[[], None],
        progress: Callable[[], None],
        missing: Callable[[], list[str]] = list,
        comes_down: Callable[[str], bool] = lambda _: False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Lead the flight of ``node``; raises ParameterError.

        ``activate``: the flight begins. ``progress``: a command, a plan, an acknowledgement has come, or the flight was
        given up. ``missing``: what the vehicle waits for, all nodes being ready. ``comes_down`` gets the reason of an
        end and returns whether the vehicle has to land before. ``clock``: s by which the flight is watched.
        """
        self.node, self._activate, self._progress = node, activate, progress
        self._missing, self._comes_down = missing, comes_down
        self._period = node.flight.plant_period
        self.handshake = Handshake(node.flight, interface_hash(), [name for name in node.roles if name != node.role])
        self.phase = FlightState.WAITING
        self.end_step, self.recorded_step = 0, -1
        self.armed = True
        self.cause = self.suspect = ""
        self._late = 0.0
        self.gives_up = self.unrecorded = False
        self.estimator = "the estimator"
        self._reason, self._leave_by, self._begun_at, self._ticks = "", 0.0, 0.0, 0
        limits = node.settings.guard._replace(has_commander=node.commanded)
        if node.commanded and not limits.enabled:
            raise ParameterError("guard.enabled: found false, expected true: a commander reads what the guard reports")
        if node.commanded or (limits.enabled and not node.lockstep):
            node.outlived = ALL_SIGNALS
        node.waits_for = self._waits_for
        self._flight_state = node.links.publisher("flight/state")
        self.link = CommandLink(node, self._on_mode) if node.commanded else None
        self.guard = VehicleGuard(node, limits, lambda: self.handshake.period(COMMANDER) if node.commanded else 0)
        self.wrenches = WrenchLink(node, self.guard, progress)
        self.input_watch = InputWatch(node, self.handshake.period, clock)
        node.links.subscribe("flight/plan", self._on_plan)
        node.links.subscribe("flight/nodes", self._on_node, depth=64)
        node.links.subscribe("flight/recorded", self._on_recorded)

    def output(self, topic: str) -> tuple[Publisher, Packer]:
        """Return a publisher of a topic of every step and what packs its messages."""
        kind = SIGNALS[topic].kind
        return self.node.links.publisher(topic), packer(kind, message_type(kind), self.node.run)

    @property
    def elapsed_ns(self) -> int:
        """Flight time of the current step in ns."""
        return self.node.current_step * self._period

    def asks(self) -> None:
        """Note that a state goes out, which the other nodes answer."""
        self.wrenches.asked_at = time.monotonic()
        self.input_watch.note_state()

    def watch(self) -> bool:
        """Watch the start, the flight, the end, 20 times a second; return whether the flight is under way."""
        now, node = time.monotonic(), self.node
        self._ticks += 1
        if self.phase == FlightState.WAITING:
            self._watch_start(now)
        elif self.phase == FlightState.FLYING:
            if self.link is not None:
                self.link.pass_on(node.asked_to_end)
            elif node.asked_to_end:
                self.give_up(f"{node.role} stopped by {node.asked_to_end}")
            if (silent := self.input_watch.silent()) and (node.commanded or self.guard.parameters.enabled):
                self.give_up(silent)
        elif now > self._leave_by or (RECORDER in node.roles and not self._has_recorder()):
            ended = "recorder did not finish in time" if self._has_recorder() else "flight ended"
            node.finish(node.exit_code, self._reason or ended)
        if self._ticks % _STATE_EVERY == 0:
            self.publish_flight_state()
        return bool(self.phase == FlightState.FLYING)

    def _watch_start(self, now: float) -> None:
        node = self.node
        missing = self.handshake.missing() + node.missing() or self._missing()
        if not missing:
            self.phase, node.flying, self._begun_at = FlightState.FLYING, True, now
            node.log.info("flying")
            self.publish_flight_state()
            self._activate()
        elif node.starter.is_gone():
            self.end(FlightState.FAILED, STARTER_GONE)
        elif now - node.started > node.flight.start_timeout:
            late = f"not ready after {node.flight.start_timeout:g} s: {', '.join(missing)}"
            self.end(FlightState.FAILED, late + self.handshake.foreign_nodes())

    def _waits_for(self) -> list[str]:
        """Return what must come before the flight begins."""
        others = [f"flight/nodes READY of {role}" for role in self.handshake.missing()] + self.node.missing()
        return others or self._missing()

    def guarded(self, command: WrenchCommand, sample: StateSample, step: int | None = None) -> Wrench:
        """Return the wrench for the rotors over ``step``: ``command``'s, the backup law's, or none.

        ``step``: None is the current one; ``command`` and ``sample``: the newest, the state as it was published.
        """
        link, step = self.link, self.node.current_step if step is None else step
        if link is not None and not self.gives_up:
            self.armed = link.armed
        if not self.armed:
            self.guard.rest(step)
            return Wrench()
        request = link.mode.value.guard_request if link is not None else GuardRequest.NONE
        if self.gives_up and request != GuardRequest.KILL:
            request = GuardRequest.DESCEND
        flown = self.guard.step(step, command, sample, request)
        if self.guard.taken_over and self.guard.memory.since == step:
            self.suspect = self._culprit() or self.suspect
            if link is None:
                self.cause = self.cause or self.suspect
        return flown

    @property
    def failure(self) -> str:
        """Why the flight failed: which node or what failed, and what the guard did about it."""
        return "; ".join(part for part in (self.cause, self.guard.describe()) if part)

    def give_up(self, cause: str) -> None:
        """End the flight as FAILED because of ``cause``: under way, once the guard has brought the vehicle down."""
        self.cause = self.cause or cause
        if self.phase != FlightState.FLYING or not (self.guard.parameters.enabled and self.armed):
            self.end(FlightState.FAILED, self.cause)
        elif not self.gives_up:
            self.gives_up, self.guard.asked_because = True, cause
            self.node.events.error("given_up", f"{cause}; the guard lands the vehicle", self.elapsed_ns)
            self._progress()

    def end(self, phase: int, reason: str) -> None:
        """End the flight, once; ``phase``: FlightState.ENDED or FAILED. A vehicle that has to land does so first."""
        if self.node.over or self._comes_down(reason):
            return
        node, self.phase, self._reason = self.node, phase, reason
        node.flying, node.over = False, True
        node.exit_code = 0 if phase == FlightState.ENDED else 1
        if reason:
            node.events.error("flight_failed", reason, self.elapsed_ns)
        self.publish_flight_state()
        node.publish_diagnostics()
        patience = node.flight.silence_timeout if self._has_recorder() else _UNRECORDED_PATIENCE
        self._leave_by = time.monotonic() + patience
        self._leave_when_recorded()

    def note_pause(self, late: float) -> None:
        """Note by how many s this process came too late."""
        self._late = late

    @property
    def stood_still(self) -> str:
        """Who stood still for how long when this process came last, empty if that is next to nothing."""
        return f"{self.node.ros.get_name()} stood still for {self._late:.2f} s" if self._late > _STOOD_STILL else ""

    def _culprit(self) -> str:
        """Return who or what made the guard take over, empty if it was the flight itself."""
        step, reason = self.node.current_step, self.guard.memory.reason
        if reason == GuardReason.REQUESTED and self._late > _STATES_LOST:  # asked for because of that
            return self.stood_still
        if reason not in (GuardReason.STATE_LOST, GuardReason.WRENCH_LOST):
            return ""
        if self.stood_still:
            return self.stood_still
        if reason == GuardReason.STATE_LOST:
            return f"state: nothing good from {self.estimator}"
        if seconds(step - self.wrenches.heard_step, self._period) <= _HEARD:
            return f"{COMMAND} arrives, but no good one reaches the rotors"
        planned = self.node.commanded or self.end_step > 0  # in real time a step's mode is often still on its way
        return self.handshake.blame(step, self.recorded_step, False, planned)

    def blame(self) -> str:
        """Return why the current step cannot go on: the node whose last step is behind, or a missing topic."""
        step = self.node.current_step
        planned = self.link.holds(step) if self.link else self.end_step > 0
        missing = self.handshake.blame(step, self.recorded_step, self.wrenches.answers(step), planned)
        return self.handshake.behind(step) or missing

    def publish_flight_state(self) -> None:
        """Publish phase, step and reason."""
        missing = ", ".join(self.handshake.missing() or self._missing()) if self.phase == FlightState.WAITING else ""
        message = FlightState(
            step=self.node.current_step,
            end_step=self.end_step,
            state=self.phase,
            reason=f"waiting for {missing}{self.handshake.foreign_nodes()}" if missing else self._reason,
            run=self.node.run,
            interface_hash=interface_hash(),
            wall_time=time.monotonic() - self._begun_at if self._begun_at else 0.0,
        )
        set_stamp(message.stamp, self.elapsed_ns)
        self._flight_state.publish(message)

    def _has_recorder(self) -> bool:
        is_there = self.node.ros.count_publishers("flight/recorded") > 0
        return RECORDER in self.node.roles and not self.unrecorded and is_there

    def _on_node(self, message: NodeStatus) -> None:
        problem = self.handshake.on_status(message)
        flies = self.link is not None and self.link.armed and self.phase != FlightState.WAITING
        if problem and flies and message.role in (TRAJECTORY, RECORDER):
            self.node.events.warn("node_failed", problem, always=True)  # neither is needed to land
            if message.role == RECORDER:
                self.unrecorded = True
                self._progress()
        elif problem and not self.node.over:
            self.node.events.error("handshake", problem)
            self.give_up(problem)
        if self.node.over:
            self._leave_when_recorded()

    def _on_mode(self) -> None:
        self.input_watch.note("flight/mode")
        self._progress()

    def _on_plan(self, message: FlightPlan) -> None:
        if self.node.is_foreign("flight/plan", message.run):
            return
        if refusal := plan_refusal(message.end_step, self.end_step, self._period):
            self.node.events.reject("flight/plan", refusal, self.elapsed_ns, "rejected_plan")
        elif not (self.end_step or self.node.commanded):
            self.end_step = message.end_step
        self._progress()

    def _on_recorded(self, message: RecorderAck) -> None:
        if self.node.is_foreign("flight/recorded", message.run):
            return
        if message.step > self.node.current_step:  # accepted, it would let the plant run away from its recorder
            text = f"step {message.step} is not flown yet"
            self.node.events.reject("flight/recorded", text, self.elapsed_ns, "rejected_future")
        else:
            self.recorded_step = max(self.recorded_step, message.step)
            self._progress()

    def _leave_when_recorded(self) -> None:
        recorder = self.handshake.known.get(RECORDER)
        if recorder is not None and recorder.state == NodeState.DONE:
            self.node.finish(self.node.exit_code, self._reason)
        elif recorder is not None and recorder.state == NodeState.FAULT:
            self.node.finish(1, f"recorder failed: {recorder.detail}")
