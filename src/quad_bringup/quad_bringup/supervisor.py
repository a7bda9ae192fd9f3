"""Watch the processes of a flight until all have left, and name what went wrong first."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NamedTuple

from quad_bringup.processes import Processes, describe_exit, signal_name
from quad_bringup.terminal import complain
from quad_core.cascade import COMMANDER, RECORDER, SHADOWS, SIMULATOR, VEHICLE_INTERFACES
from quad_core.command_line import ONE_REQUEST, ending, repeats
from quad_core.enumerations import FlightClock
from quad_core.resolution import Resolved
from quad_msgs.msg import FlightState
from quad_node.watch import ENDED, FLYING, WAITING, FlightWatch, is_over

_POLL = 0.1
_LAST_NEWS = 1.0
_STARTUP_MARGIN = 30.0
_LEFT_EARLY = 10.0  # s in which a flight must begin once a node of it has left
_WIND_UP = 20.0
_ONE_REQUEST = 2.0 * ONE_REQUEST  # what is passed on as a second one must be one for a node, too
_LANDING = 4.0 * 3600.0  # s for the longest way down, 1 km on a busy machine
_SECOND = "a second signal (Ctrl-C) stops the motors where it is"
LANDED_WITHOUT = {role for role, one in VEHICLE_INTERFACES.items() if one.autopilot_lands and not one.flies_on_estimate}
"""Vehicle interfaces without which an autopilot lands the vehicle."""
_SLOWEST = 20.0  # s by the clock in which a busy machine flies the 2 s after which a commander in lockstep lands


class Patience(NamedTuple):
    """Wall-clock limits in s after which the flight is stopped from outside.

    ``landing``: what the vehicle interface then has to bring the vehicle down, 0 if it stops at once. ``commanded``:
    a commander flies, and receives the cause before the vehicle interface is asked to end.
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
        realtime = simulator.flight.mode == FlightClock.REALTIME
        landing = simulator.node.descent_timeout + 3.0 if realtime and simulator.node.guard.enabled else 0.0
        commanded = COMMANDER in simulator.flight.role_names
        if commanded:
            landing = _LANDING
            answer += 0.0 if realtime else _SLOWEST
        start, silence = simulator.flight.start_timeout + _STARTUP_MARGIN, simulator.flight.silence_timeout + answer
        return cls(start, silence, answer, landing, commanded)


class Outcome(NamedTuple):
    """``cause``: what ended the flight from outside, or empty. ``late``: what had to be stopped after it."""

    cause: str
    late: tuple[str, ...] = ()


class Interrupted(KeyboardInterrupt):
    """A signal that asks for the end came before the flight; its name is the text."""


class Interrupts:
    """Signals that ask for the end. Before the flight one raises Interrupted; while ``flying`` their names are noted.

    ``names``: of the first, and of those that ask harder. ``name``: that of the first, or empty.
    """

    def __init__(self) -> None:
        self.flying = False
        self.names: list[str] = []
        self._since = 0.0

    def note(self, number: int, _frame: FrameType | None = None) -> None:
        """Note a signal, unless it only repeats the first; raises Interrupted before the flight."""
        if not self.flying:
            raise Interrupted(signal.Signals(number).name)
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


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Handle SIGINT, SIGTERM and SIGHUP."""
    asked = Interrupts()
    before = {number: signal.signal(number, asked.note) for number in ending()}
    try:
        yield asked
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


class Supervisor:
    """What is known of a flight, why it shall end, and until when it may go on.

    Where a vehicle can be brought down its interface is first asked to, even if no message says that it flies: news may
    be late. The first signal of an operator is never more than that request; a second one stops the motors at once. A
    commander first receives the cause, so that the record names the node that failed. A process that hangs while it
    leaves a flight that has ended is not a cause: what it had to do is in the bag.
    """

    def __init__(
        self,
        processes: Processes,
        watch: FlightWatch,
        patience: Patience,
        interrupted: Interrupts,
        interface: str = SIMULATOR,
    ) -> None:
        """Begin with what was started; ``interface``: the name of the vehicle interface."""
        self._processes, self._watch, self._patience = processes, watch, patience
        self._interrupted, self._interface = interrupted, interface
        self.state: FlightState | None = None
        self.cause = self._early = ""
        self.late: tuple[str, ...] = ()
        self._deadline = time.monotonic() + patience.start
        self._heeded, self._landed_by = 0, 0.0
        self._lands = False

    def run(self, show: Callable[[FlightState | None], None]) -> Outcome:
        """Return when all processes have left, stopping those that do not; ``show`` gets the news."""
        while self._processes.running():
            self.look()
            show(self.state)
        return Outcome(self.cause, self.late)

    def look(self) -> None:
        """Take in news, signals and exits for a moment, and act on them."""
        before, self.state = self.state, self._watch.poll(_POLL)
        if self.state is not None and self.state is not before:
            self._on_news(self.state, before)
        ended = self._processes.reap()
        for role, number in self._processes.newly_stopped().items():
            complain(self._told(role, f"was stopped by {signal_name(number)} and stands still"))
        for role in ended.keys() & {RECORDER, *SHADOWS}:  # at once: in lockstep the plant waits for the recorder
            if ended[role]:  # and the recorder for the shadows
                self._watch.report_failure(role, describe_exit(ended[role]))
        if any(code for role, code in ended.items() if role not in SHADOWS):
            # The end of the flight may have been published, but not received here yet.
            self.state = self._watch.poll(_LAST_NEWS)
        # first: a terminal's Ctrl-C goes to all processes, and a process that ends by it is not the cause
        if len(self._interrupted.names) > self._heeded:
            self._on_signal()
        for role, code in ended.items():
            self._on_exit(role, code)
        if time.monotonic() >= self._deadline:
            self._end()

    @property
    def _phase(self) -> int:
        return self.state.state if self.state is not None else WAITING

    @property
    def _over(self) -> bool:
        return self.state is not None and is_over(self.state)

    @property
    def _can_land(self) -> bool:
        return bool(self._patience.landing) and not self._over and self._processes.vehicle_interface() is not None

    def _on_news(self, state: FlightState, before: FlightState | None) -> None:
        """Move the deadline; a phase that lasts moves it only in flight."""
        patience, now = self._patience, time.monotonic()
        lasts = before is not None and state.state == before.state
        if state.state != FLYING and (lasts or (self._early and state.state == WAITING)):
            return
        if self._lands and state.state == FLYING:
            self._deadline = min(self._landed_by, now + patience.silence)
        elif not self.cause or is_over(state) or not patience.landing:
            flying = patience.answer if self.cause else patience.silence
            over = max(_WIND_UP, patience.silence)
            self._deadline = now + {WAITING: patience.start, FLYING: flying}.get(state.state, over)

    def _on_signal(self) -> None:
        """The first signal lands what can be landed, or leaves a landing alone; the second one stops."""
        first, name = not self._heeded, self._interrupted.names[self._heeded]
        self.cause = self.cause or f"interrupted by {name}"
        if first and self._can_land:
            complain(f"{name}: the vehicle {'is landing already' if self._lands else 'lands'}; {_SECOND}")
            self._interrupted.answered()
            self._heeded = 1
            if not self._lands:
                self._land()
        else:
            self._heeded = len(self._interrupted.names)
            self._deadline, self._lands = time.monotonic(), True

    def _told(self, role: str, what: str) -> str:
        """Return what became of a process, and what follows where an autopilot flies."""
        lands = role == SIMULATOR and self._phase == FLYING and self._interface in LANDED_WITHOUT
        follows = ": the autopilot lands by its own failsafe, unseen" if lands else ""
        return f"{self._interface if role == SIMULATOR else role} {what}{follows}"

    def _on_exit(self, role: str, code: int) -> None:
        exited = self._told(role, describe_exit(code))
        if self.cause or role in SHADOWS:
            if code < 0 and -code not in ending():
                complain(exited)
        elif role == RECORDER and self._patience.commanded and self._phase == FLYING and code != 0:
            complain(f"{exited}: the flight goes on, and what is flown from now on is not recorded")
        elif code != 0 and not (code > 0 and self._over):
            self.cause, self._deadline = exited, time.monotonic()
            if role != SIMULATOR and self._phase == FLYING:  # the others will notice
                self._deadline += self._patience.answer
        elif not self._early and self._phase == WAITING:  # a short flight may be over before anything of it is known
            self._early = f"{exited} before the flight began"
            self._deadline = min(self._deadline, time.monotonic() + _LEFT_EARLY)

    def _end(self) -> None:
        """Land what can be landed and was not asked to yet; stop everything else."""
        if not self.cause and self._phase == ENDED:
            self.late = tuple(self._processes.pids())
            self._processes.stop()
            return
        self.cause = self.cause or self._silent()
        if self._can_land and not self._lands:
            complain(f"{self.cause}: the vehicle lands")
            self._land()
        else:
            self._processes.stop()

    def _land(self) -> None:
        self._lands = True
        flies, now = self._phase == FLYING, time.monotonic()
        if self._patience.commanded and flies and not self._interrupted.names:
            self._watch.ask_to_end(self.cause)
        self._processes.interrupt_vehicle_interface()
        self._landed_by = now + self._patience.landing
        self._deadline = min(self._landed_by, now + self._patience.silence) if flies else now + self._patience.answer

    def _silent(self) -> str:
        """Return why a flight that is not heard of any more was stopped."""
        state = self.state
        if state is None or state.state == WAITING:
            why = state.reason if state else "no flight/state from the vehicle interface"
            return self._early or f"the flight did not start: {why}"
        if is_over(state):
            return f"the nodes did not leave after the flight had failed: {state.reason}"
        return f"flight/state: nothing from {self._interface} after step {state.step}"
