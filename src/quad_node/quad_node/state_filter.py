"""Which state a node accepts as the next one, and whether it saw the start of its flight. No ROS calls."""

import math

LARGEST_GAP = 0.5  # s between two states that follow each other
QUIET = 0.03  # s that another run of states goes on without one that follows the last; the guard waits for 0.05


class SequenceFilter:
    """``last``: the step that was accepted last, -1 before the first.

    One accepted state of an absurd step would make every later one old. So in real time a state far from the last one
    is accepted where none follows the last one any more: after a real gap, or when the last one was foreign. For how
    long is told by the other run's own steps, not by the clock on the wall: states come more slowly than that where a
    plant waits. In lockstep no state is lost: the step before the last gap is the one that the flight goes on from.
    """

    def __init__(self, plant_period: int, lockstep: bool = False) -> None:
        """No state has come; ``plant_period`` in ns."""
        self.last = -1
        self._lockstep = lockstep
        self._largest, self._quiet = LARGEST_GAP * 1e9 / plant_period, QUIET * 1e9 / plant_period
        self._elsewhere = self._since = -1
        self._before_gap = math.inf

    def allows(self, step: int) -> bool:
        """Return whether the state of ``step`` may come next: it follows the last one, or another run has for QUIET."""
        if self.last < 0 or 0 <= step - self.last <= self._largest:
            return True
        if self._lockstep:
            return 0 < step - self._before_gap <= self._largest
        before, self._elsewhere = self._elsewhere, step
        if not (before >= 0 and 0 <= step - before <= self._largest):
            self._since = step
        return step - self._since > self._quiet

    def is_far_ahead(self, step: int) -> bool:
        """Return whether ``step`` lies farther ahead of the last state than a message may."""
        return self.last >= 0 and step - self.last > self._largest

    def take(self, step: int) -> bool:
        """Accept ``step``; return whether the last one was another run's, whose later steps do not come."""
        is_back = step < self.last
        if is_back or step - self.last > self._quiet:
            self._before_gap = math.inf if is_back else self.last
        self.last, self._elsewhere = step, -1
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
