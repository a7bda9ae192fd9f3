"""What a vehicle interface receives of the nodes before the last controller: ``CommandLink`` and ``SetpointWatch``.

With a commander that is its mode of each step. Without one, in real time, it is how old the reference and the setpoints
are: the guard sees wrenches alone, and a controller that has lost its input goes on sending; the vehicle stays level
and drifts, or brakes to the last reference (docs/explanation/safety.md).
"""

import os
import time
from collections.abc import Callable
from functools import partial

from rclpy.serialization import deserialize_message

from quad_core.cascade import COMMAND, STAGES, TRAJECTORY
from quad_core.cycle import seconds
from quad_core.types import FlightMode
from quad_guard.guard import NO_REQUEST
from quad_msgs.msg import FlightMode as FlightModeMsg
from quad_msgs.msg import FlightRequest
from quad_node.codec import UNUSABLE, Stamped, head_of, unpacker
from quad_node.flight_node import FlightNode

_LOST = 0.5  # s
_PERIODS = 3.0  # of a slow controller that may pass all the same
STARTER = "QUAD_FLIGHT_STARTER"
"""Environment variable with the pid of the process that started the flight and looks after it."""


class CommandLink:
    """The newest `flight/mode`, and `flight/request` to end."""

    def __init__(self, node: FlightNode, progress: Callable[[], None]) -> None:
        """Take part as ``node``; ``progress`` is called when a mode has come."""
        self.mode: Stamped | None = None
        self.outcome = ""
        self._node, self._progress = node, progress
        self._unpack = unpacker(FlightMode, FlightModeMsg, run_id=node.flight.run_id)
        self._passed_on, self._heard, self._unanswered, self._there = False, 0.0, 0.0, 0.0
        starter = os.environ.get(STARTER, "")
        self._starter = int(starter) if starter.isdecimal() else 0
        self._requests = node.publisher("flight/request")
        self._modes = node.subscribe("flight/mode", self._on_mode, raw=True)

    def holds(self, step: int) -> bool:
        """Return whether the mode of ``step`` is known."""
        return self.mode is not None and self.mode.step <= step < self.mode.next_step

    @property
    def armed(self) -> bool:
        """Whether the mode lets the motors turn."""
        quiet = (FlightModeMsg.DISARMED, FlightModeMsg.ARMING, FlightModeMsg.PILOT)
        return self.mode is not None and self.mode.value.mode not in quiet

    @property
    def guard_request(self) -> int:
        """What the mode asks of the guard."""
        return self.mode.value.guard_request if self.mode is not None else NO_REQUEST

    @property
    def is_over(self) -> bool:
        """Whether the commander says that the flight may end."""
        return self.mode is not None and self.mode.value.is_over

    def is_lost(self, asked_at: float) -> bool:
        """Return whether a state has waited so long for its mode that no node decides any more.

        ``asked_at``: steady s at which the newest state was published. Without a state there is nothing to answer: then
        the commander is lost once it has left.
        """
        now = time.monotonic()
        if self._modes.get_publisher_count():
            self._there = now
        if asked_at > self._heard >= self._unanswered:
            self._unanswered = asked_at
        since = self._unanswered if self._unanswered > self._heard else max(self._there, self._heard)
        return self.mode is not None and now - since > _LOST

    def pass_on(self, asked_to_end: str, give_up: Callable[[str], None], asked_at: float) -> None:
        """Ask the commander for the end if ``asked_to_end`` says why, or if who started the flight is gone.

        In real time a commander that is lost is a reason to ``give_up``; in lockstep the flight stands still.
        """
        self._heard += self._node.slept
        if not self._node.lockstep and self.is_lost(asked_at):
            give_up("commander: no flight/mode any more")
        why = f"{self._node.role} was asked to end by {asked_to_end}" if asked_to_end else ""
        if not why and self._starter and os.getppid() != self._starter:
            why = "the process that started the flight is gone"
        if why and not self._passed_on:
            self._passed_on = True
            run_id = self._node.flight.run_id
            self._requests.publish(FlightRequest(request=FlightRequest.END, run_id=run_id, sender=why))

    def _on_mode(self, payload: bytes) -> None:
        try:
            stamped = self._unpack(payload)
            self.outcome = deserialize_message(payload, FlightModeMsg).outcome if stamped.value.is_over else ""
        except UNUSABLE as error:
            self._node.unusable("flight/mode", payload, error)
            return
        self.mode, self._heard = stamped, time.monotonic()
        self._progress()


class SetpointWatch:
    """When the reference and each setpoint came last, and which node is silent."""

    def __init__(self, node: FlightNode, period_of: Callable[[str], int]) -> None:
        """Listen for ``node``; ``period_of`` gives the period of a role in plant steps."""
        self._node, self._period_of = node, period_of
        self._heard: dict[str, float] = {}
        given = {"reference": TRAJECTORY, **{stage.gives: stage.role for stage in STAGES if stage.gives != COMMAND}}
        if node.lockstep or node.commanded:
            given = {}
        self._watched = {topic: role for topic, role in given.items() if role in node.roles}
        for topic in self._watched:
            node.subscribe(topic, partial(self._on_setpoint, topic), raw=True)

    def rest(self) -> None:
        """Report nothing: for a vehicle interface whose time waits for its controllers, however slow."""
        self._watched = {}

    def silent(self, asked_at: float) -> str:
        """Return which node is silent and since when, empty if none is.

        ``asked_at``: steady s at which the newest state was published: without a state there is nothing to answer. A
        setpoint is missed once it has come.
        """
        now, flight = time.monotonic(), self._node.flight
        self._heard = {topic: min(heard + self._node.slept, now) for topic, heard in self._heard.items()}
        for topic, role in self._watched.items():
            period = seconds(self._period_of(role), flight.plant_period)
            longest = flight.reference_timeout if role == TRAJECTORY else flight.setpoint_timeout
            limit = max(longest, _PERIODS * period)
            if asked_at - self._heard.get(topic, now) > limit:
                return f"{role} does not answer: {topic} older than {limit:g} s"
        return ""

    def _on_setpoint(self, topic: str, payload: bytes) -> None:
        if not self._node.is_foreign(topic, head_of(payload)[1]):
            self._heard[topic] = time.monotonic()
