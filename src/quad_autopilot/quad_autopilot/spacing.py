"""Whether the autopilot's states come as the nodes were told: a law that computes with a wrong dt tumbles.

In real time a controller takes the time since its last answer for dt, but only between half and twice its announced
period (decision 1). So both must fit, or the flight does not begin.
"""

from collections.abc import Mapping, Sequence

LEAST = 40
"""Spacings that must be known."""


def misfit(
    plant_period: int, periods: Mapping[str, int], spacings: Sequence[int], source: str = "vehicle_odometry"
) -> str:
    """Return why states ``spacings`` ns apart do not fit, with the numbers; empty if they do.

    ``periods`` are the announced periods of the controllers in plant steps of ``plant_period`` ns; ``source`` names the
    states.
    """
    if len(spacings) < LEAST:
        return f"{source}: {len(spacings)} states so far, expected {LEAST}"
    ordered = sorted(spacings)
    # one state in ten may be lost on the way: that is no other rate
    shortest, longest = ordered[0], ordered[len(ordered) * 9 // 10 - 1]
    if shortest < plant_period:
        return (
            f"{source}: states {_ms(shortest)} apart, flight.plant_period is {_ms(plant_period)}; "
            "expected at most one state a period"
        )
    for role, steps in periods.items():
        announced = steps * plant_period
        # a state that comes before its time is skipped, and the next one answered
        taken = longest if shortest >= announced else announced - plant_period + longest
        if taken > 2 * announced:
            return (
                f"{source}: states {_ms(shortest)} to {_ms(longest)} apart, {role} is told "
                f"{steps} x {_ms(plant_period)} = {_ms(announced)} but would compute every {_ms(taken)}; "
                f"expected at most twice as long: raise flight.plant_period or {role}'s period_steps"
            )
    return ""


def age_report(ages: Sequence[int], source: str) -> str:
    """Return how old states are when the autopilot sends them, from their ``ages`` in ns."""
    ordered = sorted(ages) or [0]
    middle, late = ordered[len(ordered) // 2], ordered[len(ordered) * 9 // 10 - 1]
    return (
        f"{source}: states are {_ms(middle)} old when they are sent (one in ten over {_ms(late)}), the link not "
        "counted; prediction.*_age of the controllers is what they reckon with"
    )


def _ms(nanoseconds: int) -> str:
    return f"{nanoseconds / 1e6:g} ms"
