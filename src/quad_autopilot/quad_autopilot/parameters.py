"""The parameters that the bridges to autopilots share: the way from the ground to the flight and back."""

from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Real, Whole

RotorThrust = Annotated[float, Real("N", "largest thrust of a rotor, measured; 0: refused", 0.0, 1e4, "T_m")]
ThrustCurve = Annotated[
    float, Real("", "k of the motors' true curve, thrust / T_m = k u^2 + (1 - k) u; 0: linear", 0.0, 1.0)
]
ResetLimit = Annotated[float, Real("m", "largest jump of the estimate that is flown through; beyond: HOLD", 0.0, 100.0)]


def rates(plant_period: int) -> tuple[str, ...]:
    """Return what the other nodes need: states every ``plant_period`` ns, and an answer to every second one."""
    nodes = ("trajectory", "position_controller", "attitude_controller", "commander")
    return (f"flight.plant_period={plant_period}", *(f"{node}.period_steps=2" for node in nodes))


class Flier(IntEnum):
    """What flies a take-off or a landing."""

    OURS = 0
    AUTOPILOT = 1


class ArmingParameters(NamedTuple):
    """The way from the ground to the flight and back (``arming.*``)."""

    beats: Annotated[int, Whole("", "setpoints sent, one every 20 ms, before the mode is requested", 1, 10_000)] = 25
    answer_timeout: Annotated[float, Real("s", "time after which an unanswered command is repeated", 0.05, 10.0)] = 0.5
    speed: Annotated[float, Real("m/s", "speed (velocity, change of position) that forbids arming", 0.01, 10.0)] = 0.15
    step_timeout: Annotated[float, Real("s", "longest time for the mode, and again for arming", 0.1, 600.0)] = 10.0
    spool_up: Annotated[
        float, Real("s", "time from armed until commands are followed", 0.0, 60.0, "COM_SPOOLUP_TIME")
    ] = 1.0
    command_timeout: Annotated[float, Real("s", "age of the newest command at which it lands", 0.01, 0.08)] = 0.06
    state_timeout: Annotated[float, Real("s", "time without a state after which the autopilot lands", 0.02, 10.0)] = 0.1
    land_timeout: Annotated[float, Real("s", "longest landing; then the autopilot is left alone", 1.0, 3600.0)] = 60.0
    takeoff: Annotated[int, Choice(Flier, "what flies TAKEOFF; autopilot: NAV_TAKEOFF")] = Flier.OURS.value
    landing: Annotated[int, Choice(Flier, "what flies LAND; autopilot: NAV_LAND")] = Flier.AUTOPILOT.value
