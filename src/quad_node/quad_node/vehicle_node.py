"""The base of whatever owns the vehicle (simulator, MuJoCo, bridge): handshake, plan, phases, command, guard, the end.

A subclass overrides ``begin``, ``progress`` and ``watch``, hands every wrench through ``guarded`` before the rotors get
it, and calls ``end`` or ``give_up``; it publishes ``state`` and ``actuation`` itself, for it alone knows them.
"""

import time
from collections.abc import Callable

from rclpy.publisher import Publisher

from quad_core.cascade import COMMAND, COMMANDER, RECORDER, SIGNALS, TRAJECTORY
from quad_core.cycle import seconds
from quad_core.enumerations import CommandRefusal, GuardMode, GuardReason, GuardRequest, NodeState, StateRefusal
from quad_core.guard_parameters import GuardParameters
from quad_core.parameters import ParameterError
from quad_core.types import GuardStatus, Wrench
from quad_guard import guard
from quad_guard.checks import (
    COMMAND_REFUSALS,
    STATE_REFUSALS,
    StateSample,
    WrenchCommand,
    command_refusal,
)
from quad_guard.ending import described
from quad_guard.guard import REASONS
from quad_msgs.msg import FlightEvent, FlightPlan, FlightState, NodeStatus, RecorderAck
from quad_msgs.msg import GuardStatus as GuardStatusMsg
from quad_node.codec import UNUSABLE, Packer, Stamped, packer, unpack_wrench
from quad_node.command_link import CommandLink, InputWatch
from quad_node.conversion import NANOSECONDS, set_stamp
from quad_node.flight_node import FlightNode
from quad_node.handshake import Handshake, plan_refusal
from quad_node.interface import interface_hash
from quad_node.starter import STARTER_GONE
from quad_node.topics import message_type

_STATE_EVERY = 10  # ticks between two messages on flight/state
_UNRECORDED_PATIENCE = 0.5  # s for the nodes of a flight without recorder to receive its end
_STOOD_STILL = 0.03  # s late from which on this process, or its host, is to blame for what is old
_HEARD = 0.04  # s since a wrench of any quality arrived: shorter than the guard's patience
_RESTING = GuardStatus()
_STATUS_PERIOD = 100_000_000  # ns between two messages on flight/guard while nothing changes


class VehicleGuard:
    """Holds the guard's memory between plant steps."""

    def __init__(self, node: FlightNode, parameters: GuardParameters, period_of: Callable[[], int]) -> None:
        """Make the guard of ``node`` and its publisher; ``period_of`` gives the commander's period in steps, 0: none.

        The step before each of its decisions is reported: in lockstep it waits for that.
        """
        self.parameters = parameters
        self.memory = guard.FRESH_MEMORY
        self.last_refusal = self.asked_because = ""
        self.killed = "motors off"  # what its KILL is
        self._node = node
        self._period = node.flight.plant_period
        self._dt = seconds(1, self._period)
        self._dropped = 0
        self._said: tuple[int, int, bool] = (GuardMode.PASS, GuardReason.GOOD, False)
        self._reported: dict[str, int] = {}
        self._due, self._period_of = 0, period_of
        self._status_out = node.publisher("flight/guard", match=False)

    @property
    def taken_over(self) -> bool:
        """Whether the controller's wrench no longer reaches the rotors."""
        return self.memory.mode != GuardMode.PASS

    def rest(self, step: int) -> None:
        """Let ``step`` pass without a look at it: ages count from the next one, no mode is latched."""
        self.memory = guard.FRESH_MEMORY
        self._tell(step, _RESTING)

    def step(self, step: int, command: WrenchCommand, sample: StateSample, request: int) -> Wrench:
        """Return the wrench for the rotors over plant step ``step``."""
        if not self.parameters.enabled:
            return command.wrench
        inputs = guard.Inputs(step, self._period, command, sample, request)
        flown, self.memory, report = guard.step(self.parameters, self._node.vehicle, self.memory, inputs, self._dt)
        # a sensor slower than the plant repeats itself rightly
        is_slow = (
            report.state_refusal == StateRefusal.FROZEN and report.status.state_age <= self.parameters.state.warn_age
        )
        if report.state_refusal != StateRefusal.ACCEPTED and not is_slow:
            self._tell_refusal(step, f"state: {STATE_REFUSALS[report.state_refusal]}")
        if report.command_refusal != CommandRefusal.ACCEPTED:
            self._tell_refusal(step, f"{COMMAND}: {COMMAND_REFUSALS[report.command_refusal]}")
        self._tell(step, report.status)
        return flown

    def refused(self, step: int, refusal: int) -> None:
        """Count and report a wrench that was refused when it arrived, so that it hid no good one."""
        self._dropped += 1
        self._tell_refusal(step, f"{COMMAND}: {COMMAND_REFUSALS[refusal]}")

    def describe(self) -> str:
        """Return since when and why the guard flies, for people; empty if it does not."""
        memory = self.memory
        found = described(memory.mode, memory.reason, memory.since)
        topics: dict[int, str] = {GuardReason.WRENCH_LOST: f"{COMMAND}:", GuardReason.STATE_LOST: "state:"}
        topic = topics.get(memory.reason)
        if found and topic and self.last_refusal.startswith(topic):
            found += f", the last one was refused: {self.last_refusal}"
        return found

    def _tell(self, step: int, status: GuardStatus) -> None:
        """Publish what changed, and ten times a second what is."""
        found = (status.mode, status.reason, bool(self.last_refusal))
        if found[:2] != self._said[:2]:
            self._tell_mode(step, status)
        commanders = self._period_of()
        if found == self._said and step < self._due and not (commanders and (step + 1) % commanders == 0):
            return
        self._said = found
        self._due = step + max(1, _STATUS_PERIOD // self._period)
        message = GuardStatusMsg(
            step=step,
            reason_text=REASONS[status.reason],
            refusal=self.last_refusal,
            run=self._node.run,
            **status._replace(refused_commands=status.refused_commands + self._dropped)._asdict(),
        )
        set_stamp(message.stamp, step * self._period)
        self._status_out.publish(message)

    def _tell_refusal(self, step: int, text: str) -> None:
        """Report a refusal, the same one at most once a second: two that take turns must not flood the log."""
        self.last_refusal = text
        if step < self._reported.get(text, 0):
            self._node.counters["guard_refused"] += 1
            return
        self._reported[text] = step + NANOSECONDS // self._period
        stamp = step * self._period
        self._node.event(FlightEvent.WARNING, "guard_refused", f"step {step}: {text}; dropped", stamp, always=True)

    def _tell_mode(self, step: int, status: GuardStatus) -> None:
        stamp, reason = step * self._period, REASONS[status.reason]
        if status.reason == GuardReason.REQUESTED and self.asked_because:
            reason = self.asked_because
        if status.mode == GuardMode.KILL:
            self._node.event(FlightEvent.ERROR, "guard_killed", f"step {step}: {reason}; {self.killed}", stamp)
        elif status.mode == GuardMode.PASS:
            text = f"step {step}: {'the guard rests' if status is _RESTING else 'the controller flies again'}"
            self._node.event(FlightEvent.WARNING, "guard_released", text, stamp, always=True)
        else:
            ages = f"wrench {status.command_age:.3f} s, state {status.state_age:.3f} s old"
            text = f"step {step}: {reason} ({ages}); the backup law descends"
            self._node.event(FlightEvent.WARNING, "guard_descends", text, stamp, always=True)


class VehicleNode(FlightNode):
    """Leads a flight: starts it when all nodes are ready, and ends it for all of them.

    ``command``: the newest wrench that may be flown; it came at ``command_at``, in s of the steady clock. While
    ``armed`` is false the guard rests and the rotors get nothing. ``gives_up``: only the guard flies on, and of a
    commander's requests only KILL counts. ``unrecorded``: the recorder was given up.
    ``suspect``: the node that caused the last guard takeover. ``stood_still``: text, how long this process was late.
    """

    def __init__(self, role: str) -> None:
        """Subscribe to the command and to the other nodes; raises as FlightNode."""
        super().__init__(role)
        self.handshake = Handshake(self.flight, interface_hash(), [name for name in self.roles if name != self.role])
        self.phase = FlightState.WAITING
        self.end_step, self.recorded_step = 0, -1
        self.command: Stamped | None = None
        self.command_at = self.asked_at = self.begun_at = 0.0
        self.missed_commands = 0
        self.armed = True
        limits = self.resolved.node.guard._replace(has_commander=self.commanded)
        if self.commanded and not limits.enabled:
            raise ParameterError("guard.enabled: found false, expected true: a commander reads what the guard reports")
        self.guard = VehicleGuard(self, limits, lambda: self.handshake.period(COMMANDER) if self.commanded else 0)
        self.cause = self.suspect = self.stood_still = ""
        self.gives_up = self.unrecorded = False
        self.estimator = "the estimator"
        self._reason = ""
        self._accepted_step = self._heard_step = -1
        self._leave_by = 0.0
        self._latencies: list[float] = []
        self._flight_state = self.publisher("flight/state")
        self.link = CommandLink(self, self._on_mode, self.starter) if self.commanded else None
        self.input_watch = InputWatch(self, self.handshake.period, self.clock)
        self.subscribe(COMMAND, self._on_wrench, raw=True)
        self.subscribe("flight/plan", self._on_plan)
        self.subscribe("flight/nodes", self._on_node, depth=64)
        self.subscribe("flight/recorded", self._on_recorded)

    def output(self, topic: str) -> tuple[Publisher, Packer]:
        """Return a publisher of a topic of every step and what packs its messages."""
        kind = SIGNALS[topic].kind
        return self.publisher(topic), packer(kind, message_type(kind), self.run)

    def clock(self) -> float:
        """Return the s by which the flight is watched: the steady clock, unless the vehicle's owner halts time."""
        return time.monotonic()

    def begin(self) -> None:
        """Start the flight: all nodes are ready."""
        raise NotImplementedError

    def prepare(self) -> list[str]:
        """Make the vehicle ready, all nodes being so; return what the flight still waits for."""
        return []

    def progress(self) -> None:
        """Go on where the flight may have waited: a command, the plan or an acknowledgement has come."""

    def on_plan(self, end_step: int) -> None:
        """Prepare for a flight that ends at ``end_step``."""

    def watch(self) -> None:
        """Look after a flight under way, 20 times a second."""

    def on_given_up(self) -> None:
        """Go on without commands: the flight was given up, and the guard brings the vehicle down."""

    @property
    def elapsed_ns(self) -> int:
        """Flight time of the current step in ns."""
        return self.current_step * self.flight.plant_period

    def end(self, phase: int, reason: str) -> None:
        """End the flight, once; ``phase``: FlightState.ENDED or FAILED."""
        if self.over:
            return
        self.phase, self._reason = phase, reason
        self.flying, self.over = False, True
        self.exit_code = 0 if phase == FlightState.ENDED else 1
        if reason:
            self.event(FlightEvent.ERROR, "flight_failed", reason, self.elapsed_ns)
        self.publish_flight_state()
        self.publish_diagnostics()
        self._leave_by = time.monotonic() + (
            self.flight.silence_timeout if self._is_recorded() else _UNRECORDED_PATIENCE
        )
        self._leave_when_recorded()

    def guarded(self, command: WrenchCommand, sample: StateSample, step: int | None = None) -> Wrench:
        """Return the wrench for the rotors over ``step``: ``command``'s, the backup law's, or none.

        ``step``: None is the current one; ``command`` and ``sample``: the newest, the state as it was published.
        """
        if self.link is not None and not self.gives_up:
            self.armed = self.link.armed
        step = self.current_step if step is None else step
        if not self.armed:
            self.guard.rest(step)
            return Wrench()
        request = self.link.mode.value.guard_request if self.link is not None else GuardRequest.NONE
        if self.gives_up and request != GuardRequest.KILL:
            request = GuardRequest.DESCEND
        flown = self.guard.step(step, command, sample, request)
        if self.guard.taken_over and self.guard.memory.since == step:
            self.suspect = self._culprit() or self.suspect
            if not self.commanded:
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
            self.event(FlightEvent.ERROR, "given_up", f"{cause}; the guard lands the vehicle", self.elapsed_ns)
            self.on_given_up()

    def on_signal(self, name: str) -> bool:
        """Return whether the vehicle comes down before this process leaves: in real time, or by a commander."""
        comes_down = self.commanded or (not self.lockstep and self.guard.parameters.enabled and self.armed)
        if self.phase != FlightState.FLYING or not comes_down:
            return False
        self.asked_to_end = name
        return True

    def note_pause(self, late: float) -> None:
        """Note in ``stood_still`` that this process came ``late`` s too late, unless that is next to nothing."""
        self.stood_still = f"{self.role} stood still for {late:.2f} s" if late > _STOOD_STILL else ""

    def _culprit(self) -> str:
        """Return who or what made the guard take over, empty if it was the flight itself."""
        reason = self.guard.memory.reason
        if reason not in (GuardReason.STATE_LOST, GuardReason.WRENCH_LOST):
            return ""
        if self.stood_still:
            return self.stood_still
        if reason == GuardReason.STATE_LOST:
            return f"state: nothing good from {self.estimator}"
        if seconds(self.current_step - self._heard_step, self.flight.plant_period) <= _HEARD:
            return f"{COMMAND} arrives, but no good one reaches the rotors"
        planned = self.commanded or self.end_step > 0  # in real time the mode of a step is often still on its way
        return self.handshake.blame(self.current_step, self.recorded_step, False, planned)

    def blame(self) -> str:
        """Return why the current step cannot go on: the node whose last step is behind, or a missing topic."""
        answered = self.command is not None and self.command.step == self.current_step
        planned = self.link.holds(self.current_step) if self.link else self.end_step > 0
        missing = self.handshake.blame(self.current_step, self.recorded_step, answered, planned)
        return self.handshake.behind(self.current_step) or missing

    def waits_for(self) -> list[str]:
        """Return what must come before the flight begins."""
        return [f"flight/nodes READY of {role}" for role in self.handshake.missing()] + self.missing_links()

    def publish_flight_state(self) -> None:
        """Publish phase, step and reason."""
        missing = ", ".join(self.handshake.missing() or self.prepare()) if self.phase == FlightState.WAITING else ""
        message = FlightState(
            step=self.current_step,
            end_step=self.end_step,
            state=self.phase,
            reason=f"waiting for {missing}{self.handshake.foreign_nodes()}" if missing else self._reason,
            run=self.run,
            interface_hash=interface_hash(),
            wall_time=time.monotonic() - self.begun_at if self.begun_at else 0.0,
        )
        set_stamp(message.stamp, self.elapsed_ns)
        self._flight_state.publish(message)

    def on_tick(self) -> None:
        """Watch the start, the flight, the end."""
        now = time.monotonic()
        if self.phase == FlightState.WAITING:
            missing = self.handshake.missing() + self.missing_links() or self.prepare()
            if not missing:
                self.phase, self.flying, self.begun_at = FlightState.FLYING, True, now
                self.log.info("flying")
                self.publish_flight_state()
                self.begin()
            elif self.starter.is_gone():
                self.end(FlightState.FAILED, STARTER_GONE)
            elif now - self.started > self.flight.start_timeout:
                late = f"not ready after {self.flight.start_timeout:g} s: {', '.join(missing)}"
                self.end(FlightState.FAILED, late + self.handshake.foreign_nodes())
        elif self.phase == FlightState.FLYING:
            if self.link is not None:
                self.link.pass_on(self.asked_to_end)
            elif self.asked_to_end:
                self.give_up(f"{self.role} stopped by {self.asked_to_end}")
            if (silent := self.input_watch.silent()) and (self.commanded or self.guard.parameters.enabled):
                self.give_up(silent)
            self.watch()
        elif now > self._leave_by or (RECORDER in self.roles and not self._is_recorded()):
            late = "recorder did not finish in time" if RECORDER in self.roles else "flight ended"
            self.finish(self.exit_code, self._reason or late)
        if self._ticks % _STATE_EVERY == 0:
            self.publish_flight_state()

    def _is_recorded(self) -> bool:
        return RECORDER in self.roles and not self.unrecorded and self.ros.count_publishers("flight/recorded") > 0

    def on_interrupt(self, name: str) -> None:
        """Tell the others that the flight is over."""
        self.end(FlightState.FAILED, f"{self.role} stopped by {name}")
        self.exit_code = 1

    def measurements(self) -> dict[str, float]:
        """Return commands missed, and state-to-command latency in ms since the last report."""
        taken, self._latencies = sorted(self._latencies), []
        shares = (("p50", 0.5), ("p99", 0.99), ("max", 1.0)) if taken else ()
        found = {f"latency_{name}": round(1e3 * taken[round(share * (len(taken) - 1))], 4) for name, share in shares}
        return {"missed_commands": self.missed_commands, **found}

    def _on_node(self, message: NodeStatus) -> None:
        problem = self.handshake.on_status(message)
        flies = self.link is not None and self.link.armed and self.phase != FlightState.WAITING
        if problem and flies and message.role in (TRAJECTORY, RECORDER):
            self.event(FlightEvent.WARNING, "node_failed", problem)  # neither is needed to land
            if message.role == RECORDER:
                self.unrecorded = True
                self.progress()
        elif problem and not self.over:
            self.event(FlightEvent.ERROR, "handshake", problem)
            self.give_up(problem)
        if self.over:
            self._leave_when_recorded()

    def _on_mode(self) -> None:
        self.input_watch.note("flight/mode")
        self.progress()

    def _on_plan(self, message: FlightPlan) -> None:
        if self.is_foreign("flight/plan", message.run):
            return
        refusal = plan_refusal(message.end_step, self.end_step, self.flight.plant_period)
        if refusal:
            self.reject("flight/plan", refusal, self.elapsed_ns, "rejected_plan")
        elif not (self.end_step or self.commanded):
            self.end_step = message.end_step
            self.on_plan(self.end_step)
        self.progress()

    def _on_recorded(self, message: RecorderAck) -> None:
        if self.is_foreign("flight/recorded", message.run):
            return
        if message.step > self.current_step:  # accepted, it would let the plant run away from its recorder
            self.reject("flight/recorded", f"step {message.step} is not flown yet", self.elapsed_ns, "rejected_future")
        else:
            self.recorded_step = max(self.recorded_step, message.step)
            self.progress()

    def _on_wrench(self, payload: bytes) -> None:
        try:
            found = unpack_wrench(payload, self.flight.plant_period)
        except UNUSABLE as error:
            self.unusable(COMMAND, payload, error)
            return
        self._heard_step = self.current_step
        if not found.finite:
            self.guard.last_refusal = f"{COMMAND}: a number that is not finite"
            self.reject(COMMAND, "a number that is not finite", found.stamp_ns)
        elif self._is_welcome(found):
            self.command, self.command_at = found, time.monotonic()
            if found.step == self.current_step:
                self._latencies.append(self.command_at - self.asked_at)
            self.progress()

    def _is_welcome(self, found: Stamped) -> bool:
        """Return whether a wrench may replace the last one: a rejected one must not hide a good one."""
        if self.phase != FlightState.FLYING:
            return False
        if self.lockstep:  # size is left to the guard alone, as in the loop without ROS
            return found.stamp_ns == self.elapsed_ns
        limits, period = self.guard.parameters.command, self.flight.plant_period
        if found.stamp_ns % period:
            text = f"stamp {found.stamp_ns} ns, expected a multiple of {period} ns"
            self.reject(COMMAND, text, self.elapsed_ns, "rejected_stamp")
            return False
        if self.guard.parameters.enabled:
            arrived = WrenchCommand(found.value, found.step, True)
            refusal = command_refusal(limits, self.vehicle, arrived, self._accepted_step, self.current_step, period)
            if refusal != CommandRefusal.ACCEPTED:
                self.guard.refused(self.current_step, refusal)
                return False
            self._accepted_step = found.step
        return True

    def _leave_when_recorded(self) -> None:
        recorder = self.handshake.known.get(RECORDER)
        if recorder is not None and recorder.state == NodeState.DONE:
            self.finish(self.exit_code, self._reason)
        elif recorder is not None and recorder.state == NodeState.FAULT:
            self.finish(1, f"recorder failed: {recorder.detail}")
