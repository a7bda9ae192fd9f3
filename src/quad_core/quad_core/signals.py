"""Which signals ask a process to end, and which of them only repeat what was asked."""

import signal
import time

ONE_REQUEST = 0.5
"""s within which signals are one request: one Ctrl-C reaches a node by its terminal and by its parent."""


def ending() -> tuple[signal.Signals, ...]:
    """Return SIGINT, SIGTERM and SIGHUP; the last not where it is ignored, for so nohup asks to go on."""
    asked = (signal.SIGINT, signal.SIGTERM)
    return asked if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else (*asked, signal.SIGHUP)


def repeats(number: int, first: float, within: float = ONE_REQUEST) -> bool:
    """Return whether signal ``number`` asks for nothing harder than the one that came at ``first``, monotonic s.

    Nothing that comes within ``within`` s does, and SIGHUP never: a terminal that goes hangs up several times.
    """
    return number == signal.SIGHUP or time.monotonic() - first < within
