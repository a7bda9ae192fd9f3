"""How far our plant may run ahead of PX4's states and the controllers' answers to them.

PX4's odometry comes every 8 to 16 ms of its time, through an agent that takes a while by the clock on the wall. So the
plant stands still until every answer to the last state is out; it then runs freely to where the next state may be due
at the earliest, waits a little there before each further step, and at the largest spacing known waits much longer.
"""

from collections import deque
from collections.abc import Mapping
from enum import IntEnum

from quad_mavlink.parameters import GateParameters

_KNOWN = 200
_ONE_CLOCK = 30.0  # s; stamps farther behind are of another clock


class Decision(IntEnum):
    """What the plant does: ``OVERDUE`` goes on, too, but a state seems lost; ``UNANSWERED`` ends the flight."""

    GO = 0
    WAIT = 1
    OVERDUE = 2
    UNANSWERED = 3


class Gate:
    """Knows which states came and what has been answered; times in us of PX4, waits in s on the wall."""

    LARGEST_LAG = 0.5  # seconds; a stamp farther from our clock is late, or of another clock

    def __init__(self, parameters: GateParameters) -> None:
        self._parameters = parameters
        self._periods: dict[str, int] = {}
        self._due: dict[str, int] = {}
        self._open: dict[str, int] = {}
        self._stamp = -1
        self._given_up = -1
        self._spacings: deque[int] = deque(maxlen=_KNOWN)
        self._lags: deque[int] = deque(maxlen=_KNOWN)

    def expect(self, periods: Mapping[str, int]) -> None:
        """Expect an answer on each topic of ``periods`` once in so many plant steps."""
        self._periods, self._due = dict(periods), dict.fromkeys(periods, 0)

    def on_state(self, stamp: int, now: int) -> None:
        """Take note of a state of time ``stamp`` that came when the plant's clock said ``now``."""
        if not self.is_of_our_clock(stamp, now):
            return
        if 0 <= self._stamp < stamp:
            self._spacings.append(stamp - self._stamp)
        self._lags.append(now - stamp)
        self._stamp = stamp

    @staticmethod
    def is_of_our_clock(stamp: int, now: int) -> bool:
        """Return whether ``stamp`` can be PX4's time when the plant's clock says ``now``."""
        return 0 <= 1e-6 * (now - stamp) <= Gate.LARGEST_LAG

    def on_published(self, step: int) -> None:
        """Expect the answers to the state of ``step``: a controller passes over states within its period."""
        for topic, due in self._due.items():
            if step >= due:
                self._open[topic] = step
                self._due[topic] = step + self._periods[topic]

    def on_answer(self, topic: str, step: int) -> None:
        """Take note of an answer to the state of ``step``."""
        if step >= self._open.get(topic, step + 1):
            del self._open[topic]

    @property
    def missing(self) -> str:
        """The topics whose answer to the last state is still to come."""
        return ", ".join(self._open)

    def decide(self, following: int, idle: float, is_flying: bool) -> Decision:
        """Return whether the reading of time ``following`` may go out, ``idle`` s after the last step.

        Before and after the flight (not ``is_flying``) no answer is awaited, and a state only for a moment.
        """
        if is_flying and self._open:
            return Decision.UNANSWERED if idle > self._parameters.answer_timeout else Decision.WAIT
        if self._stamp < 0:
            return Decision.GO
        lag, spacings = min(self._lags), self._spacings or (0,)
        ahead = following - self._stamp - lag
        if ahead <= min(spacings):
            return Decision.GO
        if ahead <= max(spacings) or not is_flying or self._given_up == self._stamp:
            return Decision.GO if idle >= self._parameters.linger else Decision.WAIT
        if idle < self._parameters.overdue:
            return Decision.WAIT
        self._given_up = self._stamp
        return Decision.OVERDUE


def foreign_stamp(stamp: int, now: int) -> str:
    """Return why an estimate of time ``stamp`` cannot be flown when the plant's clock says ``now``; both in us."""
    behind = 1e-6 * (now - stamp)
    if 0.0 <= behind <= _ONE_CLOCK:
        return (
            f"vehicle_odometry: {behind:.2f} s behind PX4's clock, expected at most {Gate.LARGEST_LAG:g} s: "
            "the agent or this machine is too slow, or the agent still sends what it held"
        )
    return (
        f"vehicle_odometry: timestamp_sample {stamp} us, PX4's clock {now} us: stamps of another clock, expected "
        "UXRCE_DDS_SYNCT 0, and an agent that was started with this PX4"
    )
