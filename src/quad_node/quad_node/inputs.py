"""What has come of the topics that a step needs beside the state."""

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
    """What has come of one topic that a step needs beside the state."""

    def __init__(self, topic: str, lag: int, role: str) -> None:
        """``lag`` 0: the value whose [step, next_step) holds the step; 1: of the step before. ``role`` gives it."""
        self.topic, self.lag, self.role = topic, lag, role
        self.one_step = "next_step" not in topics.TOPICS[topic].type.get_fields_and_field_types()
        self._arrivals: deque[Arrival] = deque(maxlen=_KEPT_ARRIVALS)

    def put(self, arrival: Arrival) -> None:
        """Keep a value."""
        self._arrivals.append(arrival)

    def newest(self) -> Arrival | None:
        """Return the value that came last."""
        return self._arrivals[-1] if self._arrivals else None

    def has_run_out(self, step: int, period: int) -> bool:
        """Return whether the newest value, of a topic without lag, was for steps before ``step``.

        ``period``: steps between two answers of who takes it. Where it answers more often than the value comes, a value
        that is one step old is no reason to wait.
        """
        newest = self.newest()
        return newest is not None and newest.next_step <= step and newest.next_step - newest.step <= period

    def is_past(self, step: int) -> bool:
        """Return whether values of later steps have come: what ``step`` lacks now never comes."""
        return bool(self._arrivals) and self._arrivals[-1].step > step - self.lag

    def at(self, step: int) -> Arrival | None:
        """Return the value that belongs to ``step``, None if it has not come."""
        due = step - self.lag
        for arrival in reversed(self._arrivals):
            if arrival.step <= due < arrival.next_step:
                return arrival
        return None


def age(arrival: Arrival) -> float:
    """Return how long ago a value came, s on the steady clock."""
    return time.monotonic() - arrival.arrived
