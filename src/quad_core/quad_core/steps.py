"""Steps, stamps and seconds: integer nanoseconds outside the laws, seconds inside, converted here for all engines."""

import math


def seconds(nanoseconds: int) -> float:
    """Return a stamp or period in s, correctly rounded (``* 1e-9`` is not: 2.5 s would not be 2.5)."""
    return nanoseconds / 1e9


def end_step(duration: float, plant_period: int) -> int:
    """Return the first plant step that is no longer flown of a flight of ``duration`` s, at least 1.

    ``plant_period`` in ns.
    """
    steps = math.floor(duration * 1e9 / plant_period + 0.5)
    return steps if steps > 1 else 1
