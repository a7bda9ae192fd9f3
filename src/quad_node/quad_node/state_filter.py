"""Which state a node accepts as the next one, and whether it saw the start of its flight. No ROS calls."""

import math

LARGEST_GAP = 0.5  # s between two states that follow each other
QUIET = 0.03  # s without a state that follows, from which on another run of them is accepted; the guard waits for 0.05


class SequenceFilter:
    """``last``: the step that was accepted last, -1 before the first. Times in s on the steady clock.

    One accepted state of an absurd step would make every later one old. So a state far from the last one is accepted
    only where no state follows the last one any more: after a real gap, or when the last one was foreign.
    """

    def __init__(self, plant_period: int) -> None:
        """No state has come; ``plant_period`` in ns."""
        self.last = -1
        self._largest = LARGEST_GAP * 1e9 / plant_period
        self._accepted = -math.inf
        self._elsewhere = -1

    def allows(self, step: int, now: float) -> bool:
        """Return whether the state of ``step`` may come next: it follows the last one, or another run of them does.

        Of another run the second state counts, once no state has followed the last one for ``QUIET``.
        """
        if self.last < 0 or 0 <= step - self.last <= self._largest:
            return True
        before, self._elsewhere = self._elsewhere, step
        is_run = before >= 0 and 0 <= step - before <= self._largest
        return is_run and now - self._accepted > QUIET

    def is_far_ahead(self, step: int) -> bool:
        """Return whether ``step`` lies farther ahead of the last state than a message may."""
        return self.last >= 0 and step - self.last > self._largest

    def take(self, step: int, now: float) -> bool:
        """Accept ``step``; return whether the last one was another run's, whose later steps do not come."""
        is_back, self.last, self._accepted = step < self.last, step, now
        return is_back


def saw_start(lockstep: bool, step: int, ready: float, began: float | None) -> bool | None:
    """Return whether the first state, that of ``step``, is of a flight that began with this node; None: unknown.

    ``ready``: when this node was READY, inf: never. ``began``: when the flight did by flight/state, inf: not yet, None:
    none has come. In lockstep a flight begins with step 0. In real time the first state may be a later one (of an
    estimator that was on before, or to a node that the system stopped); a flight starts after every node is READY.
    """
    if step == 0:
        return True
    if lockstep or (began is not None and began < ready):
        return False
    return None if began is None or ready == math.inf else True
