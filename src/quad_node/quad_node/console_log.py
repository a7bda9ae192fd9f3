"""What a node prints: starting, waiting for which topic of which node, flying, ended and why."""

import time
from typing import Any

from quad_msgs.msg import FlightEvent

_FIRST = 2.0  # s without a link after which waiting is worth a line: nodes find each other within one
_AGAIN = 10.0  # s between two lines of waiting


class ConsoleLog:
    """Prints each thing once; what is waited for only when it has changed, and not too often."""

    def __init__(self, logger: Any) -> None:
        """Print nothing yet; ``logger``: rclpy's."""
        self._logger = logger
        self._waiting = ""
        self._flies = self._over = False
        self._next = time.monotonic() + _FIRST

    def starting(self, role: str, run_id: str, lockstep: bool, seen_by: str) -> None:
        """Print role, run, clock and visibility at the start."""
        clock = "lockstep" if lockstep else "real time"
        self._logger.info(f"starting: {role}, run {run_id or 'not named'}, {clock}; {seen_by}")

    def waiting(self, missing: str) -> None:
        """Print what is waited for before the flight."""
        now = time.monotonic()
        if not (self._over or self._flies) and missing != self._waiting and now >= self._next:
            self._waiting, self._next = missing, now + _AGAIN
            self._logger.info(f"waiting for {missing}")

    def flying(self) -> None:
        """Print that the flight has begun."""
        if not self._flies:
            self._flies = True
            self._logger.info("flying")

    def over(self) -> None:
        """Wait no longer: the flight has ended, or never began."""
        self._over = True

    def ended(self, exit_code: int, why: str) -> None:
        """Print that the node has done its work, and why."""
        if exit_code:
            self._logger.error(f"ended with exit code {exit_code}: {why}")
        else:
            self._logger.info(f"ended: {why or 'flown as planned'}")

    def event(self, severity: int, line: str) -> None:
        """Print what is on flight/events; ``severity`` as there."""
        # one line per severity: rclpy refuses to log with two severities from the same line
        if severity == FlightEvent.INFO:
            self._logger.info(line)
        elif severity == FlightEvent.WARNING:
            self._logger.warning(line)
        else:
            self._logger.error(line)
