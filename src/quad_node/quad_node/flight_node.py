"""What all nodes of a flight have: parameters, links, an event log, a status, a watch on the flight, an end.

A node is a class that makes a ``FlightNode`` and hands it what it does when:

    configure    its constructor: parameters, parts, subscriptions
    activate     all endpoints are matched; where it owns the vehicle: all nodes are ready, the flight begins
    step         what it does at a step of the flight; ``Responder`` calls it with a state, or a clock of its own does
    deactivate   the flight has ended; where it owns the vehicle: a signal asks for the end
    shut_down    last: it releases what it holds

Subscribes: flight/state (FlightState), except in the node that owns the vehicle.
Publishes: flight/nodes (NodeStatus), flight/events (FlightEvent), flight/parameters (NodeParameters), diagnostics.
"""

import math
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.task import Future
from rclpy.timer import Timer

from quad_core.cascade import COMMANDER, RECORDER, SHADOWS, SIMULATOR, VEHICLE_INTERFACES
from quad_core.enumerations import FlightClock, NodeState
from quad_core.parameter_files import dump_yaml
from quad_core.parameters import Value
from quad_core.resolution import Resolved
from quad_msgs.msg import FlightState, NodeParameters, NodeStatus
from quad_node import parameters, topics
from quad_node.event_log import EventLog
from quad_node.executor import STARTER_GONE, Starter
from quad_node.handshake import interface_hash, is_foreign, run_number, versions
from quad_node.topics import Links

OPERATORS, ALL_SIGNALS = ("SIGINT", "SIGHUP"), ("SIGINT", "SIGHUP", "SIGTERM")
_HOUSEKEEPING = 0.05
_DIAGNOSTICS_EVERY = 20
_EAGER, _LINKS_EVERY, _STALL_EVERY = 100, 5, 5
_LONG_GAP = 0.2  # s between two ticks
_FIRST_WAIT = 2.0  # s without a link after which waiting is worth a line: nodes find each other within one
_ORPHANED = 2.0  # s without flight/state after which a node looks whether anybody still looks after it
_SILENT_LEAVES = 0.5  # s for the last messages of a node that took no part
_NEXT_WAIT = 10.0  # s between two lines of waiting


def nothing(*_: Any) -> None:
    """Do nothing: for a node that has nothing to do then."""


class FlightNode:
    """One role in a flight. ``ros`` is its ROS node; ``over``: the flight has ended, or never began.

    ``done`` completes when the node has nothing more to do; see ``exit_code``. ``slept``: the s by which a tick came
    late because this process stood still, 0 if it was in time; what the process missed is still to be read.
    ``outlived``: signals after which it stays while it flies, because the vehicle has to come down first; the first one
    is in ``asked_to_end``. ``measures``: functions that give further numbers for diagnostics. ``next_step`` gives the
    first plant step for which the present parameters hold, ``waits_for`` what must come before the flight. ``began``: s
    of the steady clock at which flight/state says that the flight began, inf: not yet, None: it has said nothing.
    """

    def __init__(
        self,
        role: str,
        *,
        activate: Callable[[], None] = nothing,
        watch: Callable[[], None] = nothing,
        deactivate: Callable[[FlightState], None] | None = None,
        shut_down: Callable[[], None] = nothing,
        needs: Callable[[], list[str]] = list,
    ) -> None:
        """Read and declare parameters; raises ParameterError or PluginError if they cannot be accepted.

        ``watch`` is called 20 times a second on the steady clock; without ``deactivate`` the node leaves when the
        flight has ended. ``needs``: what the node itself still lacks before it is ready.
        """
        self.ros = Node(role, automatically_declare_parameters_from_overrides=True)
        self.name, self.log = self.ros.get_fully_qualified_name(), self.ros.get_logger()
        # A controller whose node is named shadow_<role> answers in parallel to the one that flies.
        self.shadow = self.ros.get_name() in SHADOWS
        kind = self.ros.get_name() if self.shadow else role
        # A vehicle interface has parameters of its own and the simulator's role.
        self.role = SIMULATOR if kind in VEHICLE_INTERFACES else kind
        self.resolved: Resolved = parameters.resolve_overrides(self.ros, kind)
        parameters.declare(self.ros, self.resolved)
        parameters.on_change(self.ros, kind, self._on_parameters)
        self.flight, self.vehicle, self.settings = self.resolved.flight, self.resolved.vehicle, self.resolved.node
        self.run = run_number(self.flight.run_id)
        self.roles = self.flight.role_names
        self.lockstep, self.commanded = self.flight.mode == FlightClock.LOCKSTEP, COMMANDER in self.roles
        self.period_steps = int(getattr(self.settings, "period_steps", 1))  # plant steps between two answers
        self.exit_code, self.asked_to_end = 1, ""
        self.outlived: tuple[str, ...] = OPERATORS if self.commanded else ()
        self.done: Future = Future()
        self.starter = Starter()
        self.internals_names: list[str] = []
        self.measures: list[Callable[[], dict[str, Any]]] = []
        self.next_step: Callable[[], int] = lambda: 0
        self.waits_for: Callable[[], list[str]] = self._waits_for
        self.current_step = self._last_step = self._ticks = 0
        self.flying = self.over = False
        self.started = self.last_heard = self._ticked_at = time.monotonic()
        self.slept, self.ready_at = 0.0, math.inf
        self.began: float | None = None
        self._activate, self._watch, self._deactivate, self._needs = activate, watch, deactivate or self.leave, needs
        self.shut_down = shut_down
        self.links = Links(self.ros, self.roles, self.lockstep, self.shadow)
        events_out = self.links.publisher("flight/events", match=False)
        self.events = self.links.events = EventLog(self.name, self.log, events_out, self._flight_time)
        self._status_out = self.links.publisher("flight/nodes", match=False)
        self._parameters_out = self.links.publisher("flight/parameters", match=False)
        self._diagnostics_out = self.ros.create_publisher(DiagnosticArray, "diagnostics", topics.stream())
        self.status: int = NodeState.STARTING
        self._detail = ""
        self.publish_status("")
        self.publish_parameters()
        if self.role != SIMULATOR:
            self.links.subscribe("flight/state", self._on_flight_state)
        self.every(_HOUSEKEEPING, self._tick)

    def every(self, period: float, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` every ``period`` s of the steady clock until the timer is cancelled."""
        return self.ros.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def priority(self) -> int:
        """SCHED_FIFO priority of this process: none (0) in lockstep, the lowest for recorder and shadows.

        A node that does not answer every step is one below those that do.
        """
        own = self.flight.realtime_priority
        slower = 1 if self.in_background else own - (self.period_steps > 1)
        return 0 if self.lockstep else min(own, max(slower, 1))

    @property
    def in_background(self) -> bool:
        """Whether no other node waits for this one at every step."""
        return self.shadow or self.role == RECORDER

    def introduce(self, seen_by: str) -> None:
        """Print role, run, clock and ``seen_by``, the line on visibility."""
        clock = "lockstep" if self.lockstep else "real time"
        self.log.info(f"starting: {self.role}, run {self.flight.run_id or 'not named'}, {clock}; {seen_by}")

    def publish_status(self, detail: str) -> None:
        """Publish who this node is and how it is."""
        self._detail = detail
        self._status_out.publish(
            NodeStatus(
                node=self.name,
                role=self.role,
                run_id=self.flight.run_id,
                interface_hash=interface_hash(),
                state=self.status,
                step=self.current_step,
                period_steps=self.period_steps,
                plant_period=self.flight.plant_period,
                detail=detail,
            )
        )

    def publish_parameters(self) -> None:
        """Publish all resolved parameters as a parameter file."""
        content = {self.name: {"ros__parameters": parameters.current_values(self.ros)}}
        self._parameters_out.publish(
            NodeParameters(
                node=self.name,
                role=self.role,
                parameters=dump_yaml(content, sort_keys=True),
                versions=dump_yaml(versions(), sort_keys=True),
                internals_names=self.internals_names,
                step=self.next_step(),
            )
        )

    def is_foreign(self, topic: str, run: int) -> bool:
        """Return whether a message with run number ``run`` is of another run; that is counted and reported."""
        foreign = is_foreign(run, self.run)
        if foreign:
            self.events.foreign(topic)
        return foreign

    def missing(self) -> list[str]:
        """Return what the node lacks before it is ready: links, and what it needs besides."""
        return list(dict.fromkeys([*self.links.missing(), *self._needs()]))

    def _flight_time(self) -> int:
        """Return the time in ns of the step that this node is at, 0 before and after the flight."""
        return self.current_step * self.flight.plant_period if self.flying else 0

    def finish(self, exit_code: int, detail: str) -> None:
        """End this node's work; the process leaves with ``exit_code``."""
        if not self.done.done():
            self.exit_code = exit_code
            if exit_code:
                self.log.error(f"ended with exit code {exit_code}: {detail}")
            else:
                self.log.info(f"ended: {detail or 'flown as planned'}")
            self.status = NodeState.DONE if exit_code == 0 else NodeState.FAULT
            self.publish_status(detail)
            self.done.set_result(None)

    def leave(self, ended: FlightState) -> None:
        """Finish with the outcome of the flight."""
        self.finish(1 if ended.state == FlightState.FAILED else 0, ended.reason or "flight ended")

    def outlives(self, signal: str) -> bool:
        """Return whether this node goes on after the first signal; ``asked_to_end`` tells others of it."""
        if not (self.flying and signal in self.outlived):
            return False
        self.asked_to_end = signal
        return True

    def interrupt(self, signal: str) -> None:
        """React to a signal that ends this node: it can still publish."""
        reason = f"{self.role} stopped by {signal}"
        if self.role == SIMULATOR:
            self._deactivate(FlightState(state=FlightState.FAILED, step=self.current_step, reason=reason))
        else:
            self.events.info("interrupted", reason)

    def drain(self, patience: float) -> None:
        """Wait at most ``patience`` s until subscribers have what was sent: a process that leaves takes it along."""
        # no node waits for one that stayed silent, and those that it would wait for have left
        self.links.drain(min(patience, _SILENT_LEAVES) if self.events.counts["came_late"] else patience)

    def _on_parameters(self, resolved: Resolved, changes: dict[str, Value]) -> None:
        self.resolved = resolved
        self.publish_parameters()
        text = ", ".join(f"{name} = {value}" for name, value in changes.items())
        self.events.info("parameter_set", text, always=True)

    def _on_flight_state(self, message: FlightState) -> None:
        if self.is_foreign("flight/state", message.run):
            return
        self.last_heard = time.monotonic()
        self.flying = message.state == FlightState.FLYING
        # a latched message may have been sent long before
        began = self.last_heard - message.wall_time if self.flying else math.inf
        self.began = began if self.began is None else min(self.began, began)
        if self.flying:
            self.log.info("flying", once=True)
        if message.state in (FlightState.ENDED, FlightState.FAILED):
            self.over = True
            self._deactivate(message)

    def _tick(self) -> None:
        """Keep house: links, the flight, what the node itself watches, diagnostics."""
        self._ticks += 1
        now = time.monotonic()
        gap = now - self._ticked_at
        self.slept = gap - _HOUSEKEEPING if gap > _LONG_GAP else 0.0
        self._ticked_at = now
        # Asking for every link costs; a node that has waited for seconds asks less often.
        looks = self._ticks < _EAGER or self._ticks % _LINKS_EVERY == 0
        if self.status == NodeState.STARTING and looks and not self.missing():
            self.status, self.ready_at = NodeState.READY, now  # noted before it is sent: the flight may begin at once
            self.publish_status("ready")
            if self.role != SIMULATOR:
                self._activate()
        if looks and now - self.started > _FIRST_WAIT and not (self.flying or self.over or self.done.done()):
            self.log.info(f"waiting for {', '.join(self.waits_for())}", throttle_duration_sec=_NEXT_WAIT)
        if self._ticks % _STALL_EVERY == 0:
            if self.flying and self.lockstep and self.current_step == self._last_step:
                self.publish_status(self._detail)  # the flight stands still: the vehicle's node names who is behind
            self._last_step = self.current_step
        self._watch()
        if self.role != SIMULATOR:
            self._watch_flight(now)
        if self._ticks % _DIAGNOSTICS_EVERY == 0:
            self.publish_diagnostics()
            if self.flying and (others := self.links.second_senders()):
                self.events.warn("second_publisher", f"expected {'; '.join(others)}")

    def _waits_for(self) -> list[str]:
        missing = self.missing() if self.status == NodeState.STARTING else []
        return missing or ["flight/state FLYING of simulator"]

    def _watch_flight(self, now: float) -> None:
        quiet = now - self.last_heard - self.slept
        if self.flying and quiet > self.flight.silence_timeout:
            self.events.error("simulator_lost", f"flight/state: nothing from the vehicle interface for {quiet:.1f} s")
            self.finish(1, "flight/state: the vehicle interface is silent")
        elif self.flying or self.over or self.done.done():
            return
        elif quiet > _ORPHANED and self.starter.is_gone():  # and the vehicle's node, which would have said so
            self.finish(1, STARTER_GONE)
        elif quiet > self.flight.start_timeout:
            text = f"no flight after {quiet:.1f} s; waiting for {', '.join(self.waits_for())}"
            self.events.error("start_timeout", text)
            self.finish(1, text)

    def publish_diagnostics(self) -> None:
        """Publish counts and measurements on diagnostics."""
        waiting = self.status != NodeState.READY
        level = DiagnosticStatus.WARN if waiting or self.events.counts["rejected"] else DiagnosticStatus.OK
        values = {"step": self.current_step, **self.events.counts}
        for measure in self.measures:
            values.update(measure())
        status = DiagnosticStatus(
            level=level,
            name=f"{self.ros.get_name()}: flight",
            message="waiting" if waiting else "ok",
            hardware_id=self.name,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.ros.get_clock().now().to_msg()
        self._diagnostics_out.publish(message)
