"""What all nodes of a flight share: parameters, handshake, events, diagnostics, watchdogs, the end.

Subscribes: flight/state (FlightState), except in the node that owns the vehicle.
Publishes: flight/nodes (NodeStatus), flight/events (FlightEvent), flight/parameters (NodeParameters), diagnostics.
"""

import time
from collections import Counter
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.timer import Timer

from quad_core.cascade import COMMANDER, OWNERS, RECORDER, SHADOWS, SIMULATOR
from quad_core.enumerations import FlightClock, NodeState
from quad_core.parameter_files import dump_yaml
from quad_core.parameters import Value
from quad_core.resolution import Resolved
from quad_msgs.msg import FlightEvent, FlightState, NodeParameters, NodeStatus
from quad_node import links, parameters, topics
from quad_node.codec import ForeignRunError
from quad_node.conversion import set_stamp
from quad_node.handshake import is_foreign, run_number
from quad_node.interface import interface_hash, versions
from quad_node.starter import STARTER_GONE, Starter

_HOUSEKEEPING = 0.05
_DIAGNOSTICS_EVERY = 20
_EAGER, _LINKS_EVERY, _STALL_EVERY = 100, 5, 5
_STOOD_STILL = 0.2  # s between two ticks
_FIRST_WAIT = 2.0  # s without a link after which waiting is worth a line: nodes find each other within one
_ORPHANED = 2.0  # s without flight/state after which a node looks whether anybody still looks after it
_SILENT_LEAVES = 0.5  # s for the last messages of a node that took no part
_NEXT_WAIT = 10.0  # s between two lines of waiting


class FlightNode:
    """One role in a flight. ``ros`` is its ROS node; ``over``: the flight has ended, or never began.

    ``done`` completes when the node has nothing more to do; see ``exit_code``. ``slept``: the s by which a tick came
    late because this process stood still, 0 if it was in time; what the process missed is still to be read.
    """

    def __init__(self, role: str) -> None:
        """Read and declare parameters; raises ParameterError or PluginError if they cannot be accepted."""
        self.ros = Node(role, automatically_declare_parameters_from_overrides=True)
        self.name, self.log = self.ros.get_fully_qualified_name(), self.ros.get_logger()
        # A controller whose node is named shadow_<role> answers in parallel to the one that flies.
        self.shadow = self.ros.get_name() in SHADOWS
        kind = self.ros.get_name() if self.shadow else role
        # Who owns another vehicle than the simulated one has parameters of its own and the simulator's role.
        self.role = role = SIMULATOR if kind in OWNERS else kind
        self.resolved: Resolved = parameters.resolve_overrides(self.ros, kind)
        parameters.declare(self.ros, self.resolved)
        parameters.on_change(self.ros, kind, self._on_parameters)
        self.flight = self.resolved.flight
        self.run = run_number(self.flight.run_id)
        self.vehicle = self.resolved.vehicle
        self.roles = self.flight.role_names
        self.lockstep = self.flight.mode == FlightClock.LOCKSTEP
        self.exit_code, self.asked_to_end = 1, ""
        self.done: Future = Future()
        self.starter = Starter()
        self.internals_names: list[str] = []
        self.counters: Counter[str] = Counter()
        self.current_step = self._last_step = self._ticks = 0
        self.flying = self.over = False
        self.commanded = COMMANDER in self.roles
        self.started = self.last_heard = self._ticked_at = time.monotonic()
        self.slept = 0.0
        self._last_reported: dict[str, float] = {}
        self._out: list[tuple[Publisher, int, str]] = []
        self._in: dict[str, tuple[Subscription, str]] = {}
        self._detail = ""
        self._status_out = self.publisher("flight/nodes", match=False)
        self._events_out = self.publisher("flight/events", match=False)
        self._parameters_out = self.publisher("flight/parameters", match=False)
        self._diagnostics_out = self.ros.create_publisher(DiagnosticArray, "diagnostics", topics.stream())
        self.status: int = NodeState.STARTING
        self.publish_status("")
        self.publish_parameters()
        if role != SIMULATOR:
            self.subscribe("flight/state", self._on_flight_state)
        self.every(_HOUSEKEEPING, self._housekeeping)

    def every(self, period: float, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` every ``period`` s of the steady clock until the timer is cancelled."""
        return self.ros.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def publisher(self, topic: str, match: bool = True) -> Publisher:
        """Return a publisher of a topic, of a shadow's own for an answer; READY waits for subscribers if ``match``."""
        aside = self.shadow and topics.TOPICS[topic].step
        entry = topics.TOPICS[topics.SHADOW_TOPICS + topic if aside else topic]
        publisher = self.ros.create_publisher(entry.type, entry.wire, entry.qos(entry.history(self.lockstep)))
        readers = entry.subscribers_of(self.roles) if match else []
        self._out.append((publisher, len(readers), ", ".join(readers)))
        return publisher

    def subscribe(self, topic: str, callback: Any, depth: int = 10, raw: bool = False) -> Any:
        """Subscribe to a topic of the table and return it; READY waits for the publishers of a required one."""
        entry = topics.TOPICS[topic]
        if self.shadow:
            depth = max(depth, entry.history(self.lockstep))
        qos, watched = entry.qos(depth, keep_all=self.lockstep), links.qos_events(self.event, entry.name)
        subscription = self.ros.create_subscription(
            entry.type, entry.wire, callback, qos, raw=raw, event_callbacks=watched
        )
        sources = [role for role in entry.publishers if role in self.roles]
        if entry.required and entry.exists(self.roles) and sources:
            self._in[entry.wire] = subscription, " or ".join(sources)
        return subscription

    @property
    def period_steps(self) -> int:
        """Plant steps between two answers of this node."""
        return int(getattr(self.resolved.node, "period_steps", 1))

    @property
    def next_step(self) -> int:
        """First plant step for which the present parameters hold."""
        return 0

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

    def set_status(self, state: int, detail: str) -> None:
        """Change this node's state and publish it."""
        self.status = state
        self.publish_status(detail)

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
                step=self.next_step,
            )
        )

    def event(self, severity: int, kind: str, text: str, stamp_ns: int = 0, always: bool = False) -> None:
        """Count ``kind``; publish and log it, at most once a second for the same kind unless ``always`` or an error."""
        self.counters[kind] += 1
        now = time.monotonic()
        if not always and severity < FlightEvent.ERROR and now - self._last_reported.get(kind, -1.0) < 1.0:
            return
        self._last_reported[kind] = now
        message = FlightEvent(node=self.name, severity=severity, kind=kind, text=text)
        set_stamp(message.stamp, stamp_ns)
        self._events_out.publish(message)
        # one line for each severity: rclpy refuses to log with two severities from the same line
        if severity == FlightEvent.INFO:
            self.log.info(f"{kind}: {text}")
        elif severity == FlightEvent.WARNING:
            self.log.warning(f"{kind}: {text}")
        else:
            self.log.error(f"{kind}: {text}")

    def is_foreign(self, topic: str, run: int) -> bool:
        """Return whether a message with run number ``run`` is of another run; that is counted and reported."""
        foreign = is_foreign(run, self.run)
        if foreign:
            self.event(FlightEvent.WARNING, "foreign_run", f"{topic} of another run ignored")
        return foreign

    def reject(self, topic: str, found: str, stamp: int = 0, kind: str = "rejected_nonfinite") -> None:
        """Count and report a message that is not used; ``stamp`` in ns of the flight."""
        self.counters["rejected"] += 1
        self.event(FlightEvent.WARNING, kind, f"{topic}: {found}; message ignored", stamp)

    def unusable(self, topic: str, payload: bytes, error: Exception) -> None:
        """Count and report a payload whose reading raised ``error``, one of UNUSABLE of the codec."""
        if isinstance(error, ForeignRunError):
            self.event(FlightEvent.WARNING, "foreign_run", f"{topic} of another run ignored")
        else:
            self.reject(topic, f"a malformed message of {len(payload)} bytes ({error})", kind="rejected_malformed")

    def finish(self, exit_code: int, detail: str) -> None:
        """End this node's work; the process leaves with ``exit_code``."""
        if not self.done.done():
            self.exit_code = exit_code
            if exit_code:
                self.log.error(f"ended with exit code {exit_code}: {detail}")
            else:
                self.log.info(f"ended: {detail or 'flown as planned'}")
            self.set_status(NodeState.DONE if exit_code == 0 else NodeState.FAULT, detail)
            self.done.set_result(None)

    def on_flight_ended(self, message: FlightState) -> None:
        """React to the end of the flight; the recorder overrides this to wait for the last messages."""
        failed = message.state == FlightState.FAILED
        self.finish(1 if failed else 0, message.reason or "flight ended")

    def on_ready(self) -> None:
        """React to all endpoints being matched."""

    def on_tick(self) -> None:
        """Do periodic work, 20 times a second on the steady clock."""

    def on_signal(self, name: str) -> bool:
        """Return whether this node goes on after the first signal, because something has to come down first.

        Where a commander flies, a terminal's Ctrl-C or its end lands the vehicle, and no node leaves before.
        """
        if not (self.commanded and self.flying) or name not in ("SIGINT", "SIGHUP"):
            return False
        self.asked_to_end = name
        return True

    def on_interrupt(self, name: str) -> None:
        """React to SIGINT, SIGTERM or SIGHUP: the node still can publish."""
        self.event(FlightEvent.INFO, "interrupted", f"{self.role} stopped by {name}")

    def close(self) -> None:
        """Release what the node holds; called once, last."""

    def drain(self, patience: float) -> None:
        """Wait at most ``patience`` s until subscribers have what was sent: a process that leaves takes it along."""
        # nobody waits for one that stayed silent, and those that it would wait for have left
        deadline = time.monotonic() + (min(patience, _SILENT_LEAVES) if self.counters["came_late"] else patience)
        # who hears first that this node has left drops what it has not read of it, the reason too
        for publisher, _, _ in self._out:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def missing_links(self) -> list[str]:
        """Return the topics that are not matched with all the nodes they need, and whose part that is."""
        return links.missing(self.ros, self._out, self._in)

    def waits_for(self) -> list[str]:
        """Return what must come before this node can fly."""
        missing = self.missing_links() if self.status == NodeState.STARTING else []
        return missing or ["flight/state FLYING of simulator"]

    def _on_parameters(self, resolved: Resolved, changes: dict[str, Value]) -> None:
        self.resolved = resolved
        self.publish_parameters()
        self.event(FlightEvent.INFO, "parameter_set", ", ".join(f"{name} = {value}" for name, value in changes.items()))

    def _on_flight_state(self, message: FlightState) -> None:
        if self.is_foreign("flight/state", message.run):
            return
        self.last_heard = time.monotonic()
        self.flying = message.state == FlightState.FLYING
        if self.flying:
            self.log.info("flying", once=True)
        if message.state in (FlightState.ENDED, FlightState.FAILED):
            self.over = True
            self.on_flight_ended(message)

    def _housekeeping(self) -> None:
        self._ticks += 1
        now = time.monotonic()
        self.slept = now - self._ticked_at if now - self._ticked_at > _STOOD_STILL else 0.0
        self._ticked_at = now
        # Asking for every link costs; a node that has waited for seconds asks less often.
        look = self._ticks < _EAGER or self._ticks % _LINKS_EVERY == 0
        if self.status == NodeState.STARTING and look and not self.missing_links():
            self.set_status(NodeState.READY, "ready")
            self.on_ready()
        if look and now - self.started > _FIRST_WAIT and not (self.flying or self.over or self.done.done()):
            self.log.info(f"waiting for {', '.join(self.waits_for())}", throttle_duration_sec=_NEXT_WAIT)
        if self.role != SIMULATOR:
            self._watch_flight()
        if self._ticks % _STALL_EVERY == 0:
            if self.flying and self.lockstep and self.current_step == self._last_step:
                self.publish_status(self._detail)  # the flight stands still: the vehicle's node names who is behind
            self._last_step = self.current_step
        self.on_tick()
        if self._ticks % _DIAGNOSTICS_EVERY == 0:
            self.publish_diagnostics()
            others = links.second_senders(self.ros, self._in) if self.flying else {}
            if others:
                self.event(FlightEvent.WARNING, "second_publisher", f"expected {'; '.join(links.described(others))}")

    def _watch_flight(self) -> None:
        quiet = time.monotonic() - self.last_heard - self.slept
        if self.flying and quiet > self.flight.silence_timeout:
            self.event(
                FlightEvent.ERROR, "simulator_lost", f"flight/state: nothing from the simulator for {quiet:.1f} s"
            )
            self.finish(1, "flight/state: the simulator is silent")
        elif self.flying or self.over or self.done.done():
            return
        elif quiet > _ORPHANED and self.starter.is_gone():  # and the vehicle's node, which would have said so
            self.finish(1, STARTER_GONE)
        elif quiet > self.flight.start_timeout:
            text = f"no flight after {quiet:.1f} s; waiting for {', '.join(self.waits_for())}"
            self.event(FlightEvent.ERROR, "start_timeout", text)
            self.finish(1, text)

    def publish_diagnostics(self) -> None:
        """Publish counters and measurements on diagnostics."""
        waiting = self.status != NodeState.READY
        level = DiagnosticStatus.WARN if waiting or self.counters["rejected"] else DiagnosticStatus.OK
        values = {"step": self.current_step, **self.counters, **self.measurements()}
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

    def measurements(self) -> dict[str, Any]:
        """Return further numbers for diagnostics."""
        return {}
