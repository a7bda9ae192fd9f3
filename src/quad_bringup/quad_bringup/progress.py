"""How far a flight is, on the terminal: one line that moves, or a line now and then elsewhere."""

import time
from typing import TextIO

from quad_bringup.terminal import write
from quad_node.watch import WAITING, Sighting

_PLAIN_EVERY = 5.0
_LIVE_EVERY = 0.2
_BAR = 24
_CLEAR = "\r\033[K"


class Progress:
    """Shows the newest state of one flight."""

    def __init__(self, name: str, out: TextIO) -> None:
        """Show the flight ``name`` on ``out``."""
        self._name, self._out = name, out
        self._live = out.isatty()
        self._next = 0.0
        self._shown = False

    def show(self, state: Sighting | None) -> None:
        """Show ``state`` if it is time to."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + (_LIVE_EVERY if self._live else _PLAIN_EVERY)
        line = f"{self._name}: {describe(state)}"
        if self._live:
            write(f"{_CLEAR}{line}", self._out)
            self._shown = True
        else:
            write(f"{line}\n", self._out)

    def tell(self, time_: float, change: str) -> None:
        """Show a change of mode ``time_`` s after the start, in a line that stays."""
        write(f"{_CLEAR if self._live else ''}{self._name}: {time_:.1f} s: {change}\n", self._out)

    def close(self) -> None:
        """Leave the terminal as it was."""
        if self._shown:
            write(_CLEAR, self._out)


def describe(state: Sighting | None) -> str:
    """Return one line about ``state``."""
    if state is None:
        return "starting"
    if state.phase == WAITING:
        return state.reason
    if not state.end_step or not state.step:
        return f"{state.flight_time:.1f} s"
    done = min(state.step / state.end_step, 1.0)
    bar = ("#" * round(_BAR * done)).ljust(_BAR, ".")
    total = state.flight_time * state.end_step / state.step
    return f"[{bar}] {state.flight_time:.1f} of {total:.1f} s, {state.real_time_factor:.1f} x real time"
