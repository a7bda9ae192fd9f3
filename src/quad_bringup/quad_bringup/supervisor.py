"""Watch the processes of a flight until all have left, and name what went wrong first."""

import signal
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NamedTuple

from quad_bringup.processes import Processes, describe_exit
from quad_bringup.terminal import complain
from quad_core.cascade import COMMANDER, RECORDER, SHADOWS, SIMULATOR
from quad_core.flight_parameters import REALTIME
from quad_core.resolution import Resolved
from quad_core.signals import ONE_REQUEST, repeats
from quad_core.signals import ending as ending_signals
from quad_node.watch import ENDED, FLYING, WAITING, FlightWatch, Sighting

_POLL = 0.1
_LAST_NEWS = 1.0
_STARTUP_MARGIN = 30.0
_LEFT_EARLY = 10.0  # s in which a flight must begin once a node of it has left
_WIND_UP = 20.0
_ONE_REQUEST = 2.0 * ONE_REQUEST  # what is passed on as a second one must be one for a node, too
_LANDING = 4.0 * 3600.0  # s for the longest way down, 1 km on a busy machine
_SECOND = "a second signal (Ctrl-C) stops the motors where it is"
_SLOWEST = 20.0  # s by the clock in which a busy machine flies the 2 s after which a commander in lockstep lands


class Patience(NamedTuple):
    """Wall-clock limits in s after which the flight is stopped from outside.

    ``landing``: what the vehicle interface then has to bring the vehicle down, 0 if it stops at once. ``commanded``:
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
        answer = simulator.node.answer_timeout + 3.0
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
    """``cause``: what ended the flight from outside, or empty. ``late``: what had to be stopped after it."""

    cause: str
    late: tuple[str, ...] = ()


class Interrupts:
    """Signals that ask for the end, the first and those that ask harder. ``name``: that of the first, or empty."""

    def __init__(self) -> None:
        """Begin without one."""
        self.names: list[str] = []
        self._since = 0.0

    def note(self, number: int) -> None:
        """Note a signal, unless it only repeats the first."""
        if not self.names:
            self._since = time.monotonic()
        elif repeats(number, self._since, _ONE_REQUEST):
            return
        self.names.append(signal.Signals(number).name)

    def answered(self) -> None:
        """Note that the terminal has said what a second signal does: one that came before was not meant so."""
        self._since = time.monotonic()
        del self.names[1:]

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
    before = {number: signal.signal(number, handler) for number in ending_signals()}
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

    Where a vehicle can be brought down its interface is first asked to, even if no message says that it flies: news may
    be late. The first signal of an operator is never more than that request; a second one stops the motors at once. A
    commander first receives the cause, so that the record names the node that failed. A process that hangs while it
    leaves a flight that has ended is not a cause: what it had to do is in the bag. ``spared``: roles without which the
    flight goes on.
    """
    supervision = _Supervision(processes, watch, patience, interrupted, spared)
    while processes.running():
        supervision.look()
        show(supervision.state)
    return Outcome(supervision.cause, supervision.late)


class _Supervision:
    """What is known of a flight, why it shall end, and until when it may go on."""

    def __init__(
        self,
        processes: Processes,
        watch: FlightWatch,
        patience: Patience,
        interrupted: Interrupts,
        spared: Collection[str],
    ) -> None:
        self._processes, self._watch, self._patience = processes, watch, patience
        self._interrupted, self._spared = interrupted, spared
        self.state: Sighting | None = None
        self.cause = self._early = self._untold = ""
        self.late: tuple[str, ...] = ()
        self._deadline = time.monotonic() + patience.start
        self._heeded, self._landed_by = 0, 0.0
        self._lands = False

    def look(self) -> None:
        """Take in news, signals and exits for a moment, and act on them."""
        before, self.state = self.state, self._watch.poll(_POLL)
        if self.state is not before:
            self._on_news(before)
        if self._untold and self.state is not None and _waits(self.state):  # without news the flight may even be over
            complain(f"{self._untold}: its node has {_LEFT_EARLY:g} s to appear")
            self._untold = ""
        ended = self._processes.reap()
        if ended.get(RECORDER):  # at once: in lockstep the plant waits for it
            self._watch.report_failure(RECORDER, describe_exit(ended[RECORDER]))
        if any(code for role, code in ended.items() if role not in self._spared):
            # The end of the flight may have been published, but not received here yet.
            self.state = self._watch.poll(_LAST_NEWS)
        # first: a terminal's Ctrl-C goes to all processes, and a process that ends by it is not the cause
        if len(self._interrupted.names) > self._heeded:
            self._on_signal()
        for role, code in ended.items():
            self._on_exit(role, code)
        if time.monotonic() >= self._deadline:
            self._end()

    def _on_news(self, before: Sighting | None) -> None:
        state, patience, now = self.state, self._patience, time.monotonic()
        if state is None or (self._early and _waits(state)):
            return
        if state.phase != FLYING and before is not None and state.phase == before.phase:
            return
        if not self.cause:
            self._deadline = now + _limit(state, patience)
        elif state.over or not patience.landing:
            self._deadline = now + (patience.answer if state.phase == FLYING else _limit(state, patience))
        elif self._lands and _flies(state):
            self._deadline = min(self._landed_by, now + patience.silence)

    def _on_signal(self) -> None:
        """The first signal lands what can be landed, or leaves a landing alone; the second one stops."""
        first, name = not self._heeded, self._interrupted.names[self._heeded]
        self.cause = self.cause or f"interrupted by {name}"
        if first and self._can_land():
            complain(f"{name}: the vehicle {'is landing already' if self._lands else 'lands'}; {_SECOND}")
            self._interrupted.answered()
            self._heeded = 1
            if not self._lands:
                self._land()
        else:
            self._heeded = len(self._interrupted.names)
            self._deadline, self._lands = time.monotonic(), True

    def _on_exit(self, role: str, code: int) -> None:
        ending = f"{role} {describe_exit(code)}"
        if self.cause or role in self._spared:
            if code < 0 and -code not in ending_signals():
                complain(ending)
        elif role == RECORDER and self._patience.commanded and _flies(self.state) and code != 0:
            complain(f"{ending}: the flight goes on, and what is flown from now on is not recorded")
        elif not _may_leave(self.state, code):
            self.cause = ending
            self._deadline = time.monotonic()
            self._deadline += self._patience.answer if _others_will_notice(role, self.state) else 0.0
        elif not self._early and _waits(self.state):
            self._early = self._untold = f"{ending} before the flight began"
            self._deadline = min(self._deadline, time.monotonic() + _LEFT_EARLY)

    def _end(self) -> None:
        """Land what can be landed and was not asked to yet; stop everything else."""
        if not self._lands and self._can_land():
            self.cause = self.cause or _silent(self.state, self._early)
            complain(f"{self.cause}: the vehicle lands")
            self._land()
            return
        hung = not self.cause and self.state is not None and self.state.phase == ENDED
        if hung:
            self.late = tuple(self._processes.pids())
        else:
            self.cause = self.cause or _silent(self.state, self._early)
        self._processes.stop()

    def _can_land(self) -> bool:
        over = self.state is not None and self.state.over
        return bool(self._patience.landing) and not over and self._processes.has_owner()

    def _land(self) -> None:
        self._lands = True
        flies = _flies(self.state)
        if self._patience.commanded and flies and not self._interrupted.names:
            self._watch.ask_to_end(self.cause)
        self._processes.interrupt_owner()
        self._landed_by = time.monotonic() + self._patience.landing
        self._deadline = min(self._landed_by, time.monotonic() + self._patience.silence)
        if not flies:
            self._deadline = time.monotonic() + self._patience.answer


def _flies(state: Sighting | None) -> bool:
    return state is not None and state.phase == FLYING


def _waits(state: Sighting | None) -> bool:
    return state is None or state.phase == WAITING


def _limit(state: Sighting, patience: Patience) -> float:
    if state.phase == WAITING:
        return patience.start
    return max(_WIND_UP, patience.silence) if state.over else patience.silence


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
