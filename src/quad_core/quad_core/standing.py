"""Whether an estimate rests while its vehicle stands on the ground, by its velocity and by how its position changes."""

from collections import deque

from quad_core.geometry import norm, subtract, total
from quad_core.types import VehicleState

WINDOW = 1.0
"""s of states that are looked at."""
LEAST = 0.5
"""s of them that must be known."""


class Standing:
    """The states of the last WINDOW s."""

    def __init__(self) -> None:
        """Start with none."""
        self._seen: deque[tuple[float, VehicleState]] = deque()

    def note(self, time: float, state: VehicleState) -> None:
        """Take in a state of ``time`` s."""
        self._seen.append((time, state))
        while self._seen[0][0] < time - WINDOW:
            self._seen.popleft()

    def refusal(self, limit: float, source: str) -> str:
        """Return why the vehicle must not take off, empty if it may; ``limit`` in m/s, ``source`` names the states.

        An estimate at rest shows neither a mean velocity nor a position that moves.
        """
        known = self._seen[-1][0] - self._seen[0][0] if self._seen else 0.0
        if known < LEAST:
            return f"{source}: found states over {known:.1f} s, expected {LEAST:g} s of them at rest"
        states = [state for _, state in self._seen]
        drift = norm(subtract(states[-1].p_w, states[0].p_w)) / known
        speed = norm(total(state.v_w for state in states)) / len(states)
        if max(drift, speed) < limit:
            return ""
        return (
            f"{source}: the estimate moves while the vehicle stands: found its position at {drift:.2f} m/s, "
            f"its velocity {speed:.2f} m/s, expected less than {limit:g} m/s"
        )
