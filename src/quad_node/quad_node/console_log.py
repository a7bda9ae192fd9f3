"""What a node prints: starting, waiting for which topic of which node, flying, ended and why."""

import time
from typing import Protocol

from quad_msgs.msg import FlightEvent

_FIRST = 2.0  # s without a link after which waiting is worth a line: nodes find each other within one
_AGAIN = 10.0  # s between two lines of waiting


class Logger(Protocol):
    """The part of rclpy's logger that is used."""

    def info(self, message: str) -> object:
        """Log a line."""

    def warning(self, message: str) -> object:
        """Log a line about what is not as it should be."""

    def error(self, message: str) -> object:
        """Log a line about a failure."""


class ConsoleLog:
    """Prints each thing once; what is waited for only when it has changed, and not too often."""

    def __init__(self, logger: Logger) -> None:
        """Print nothing yet."""
        self._logger = logger
        self._said: set[str] = set()
        self._waiting = ""
        self._over = False
        self._next = time.monotonic() + _FIRST

    def starting(self, role: str, run_id: str, lockstep: bool, seen_by: str) -> None:
        """Print role, run, clock and visibility at the start."""
        clock = "lockstep" if lockstep else "real time"
        self._once("starting", f"starting: {role}, run {run_id or 'not named'}, {clock}; {seen_by}")

    def waiting(self, missing: str) -> None:
        """Say what is waited for before the flight."""
        now = time.monotonic()
        if self._over or "flying" in self._said:
            return
        if missing != self._waiting and now >= self._next:
            self._waiting, self._next = missing, now + _AGAIN
            self._logger.info(f"waiting for {missing}")

    def flying(self) -> None:
        """Say that the flight has begun."""
        self._once("flying", "flying")

    def over(self) -> None:
        """Wait no longer: the flight has ended, or never began."""
        self._over = True

    def ended(self, exit_code: int, why: str) -> None:
        """Say that the node has done its work, and why."""
        if exit_code:
            self._logger.error(f"ended with exit code {exit_code}: {why}")
        else:
            self._logger.info(f"ended: {why or 'flown as planned'}")

    def event(self, severity: int, line: str) -> None:
        """Say what is on flight/events; ``severity`` as there."""
        # One line per severity: rclpy refuses to log with two severities from the same line.
        if severity == FlightEvent.INFO:
            self._logger.info(line)
        elif severity == FlightEvent.WARNING:
            self._logger.warning(line)
        else:
            self._logger.error(line)

    def _once(self, kind: str, line: str) -> None:
        if kind not in self._said:
            self._said.add(kind)
            self._logger.info(line)
