"""What a vehicle interface receives: ``WrenchLink`` of the last controller, ``CommandLink`` of a commander.

``InputWatch`` watches the nodes before the last controller. With a commander that is its mode of each step. Without
one, in real time, it is how old the reference and the setpoints are: the guard sees wrenches alone, and a controller
that has lost its input goes on sending; the vehicle stays level and drifts, or brakes to the last reference
(docs/explanation/safety.md).
"""

import time
from collections.abc import Callable
from functools import partial

from rclpy.serialization import deserialize_message

from quad_core.cascade import COMMAND, COMMANDER, STAGES, TRAJECTORY
from quad_core.cycle import seconds
from quad_core.enumerations import CommandRefusal
from quad_core.types import FlightMode
from quad_guard.checks import WrenchCommand, command_refusal
from quad_msgs.msg import FlightMode as FlightModeMsg
from quad_msgs.msg import FlightRequest
from quad_node.codec import UNUSABLE, Stamped, head_of, unpack_wrench, unpacker
from quad_node.executor import STARTER_GONE
from quad_node.flight_node import FlightNode
from quad_node.vehicle_guard import VehicleGuard

_LOST = 0.5  # s: age of the commander's mode
_PERIODS = 3.0  # of a slow node that may pass all the same


class WrenchLink:
    """``newest``: the newest wrench that may be flown, which came ``at`` s of the steady clock; None before the first.

    ``asked_at``: when the state went out that it answers. ``missed``: states that no wrench answered in time.
    ``heard_step``: step of the plant at which a wrench of any quality came last.
    """

    def __init__(self, node: FlightNode, guard: VehicleGuard, progress: Callable[[], None]) -> None:
        """Receive for ``node`` what ``guard`` may let through; ``progress`` is called when a wrench has come."""
        self.newest: Stamped | None = None
        self.at = self.asked_at = 0.0
        self.missed, self.heard_step = 0, -1
        self._node, self._guard, self._progress, self._period = node, guard, progress, node.flight.plant_period
        self._accepted_step = -1
        self._latencies: list[float] = []
        node.measures.append(self._measured)
        node.links.subscribe(COMMAND, self._on_wrench, raw=True)

    def answers(self, step: int) -> bool:
        """Return whether the newest wrench answers the state of ``step``."""
        return self.newest is not None and self.newest.step == step

    def _on_wrench(self, payload: bytes) -> None:
        node = self._node
        try:
            found = unpack_wrench(payload, self._period)
        except UNUSABLE as error:
            node.events.unusable(COMMAND, payload, error)
            return
        step = self.heard_step = node.current_step
        if not found.finite:
            self._guard.note_refusal(step, f"{COMMAND}: a number that is not finite")
            node.events.reject(COMMAND, "a number that is not finite", found.stamp_ns)
        elif node.flying and self._is_welcome(found, step):
            self.newest, self.at = found, time.monotonic()
            if found.step == step:
                self._latencies.append(self.at - self.asked_at)
            self._progress()

    def _is_welcome(self, found: Stamped, step: int) -> bool:
        """Return whether a wrench may replace the last one: a rejected one must not hide a good one."""
        node, limits, period = self._node, self._guard.parameters, self._period
        if node.lockstep:  # size is left to the guard alone, as in the loop without ROS
            return found.stamp_ns == step * period
        if found.stamp_ns % period:
            text = f"stamp {found.stamp_ns} ns, expected a multiple of {period} ns"
            node.events.reject(COMMAND, text, step * period, "rejected_stamp")
            return False
        if limits.enabled:
            arrived = WrenchCommand(found.value, found.step, True)
            refusal = command_refusal(limits.command, node.vehicle, arrived, self._accepted_step, step, period)
            if refusal != CommandRefusal.ACCEPTED:
                self._guard.refused(step, refusal)
                return False
            self._accepted_step = found.step
        return True

    def _measured(self) -> dict[str, float]:
        """Return commands missed, and state-to-command latency in ms since the last report."""
        taken, self._latencies = sorted(self._latencies), []
        shares = (("p50", 0.5), ("p99", 0.99), ("max", 1.0)) if taken else ()
        found = {f"latency_{name}": round(1e3 * taken[round(share * (len(taken) - 1))], 4) for name, share in shares}
        return {"missed_commands": self.missed, **found}


class CommandLink:
    """The newest `flight/mode`, and `flight/request` to end."""

    def __init__(self, node: FlightNode, progress: Callable[[], None]) -> None:
        """Take part as ``node``; ``progress`` is called when a mode has come."""
        self.mode = Stamped(-1, -1, 0, FlightMode(), True)  # disarmed
        self.outcome, self._newest = "", b""
        self._node, self._progress = node, progress
        self._unpack = unpacker(FlightMode, FlightModeMsg, run=node.run)
        self._passed_on = False
        self._requests = node.links.publisher("flight/request")
        node.links.subscribe("flight/mode", self._on_mode, raw=True)

    def holds(self, step: int) -> bool:
        """Return whether the mode of ``step`` is known."""
        return self.mode.step <= step < self.mode.next_step

    @property
    def armed(self) -> bool:
        """Whether the mode lets the motors turn."""
        return self.mode.value.mode not in (FlightModeMsg.DISARMED, FlightModeMsg.ARMING, FlightModeMsg.PILOT)

    @property
    def is_over(self) -> bool:
        """Whether the commander says that the flight may end."""
        return bool(self.mode.value.is_over)

    @property
    def answer_text(self) -> str:
        """Why a request was refused or, while arming, what the commander still waits for; empty if nothing."""
        return deserialize_message(self._newest, FlightModeMsg).answer_text if self._newest else ""

    def pass_on(self, asked_to_end: str) -> None:
        """Ask the commander for the end if ``asked_to_end`` says why, or if who started the flight is gone."""
        why = f"{self._node.role} was asked to end by {asked_to_end}" if asked_to_end else ""
        if not why and self._node.starter.is_gone():
            why = STARTER_GONE
        if why and not self._passed_on:
            self._passed_on = True
            self._requests.publish(FlightRequest(request=FlightRequest.END, run=self._node.run, sender=why))

    def _on_mode(self, payload: bytes) -> None:
        try:
            stamped = self._unpack(payload)
            self.outcome = deserialize_message(payload, FlightModeMsg).outcome if stamped.value.is_over else ""
        except UNUSABLE as error:
            self._node.events.unusable("flight/mode", payload, error)
            return
        self.mode, self._newest = stamped, payload
        self._progress()


class InputWatch:
    """Which node is silent in real time: the commander, or without one the trajectory and whoever gives a setpoint."""

    def __init__(self, node: FlightNode, period_of: Callable[[str], int], clock: Callable[[], float]) -> None:
        """Listen for ``node``; ``period_of`` gives the period of a role in plant steps, ``clock`` the flight's s."""
        self._node, self._period_of, self._clock = node, period_of, clock
        self._asked_at, self._heard = 0.0, dict[str, float]()
        self._unanswered: dict[str, float] = {}  # when the first state after it was published
        limits = {stage.output: (stage.role, node.flight.setpoint_timeout) for stage in STAGES}
        limits = {**limits, "reference": (TRAJECTORY, node.flight.reference_timeout)}
        if node.commanded:
            limits = {"flight/mode": (COMMANDER, _LOST)}
        self._limits = {topic: of for topic, of in limits.items() if of[0] in node.roles and not node.lockstep}
        self._limits.pop(COMMAND, None)  # the guard watches that
        for topic in () if node.commanded else self._limits:
            node.links.subscribe(topic, partial(self._on_setpoint, topic), raw=True)

    def note(self, topic: str) -> None:
        """Note that ``topic`` has come."""
        self._heard[topic] = self._clock()

    def note_state(self) -> None:
        """Note that a state was published."""
        if self._limits:  # else no node is watched, as in lockstep
            self._asked_at = self._clock()

    def silent(self) -> str:
        """Return which node is silent and since when, empty if none is.

        A node is silent when states have come for too long after the first that it left unanswered: without states
        there is nothing to answer.
        """
        now, asked_at = self._clock(), self._asked_at
        self._heard = {topic: min(heard + self._node.slept, now) for topic, heard in self._heard.items()}
        for topic, (role, timeout) in self._limits.items():
            heard, since = self._heard.get(topic, now), self._unanswered.get(topic, 0.0)
            if asked_at > heard >= since:
                since = self._unanswered[topic] = asked_at
            limit = max(timeout, _PERIODS * seconds(self._period_of(role), self._node.flight.plant_period))
            if since > heard and asked_at - since > limit:
                return f"{role} does not answer: {topic} older than {limit:g} s"
        return ""

    def _on_setpoint(self, topic: str, payload: bytes) -> None:
        if not self._node.is_foreign(topic, head_of(payload)[1]):
            self.note(topic)
