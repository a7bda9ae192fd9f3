"""Watch the processes of a flight until all have left, and name what went wrong first."""

import signal
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NamedTuple

from quad_bringup.processes import Processes, describe_exit
from quad_bringup.terminal import complain
from quad_core.cascade import COMMANDER, SHADOWS, SIMULATOR
from quad_core.flight_parameters import REALTIME
from quad_core.resolution import Resolved
from quad_core.signals import ONE_REQUEST, ending, repeats
from quad_node.watch import ENDED, FLYING, WAITING, FlightWatch, Sighting

_POLL = 0.1
_LAST_NEWS = 1.0
_STARTUP_MARGIN = 30.0
_LEFT_EARLY = 10.0  # s in which a flight must begin once a node of it has left
_WIND_UP = 20.0
_ONE_REQUEST = 2.0 * ONE_REQUEST  # what is passed on as a second one must be one for a node, too
_LANDING = 300.0  # s for the longest way down
_SLOWEST = 20.0  # s by the clock in which a busy machine flies the 2 s after which a commander in lockstep lands


class Patience(NamedTuple):
    """Wall-clock limits in s after which the flight is stopped from outside.

    ``landing``: what the vehicle's owner then has to bring the vehicle down, 0 if it stops at once. ``commanded``:
    whether a commander flies, whom the cause is said to first.
    """

    start: float
    silence: float
    answer: float
    landing: float = 0.0
    commanded: bool = False

    @classmethod
    def of(cls, simulator: Resolved) -> "Patience":
        """Return limits that leave the nodes time to report a fault themselves, and a commander time to land."""
        repeats = simulator.node.repeat_after * (simulator.node.repeat_limit + 1)
        answer = repeats + 3.0
        realtime = simulator.flight.mode == REALTIME
        lands = realtime and simulator.node.guard.enabled
        landing = simulator.node.descent_timeout + 3.0 if lands else 0.0
        commanded = COMMANDER in simulator.flight.roles.split(",")
        if commanded:
            landing = _LANDING
            answer += 0.0 if realtime else _SLOWEST
        return cls(
            simulator.flight.start_timeout + _STARTUP_MARGIN,
            simulator.flight.silence_timeout + answer,
            answer,
            landing,
            commanded,
        )


class Outcome(NamedTuple):
    """``cause``: what ended the flight from outside, empty if nothing did. ``late``: who had to be stopped after it."""

    cause: str
    late: tuple[str, ...] = ()


class Interrupts:
    """Which signals asked for the end: each one asks harder. ``name`` is that of the first, empty if none came."""

    def __init__(self) -> None:
        """Begin without one."""
        self.names: list[str] = []
        self._first = 0.0

    def note(self, number: int) -> None:
        """Note a signal, unless it only repeats the first."""
        if not self.names:
            self._first = time.monotonic()
        elif repeats(number, self._first, _ONE_REQUEST):
            return
        self.names.append(signal.Signals(number).name)

    @property
    def name(self) -> str:
        """Name of the first signal, empty if none came."""
        return self.names[0] if self.names else ""


class Interrupted(KeyboardInterrupt):
    """A signal that asks for the end came before or after the flight; its name is the text."""


@contextmanager
def raised() -> Iterator[None]:
    """Raise Interrupted on SIGINT, SIGTERM and SIGHUP."""

    def note(number: int, _frame: FrameType | None) -> None:
        raise Interrupted(signal.Signals(number).name)

    with _handled(note):
        yield


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Note SIGINT, SIGTERM and SIGHUP instead of dying of them."""
    noted = Interrupts()

    def note(number: int, _frame: FrameType | None) -> None:
        noted.note(number)

    with _handled(note):
        yield noted


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    before = {number: signal.signal(number, handler) for number in ending()}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


def supervise(
    processes: Processes,
    watch: FlightWatch,
    patience: Patience,
    interrupted: Interrupts,
    show: Callable[[Sighting | None], None],
    spared: Collection[str] = SHADOWS,
) -> Outcome:
    """Return when all processes have left, stopping those that do not.

    Where a vehicle can be brought down its owner is first asked to, even if no news says that it flies: news may be
    late. A second signal stops it at once. A commander first hears the cause, so that the record names who died.
    A process that hangs while it leaves a flight that has ended is not a cause: what it had to do is in the bag.
    ``spared``: roles without which the flight goes on.
    """
    cause = early = untold = ""
    late: tuple[str, ...] = ()
    deadline = time.monotonic() + patience.start
    known: Sighting | None = None
    heeded, landing = 0, False
    while processes.running():
        state = watch.poll(_POLL)
        now = time.monotonic()
        if state is not known:
            if not (early and _waits(state)):
                left = _more(state, known, patience, cause, landing)
                deadline = deadline if left is None else now + left
            known = state
        show(state)
        if untold and state is not None and _waits(state):  # without news the flight may even be over
            complain(f"{untold}: its node has {_LEFT_EARLY:g} s to appear")
            untold = ""
        ended = processes.reap()
        if any(ended.values()):
            # The end of the flight may have been published, but not received here yet.
            state = watch.poll(_LAST_NEWS)
        # first: a terminal's Ctrl-C goes to all processes, and who ends by it is not why the flight ends
        if len(interrupted.names) > heeded:
            heeded, deadline = len(interrupted.names), now
            cause = cause or f"interrupted by {interrupted.name}"
        for role, code in ended.items():
            if not cause and role not in spared and not _may_leave(state, code):
                cause = f"{role} {describe_exit(code)}"
                deadline = now + (patience.answer if _others_will_notice(role, state) else 0.0)
            elif not (cause or early) and role not in spared and _waits(state):
                early = untold = f"{role} {describe_exit(code)} before the flight began"
                deadline = min(deadline, now + _LEFT_EARLY)
        if now >= deadline:
            if patience.landing and not landing and (state is None or not state.over) and processes.has_owner():
                landing, cause = True, cause or _silent(state, early)
                if patience.commanded and _flies(state) and not interrupted.names:
                    watch.ask_to_end(cause)
                processes.interrupt_owner()
                deadline = now + (patience.landing if _flies(state) else patience.answer)
                continue
            hung = not cause and state is not None and state.phase == ENDED
            late, cause = (tuple(processes.pids()), "") if hung else ((), cause or _silent(state, early))
            processes.stop()
    return Outcome(cause, late)


def _flies(state: Sighting | None) -> bool:
    return state is not None and state.phase == FLYING


def _more(
    state: Sighting | None, known: Sighting | None, patience: Patience, cause: str, landing: bool
) -> float | None:
    """Return how many s the flight has from now on after news of it, None if the news changes nothing."""
    if state is None:
        return None
    moves = state.phase == FLYING or known is None or state.phase != known.phase
    if moves and not cause:
        return _limit(state, patience)
    if moves and (state.over or not patience.landing):
        # after a cause the guard may still be bringing the vehicle down
        return patience.answer if state.phase == FLYING else _limit(state, patience)
    return patience.landing if landing and _flies(state) and not _flies(known) else None


def _waits(state: Sighting | None) -> bool:
    return state is None or state.phase == WAITING


def _limit(state: Sighting, patience: Patience) -> float:
    if state.phase == WAITING:
        return patience.start
    return _WIND_UP if state.over else patience.silence


def _may_leave(state: Sighting | None, code: int) -> bool:
    """Return whether a process may end now: its exit code means that the flight ended, or we know that it is over.

    A short flight may be over before anything of it is known here.
    """
    return code == 0 or (code > 0 and state is not None and state.over)


def _others_will_notice(role: str, state: Sighting | None) -> bool:
    return role != SIMULATOR and _flies(state)


def _silent(state: Sighting | None, early: str) -> str:
    if state is None or state.phase == WAITING:
        return early or f"the flight did not start: {state.reason if state else 'no flight/state from the simulator'}"
    if state.over:
        return f"the nodes did not leave after the flight had failed: {state.reason}"
    return f"flight/state: nothing from the simulator after step {state.step}"
