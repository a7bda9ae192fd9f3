"""Whether an estimate rests while its vehicle stands on the ground, by its velocity and by how its position changes."""

from collections import deque
from typing import NamedTuple

from quad_core.geometry import norm, subtract, total
from quad_core.types import Vec3, VehicleState

WINDOW = 1.0
"""s of states that are looked at."""
LEAST = 0.5
"""s of them that must be known."""


class _Seen(NamedTuple):
    time: float
    p_w: Vec3
    v_w: Vec3


class Standing:
    """The states of the last WINDOW s."""

    def __init__(self) -> None:
        """Start with none."""
        self._seen: deque[_Seen] = deque()

    def note(self, time: float, state: VehicleState) -> None:
        """Take in a state of ``time`` s."""
        self._seen.append(_Seen(time, state.p_w, state.v_w))
        while self._seen[0].time < time - WINDOW:
            self._seen.popleft()

    @property
    def known(self) -> float:
        """Time in s over which states are known, at most WINDOW."""
        return self._seen[-1].time - self._seen[0].time if self._seen else 0.0

    @property
    def drift(self) -> float:
        """How fast the position moved over that time in m/s."""
        if self.known <= 0.0:
            return 0.0
        return norm(subtract(self._seen[-1].p_w, self._seen[0].p_w)) / self.known

    @property
    def speed(self) -> float:
        """Length of the mean velocity over that time in m/s."""
        return norm(total(one.v_w for one in self._seen)) / max(len(self._seen), 1)

    @property
    def motion(self) -> float:
        """The larger of drift and speed in m/s: what an estimate at rest does not show."""
        return max(self.drift, self.speed)

    def refusal(self, limit: float, source: str) -> str:
        """Return why the vehicle must not take off, empty if it may; ``limit`` in m/s, ``source`` names the states."""
        if self.known < LEAST:
            return f"{source}: found states over {self.known:.1f} s, expected {LEAST:g} s of them at rest"
        if self.motion < limit:
            return ""
        return (
            f"{source}: the estimate moves while the vehicle stands: found its position at {self.drift:.2f} m/s, "
            f"its velocity {self.speed:.2f} m/s, expected less than {limit:g} m/s"
        )
