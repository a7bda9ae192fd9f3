"""What is said while vehicles fly: a terminal or a pipe that is gone costs the words, and never a flight."""

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from quad_core.cycle import seconds
from quad_flight_log.errors import printable
from quad_msgs.msg import FlightState
from quad_node.codec import stamp_ns

_CLEAR = "\r\033[K"
_PLAIN_EVERY = 5.0
_LIVE_EVERY = 0.2


def write(text: str, out: TextIO) -> None:
    """Write ``text`` to ``out`` at once; if no node reads it any more, to nowhere, as all that follows."""
    try:
        out.write(text)
        out.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, out.fileno())
        os.close(nowhere)


def say(line: str) -> None:
    """Say a line of the result."""
    write(f"{printable(line)}\n", sys.stdout)


def complain(line: str) -> None:
    """Say in one line what is not as it should be."""
    clear = _CLEAR if sys.stderr.isatty() else ""  # the line that shows how far a flight is
    write(f"{clear}fly: {printable(' '.join(line.splitlines()))}\n", sys.stderr)


@contextmanager
def busy(line: str) -> Iterator[None]:
    """Show on a terminal what the time of the body goes into."""
    live = sys.stderr.isatty()
    write(f"{_CLEAR}{line} ..." if live else "", sys.stderr)
    try:
        yield
    finally:
        write(_CLEAR if live else "", sys.stderr)


class Progress:
    """Shows the newest state of one flight."""

    def __init__(self, name: str, out: TextIO) -> None:
        self._name, self._out = name, out
        self._live = out.isatty()
        self._next = self._told = 0.0
        self._shown = ""

    def show(self, state: FlightState | None) -> None:
        """Show ``state`` if it is time to."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + (_LIVE_EVERY if self._live else _PLAIN_EVERY)
        if state is not None and seconds(stamp_ns(state.stamp), 1) < self._told:
            return  # where no states come a commander goes on by the clock, ahead of the vehicle's own time
        line = f"{self._name}: {describe(state)}"
        if self._live or line != self._shown:
            write(f"{_CLEAR}{line}" if self._live else f"{line}\n", self._out)
        self._shown = line

    def tell(self, time_: float, news: str) -> None:
        """Show what a node said of ``time_`` s after the start, in a line that stays."""
        self._told = max(self._told, time_)
        write(f"{_CLEAR if self._live else ''}{self._name}: {time_:.1f} s: {printable(news)}\n", self._out)

    def close(self) -> None:
        """Leave the terminal as it was."""
        write(_CLEAR if self._live else "", self._out)


def describe(state: FlightState | None) -> str:
    """Return one line about ``state``."""
    if state is None:
        return "starting"
    if state.state == FlightState.WAITING:
        return state.reason
    flown = seconds(stamp_ns(state.stamp), 1)
    if not state.end_step or not state.step:
        return f"{flown:.1f} s"
    factor = flown / state.wall_time if state.wall_time > 0.0 else 0.0
    return f"{flown:.1f} of {flown * state.end_step / state.step:.1f} s, {factor:.1f} x real time"
