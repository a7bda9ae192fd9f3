"""What a vehicle interface receives of the nodes before the last controller: ``CommandLink`` and ``InputWatch``.

With a commander that is its mode of each step. Without one, in real time, it is how old the reference and the setpoints
are: the guard sees wrenches alone, and a controller that has lost its input goes on sending; the vehicle stays level
and drifts, or brakes to the last reference (docs/explanation/safety.md).
"""

from collections.abc import Callable
from functools import partial

from rclpy.serialization import deserialize_message

from quad_core.cascade import COMMAND, COMMANDER, STAGES, TRAJECTORY
from quad_core.cycle import seconds
from quad_core.types import FlightMode
from quad_msgs.msg import FlightMode as FlightModeMsg
from quad_msgs.msg import FlightRequest
from quad_node.codec import UNUSABLE, Stamped, head_of, unpacker
from quad_node.flight_node import FlightNode
from quad_node.starter import STARTER_GONE, Starter

_LOST = 0.5  # s: age of the commander's mode
_PERIODS = 3.0  # of a slow node that may pass all the same


class CommandLink:
    """The newest `flight/mode`, and `flight/request` to end."""

    def __init__(self, node: FlightNode, progress: Callable[[], None], starter: Starter) -> None:
        """Take part as ``node``; ``progress`` is called when a mode has come."""
        self.mode = Stamped(-1, -1, 0, FlightMode(), True)  # disarmed
        self.outcome, self._newest = "", b""
        self._node, self._progress, self._starter = node, progress, starter
        self._unpack = unpacker(FlightMode, FlightModeMsg, run=node.run)
        self._passed_on = False
        self._requests = node.publisher("flight/request")
        node.subscribe("flight/mode", self._on_mode, raw=True)

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
        if not why and self._starter.is_gone():
            why = STARTER_GONE
        if why and not self._passed_on:
            self._passed_on = True
            self._requests.publish(FlightRequest(request=FlightRequest.END, run=self._node.run, sender=why))

    def _on_mode(self, payload: bytes) -> None:
        try:
            stamped = self._unpack(payload)
            self.outcome = deserialize_message(payload, FlightModeMsg).outcome if stamped.value.is_over else ""
        except UNUSABLE as error:
            self._node.unusable("flight/mode", payload, error)
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
        limits = {stage.gives: (stage.role, node.flight.setpoint_timeout) for stage in STAGES}
        limits = {**limits, "reference": (TRAJECTORY, node.flight.reference_timeout)}
        if node.commanded:
            limits = {"flight/mode": (COMMANDER, _LOST)}
        self._limits = {topic: of for topic, of in limits.items() if of[0] in node.roles and not node.lockstep}
        self._limits.pop(COMMAND, None)  # the guard watches that
        for topic in () if node.commanded else self._limits:
            node.subscribe(topic, partial(self._on_setpoint, topic), raw=True)

    def note(self, topic: str) -> None:
        """Note that ``topic`` has come."""
        self._heard[topic] = self._clock()

    def note_state(self) -> None:
        """Note that a state was published."""
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
