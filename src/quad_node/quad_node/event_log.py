"""The event log of a node: what happens, on ``flight/events`` and in the log of its process, counted by kind."""

import time
from collections import Counter
from collections.abc import Callable
from typing import Any

from quad_msgs.msg import FlightEvent
from quad_node.codec import ForeignRunError, set_stamp


class EventLog:
    """``counts``: how often each kind of event came, and what else is worth counting."""

    def __init__(self, name: str, log: Any, publisher: Any, now: Callable[[], int] = lambda: 0) -> None:
        """Speak for the node ``name`` through ``log``, its logger, and ``publisher`` of flight/events.

        ``now``: the flight time in ns of what is said without a stamp.
        """
        self._name, self._log, self._out, self._now = name, log, publisher, now
        self.counts: Counter[str] = Counter()
        self._last_reported: dict[str, float] = {}

    def info(self, kind: str, text: str, stamp_ns: int | None = None, always: bool = False) -> None:
        """Report what a reader of the flight wants to know."""
        if self._is_due(FlightEvent.INFO, kind, text, stamp_ns, always):
            self._log.info(f"{kind}: {text}")  # rclpy refuses to log with two severities from the same line

    def warn(self, kind: str, text: str, stamp_ns: int | None = None, always: bool = False) -> None:
        """Report what is wrong and does not end the flight."""
        if self._is_due(FlightEvent.WARNING, kind, text, stamp_ns, always):
            self._log.warning(f"{kind}: {text}")

    def error(self, kind: str, text: str, stamp_ns: int | None = None) -> None:
        """Report what ends the flight."""
        if self._is_due(FlightEvent.ERROR, kind, text, stamp_ns, True):
            self._log.error(f"{kind}: {text}")

    def reject(self, topic: str, found: str, stamp_ns: int | None = None, kind: str = "rejected_nonfinite") -> None:
        """Count and report a message that is not used; ``stamp_ns`` of the flight."""
        self.counts["rejected"] += 1
        self.warn(kind, f"{topic}: {found}; message ignored", stamp_ns)

    def foreign(self, topic: str) -> None:
        """Count and report a message of another run."""
        self.warn("foreign_run", f"{topic} of another run ignored")

    def unusable(self, topic: str, payload: bytes, error: Exception) -> None:
        """Count and report a payload whose reading raised ``error``, one of UNUSABLE of the codec."""
        if isinstance(error, ForeignRunError):
            self.foreign(topic)
        else:
            self.reject(topic, f"a malformed message of {len(payload)} bytes ({error})", kind="rejected_malformed")

    def _is_due(self, severity: int, kind: str, text: str, stamp_ns: int | None, always: bool) -> bool:
        """Count ``kind`` and publish it, at most once a second for the same kind unless ``always``."""
        self.counts[kind] += 1
        now = time.monotonic()
        if not always and now - self._last_reported.get(kind, -1.0) < 1.0:
            return False
        self._last_reported[kind] = now
        message = FlightEvent(node=self._name, severity=severity, kind=kind, text=text)
        set_stamp(message.stamp, self._now() if stamp_ns is None else stamp_ns)
        self._out.publish(message)
        return True
