"""What has arrived of the topics that a step needs in addition to the state."""

import time
from collections import deque
from typing import Any, NamedTuple

from quad_node import topics

_KEPT_ARRIVALS = 64


class Arrival(NamedTuple):
    """A value of an input topic: the steps [``step``, ``next_step``) that it holds for, when it came (steady s)."""

    step: int
    next_step: int
    value: Any
    arrived: float


class InputTopic:
    """What has arrived of one topic that a step needs in addition to the state."""

    def __init__(self, topic: str, lag: int) -> None:
        """``lag`` 0: the value whose [step, next_step) holds the step; 1: of the step before."""
        self.topic, self.lag = topic, lag
        self.one_step = "next_step" not in topics.TOPICS[topic].type.get_fields_and_field_types()
        self._arrivals: deque[Arrival] = deque(maxlen=_KEPT_ARRIVALS)

    def put(self, arrival: Arrival) -> None:
        """Keep a value."""
        self._arrivals.append(arrival)

    def newest(self) -> Arrival | None:
        """Return the value that came last."""
        return self._arrivals[-1] if self._arrivals else None

    def at(self, step: int) -> Arrival | None:
        """Return the value that belongs to ``step``, None if it has not come."""
        due = step - self.lag
        for arrival in reversed(self._arrivals):
            if arrival.step <= due < arrival.next_step:
                return arrival
        return None

    def now(self, period: int, is_due: bool) -> Arrival | None:
        """Return the newest value if a step in real time need not wait for its own.

        ``period``: plant steps between two answers of the node. A slower input does not delay it, nor one of a step
        before; another one does until the step ``is_due``.
        """
        newest = self.newest()
        waits = newest is not None and not (is_due or self.lag or newest.next_step - newest.step > period)
        return None if waits else newest

    def is_lost(self, step: int) -> bool:
        """Return whether the value that belongs to ``step`` never comes: later ones have."""
        newest = self.newest()
        return newest is not None and newest.step > step - self.lag and self.at(step) is None


def age(arrival: Arrival) -> float:
    """Return how long ago a value came, s on the steady clock."""
    return time.monotonic() - arrival.arrived
