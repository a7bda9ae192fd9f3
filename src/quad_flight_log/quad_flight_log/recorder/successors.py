"""Two answers to one step that are no contradiction: who died in the middle of sending, and who took over.

The dead one has reached some readers only, of which the recorder may be one. Who takes over with another memory answers
the same step otherwise. What was recorded first stays.
"""

from collections.abc import Callable

from rclpy.serialization import deserialize_message

from quad_core.cascade import SHADOW
from quad_msgs.msg import FlightEvent, Takeover
from quad_node import topics
from quad_node.handshake import is_foreign

_SENT_AGAIN = 1_000_000_000
"""ns before a takeover: more than the answers that who takes over keeps to send them again."""


class Successors:
    """From which steps on a controller has taken over from another."""

    def __init__(self, run_id: str, plant_period: int) -> None:
        """Know of none; ``plant_period`` in ns."""
        self._run_id, self._plant_period = run_id, plant_period
        self._since: dict[str, int] = {}

    def listening(self, keep: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """Return ``keep``, that also notes who takes over."""

        def on_message(payload: bytes) -> None:
            keep(payload)
            message = deserialize_message(payload, Takeover)
            if not is_foreign(message.run_id, self._run_id):
                role = message.role.removeprefix(SHADOW)
                self._since[role] = max(self._since.get(role, 0), message.step)

        return on_message

    def judge(self, topic: str, stamp_ns: int) -> tuple[int, str, str]:
        """Return severity, kind and text of the event of a second, different message for a stamp of ``topic``.

        A warning, for they come by the thousand: once a second it is said, every one is counted and fails the flight.
        """
        since = self._since.get(topics.TOPICS[topic].publishers[0], -1) * self._plant_period
        if since - _SENT_AGAIN < stamp_ns <= since:
            text = (
                f"{topic}: who died and who took over answered stamp {stamp_ns} ns differently; the first is recorded"
            )
            return FlightEvent.WARNING, "answered_twice", text
        text = f"{topic}: a second, different message for stamp {stamp_ns} ns; not recorded"
        return FlightEvent.WARNING, "conflict", text
