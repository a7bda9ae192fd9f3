"""Whether a node was there when its flight began, or comes into one that is under way. No ROS calls.

In lockstep the first state tells: a flight that begins has step 0. In real time a first state may be a later one (an
estimator that was on before the flight, a node that slept), so there the times do: a flight begins only when all have
said READY, so it is younger than every one of its nodes is ready. Before both are known nothing is answered.
"""

import math
from enum import Enum


class Place(Enum):
    """What a node knows of its place in the flight."""

    UNKNOWN = "unknown"
    FROM_THE_START = "from the start"
    LATE = "late"


class Joining:
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

    def place(self, lockstep: bool, step: int) -> Place:
        """Return what the first state, that of ``step``, means."""
        if step == 0:
            return Place.FROM_THE_START
        if lockstep or self._began < self._ready:
            return Place.LATE
        known = self._heard and self._ready < math.inf
        return Place.FROM_THE_START if known else Place.UNKNOWN
