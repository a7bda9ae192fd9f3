"""The flight's time as its recorder knows it: the newest stamp that can be true."""

_SLACK = 2_000_000_000  # ns: what publishers keep for a recorder that was stopped, and the window of the lockstep
_PACE = 2.0  # flight time over steady time, at most, while nothing came


class FlightClock:
    """``newest``: the largest stamp in ns that was accepted; a foreign node's far-future one must not move it."""

    def __init__(self, now: float) -> None:
        """Begin at stamp 0; ``now`` in s on the steady clock, as below."""
        self.newest = 0
        self._moved = now

    def believes(self, stamp_ns: int, now: float) -> bool:
        """Return whether a message of ``stamp_ns`` can belong to the flight, and move the clock there if it can."""
        if stamp_ns > self.newest:
            if stamp_ns - self.newest > _SLACK + _PACE * 1e9 * (now - self._moved):
                return False
            self.newest, self._moved = stamp_ns, now
        return True
