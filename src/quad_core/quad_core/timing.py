"""Steps and seconds. Time is counted in plant steps of integer nanoseconds; seconds are made here and only here."""

import math


def seconds(steps: int, plant_period: int) -> float:
    """Return the time of ``steps`` plant steps of ``plant_period`` ns in s, correctly rounded (``* 1e-9`` is not)."""
    return steps * plant_period / 1e9


def steps_to_cover(duration: float, plant_period: int) -> int:
    """Return the fewest plant steps (at least 1) that cover ``duration`` s, to a millionth of a step."""
    count = math.ceil(duration * 1e9 / plant_period - 1e-6)
    if count < 1:
        return 1
    return count
