"""The parameters that the bridges to autopilots share: the way from the ground to the flight and back."""

from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Real, Whole

ThrustCurve = Annotated[
    float, Real("", "k of the motors' true curve, thrust / T_m = k u^2 + (1 - k) u; 0: linear", 0.0, 1.0)
]
ResetLimit = Annotated[
    float,
    Real("m", "largest jump at a reset of the estimate that is tolerated, with an event; beyond: land", 0.0, 100.0),
]


def rates(plant_period: int) -> tuple[str, ...]:
    """Return what the other nodes need: states every ``plant_period`` ns, and an answer to every second one."""
    nodes = ("trajectory", "position_controller", "attitude_controller")
    return (f"flight.plant_period={plant_period}", *(f"{node}.period_steps=2" for node in nodes))


class Flier(IntEnum):
    """What flies a take-off or a landing."""

    OURS = 0
    AUTOPILOT = 1


class ArmingParameters(NamedTuple):
    """The way from the ground to the flight and back (``arming.*``)."""

    beats: Annotated[int, Whole("", "setpoints sent, one every 20 ms, before the mode is requested", 1, 10_000)] = 25
    answer_timeout: Annotated[
        float, Real("s", "time without an answer after which a command is sent again", 0.05, 10.0)
    ] = 0.5
    speed: Annotated[
        float,
        Real("m/s", "speed, by velocity or change of position, above which the bridge does not arm", 0.01, 10.0),
    ] = 0.15
    step_timeout: Annotated[
        float, Real("s", "longest time for the mode, and again for arming, before both are given up", 0.1, 600.0)
    ] = 10.0
    spool_up: Annotated[
        float,
        Real("s", "the autopilot's time from armed to the first state of the flight", 0.0, 60.0, "COM_SPOOLUP_TIME"),
    ] = 1.0
    first_command: Annotated[float, Real("s", "time that the controllers have for their first command", 0.02, 10.0)] = (
        0.5
    )
    command_timeout: Annotated[
        float, Real("s", "age of the newest command after which the stream stops and the autopilot lands", 0.01, 0.08)
    ] = 0.06
    state_timeout: Annotated[float, Real("s", "time without a state after which the autopilot lands", 0.02, 10.0)] = 0.1
    land_timeout: Annotated[
        float, Real("s", "longest time for the landing; the autopilot is left alone after it", 1.0, 3600.0)
    ] = 60.0
    takeoff: Annotated[int, Choice(Flier, "with a commander: what flies the take-off (autopilot: NAV_TAKEOFF)")] = (
        Flier.OURS.value
    )
    landing: Annotated[
        int, Choice(Flier, "with a commander: what flies mode LAND (autopilot: NAV_LAND, to its end)")
    ] = Flier.AUTOPILOT.value
