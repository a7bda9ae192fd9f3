"""Whether a node saw the start of its flight, or joins one that is under way. No ROS calls.

In lockstep the first state tells: a flight that begins has step 0. In real time the first state may be a later one (an
estimator that was on before the flight, a node that slept), so there the times decide: a flight starts after every node
is READY, so its start is later than this node's READY. Before both are known nothing is answered.
"""

import math
from enum import Enum


class Start(Enum):
    """What a node knows of the start of its flight."""

    UNKNOWN = "unknown"
    SEEN = "seen"
    MISSED = "missed"


class StartDetector:
    """When this node was ready, and when the flight began; times in s on the steady clock."""

    def __init__(self) -> None:
        """Know neither."""
        self._ready = self._began = math.inf
        self._heard = False

    def on_ready(self, now: float) -> None:
        """Note that this node has said READY."""
        self._ready = min(self._ready, now)

    def on_flight_state(self, is_flying: bool, wall_time: float, now: float) -> None:
        """Take in flight/state; ``wall_time``: s since step 0. A latched one may have been sent long before ``now``."""
        self._heard = True
        if is_flying:
            self._began = min(self._began, now - wall_time)

    def find(self, lockstep: bool, step: int) -> Start:
        """Return what the first state, that of ``step``, means."""
        if step == 0:
            return Start.SEEN
        if lockstep or self._began < self._ready:
            return Start.MISSED
        known = self._heard and self._ready < math.inf
        return Start.SEEN if known else Start.UNKNOWN
