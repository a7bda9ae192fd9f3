"""Watch the processes of a flight until all have left, and name what went wrong first."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NamedTuple

from quad_bringup.processes import Processes, describe_exit
from quad_core.node_parameters import SHADOWS, Resolved
from quad_node.watch import ENDED, FLYING, WAITING, FlightWatch, Sighting

_POLL = 0.1
_LAST_NEWS = 1.0
_STARTUP_MARGIN = 30.0
_WIND_UP = 20.0


class Patience(NamedTuple):
    """Wall-clock limits in s after which the flight is stopped from outside."""

    start: float
    silence: float
    answer: float

    @classmethod
    def of(cls, simulator: Resolved) -> "Patience":
        """Return limits that leave the nodes the time to find out and say so themselves."""
        repeats = simulator.node.repeat_after * (simulator.node.repeat_limit + 1)
        answer = max(repeats, simulator.node.loss_timeout) + 3.0
        return cls(simulator.flight.start_timeout + _STARTUP_MARGIN, simulator.flight.silence_timeout + answer, answer)


class Outcome(NamedTuple):
    """``cause``: what ended the flight from outside, empty if nothing did. ``late``: who had to be stopped after it."""

    cause: str
    late: tuple[str, ...] = ()


class Interrupts:
    """Which signal asked for the end, empty if none did."""

    name = ""


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Note SIGINT, SIGTERM and SIGHUP instead of dying of them."""
    noted = Interrupts()

    def note(number: int, _frame: FrameType | None) -> None:
        noted.name = signal.Signals(number).name

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, note) for number in numbers]
    try:
        yield noted
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def supervise(
    processes: Processes,
    watch: FlightWatch,
    patience: Patience,
    interrupted: Interrupts,
    show: Callable[[Sighting | None], None],
) -> Outcome:
    """Return when all processes have left, stopping those that do not.

    A process that hangs while it leaves a flight that has ended is not a cause: what it had to do is in the bag.
    """
    cause = ""
    late: tuple[str, ...] = ()
    deadline = time.monotonic() + patience.start
    known: Sighting | None = None
    while processes.running():
        state = watch.poll(_POLL)
        now = time.monotonic()
        if state is not known:
            moving = state is not None and (state.phase == FLYING or known is None or state.phase != known.phase)
            deadline = now + _limit(state, patience) if moving and not cause else deadline
            known = state
        show(state)
        ended = processes.reap()
        if any(ended.values()):
            # The end of the flight may have been said, but not have been heard here yet.
            state = watch.poll(_LAST_NEWS)
        for role, code in ended.items():
            if not cause and role not in SHADOWS and not _may_leave(state, code):
                cause = f"{role} {describe_exit(code)}"
                deadline = now + (patience.answer if _others_will_notice(role, state) else 0.0)
        if interrupted.name:
            cause = cause or f"interrupted by {interrupted.name}"
            deadline = now
        if now >= deadline:
            if not cause and state is not None and state.phase == ENDED:
                late = tuple(processes.pids())
            else:
                cause = cause or _silent(state)
            processes.stop()
    return Outcome(cause, late)


def _limit(state: Sighting | None, patience: Patience) -> float:
    if state is None or state.phase == WAITING:
        return patience.start
    return _WIND_UP if state.over else patience.silence


def _may_leave(state: Sighting | None, code: int) -> bool:
    """Return whether a process may end now: its exit code says that the flight ended, or we know that it is over.

    A short flight may be over before anything of it is known here.
    """
    return code == 0 or (code > 0 and state is not None and state.over)


def _others_will_notice(role: str, state: Sighting | None) -> bool:
    return role != "simulator" and state is not None and state.phase == FLYING


def _silent(state: Sighting | None) -> str:
    if state is None or state.phase == WAITING:
        return f"the flight did not start: {state.reason if state else 'no flight/state from the simulator'}"
    if state.over:
        return f"the nodes did not leave after the flight had failed: {state.reason}"
    return f"flight/state: nothing from the simulator after step {state.step}"
