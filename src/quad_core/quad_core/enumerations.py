"""The numbers that messages carry for a mode, a request, its answer and the phase of a flight, each named once.

``quad_msgs`` has the same constants for nodes of others; a test holds both against each other.
"""

from enum import IntEnum


class Mode(IntEnum):
    """What the vehicle does (`FlightMode.mode`); ``quad_commander.mode_table.MODES`` says how severe each is."""

    DISARMED = 0
    ARMING = 1
    TAKEOFF = 2
    MISSION = 3
    HOLD = 4
    LAND = 5
    DESCEND = 6
    PILOT = 7
    KILL = 8


ON_GROUND = (Mode.DISARMED, Mode.ARMING)
"""The modes before take-off and after landing."""


class Request(IntEnum):
    """What an operator, a mission or a node may ask the commander for (`FlightRequest.request`)."""

    NONE = 0
    ARM = 1
    TAKEOFF = 2
    MISSION = 3
    HOLD = 4
    LAND = 5
    DESCEND = 6
    DISARM = 7
    KILL = 8
    END = 9  # land, disarm on contact, end the flight
    GOTO = 10


class Answer(IntEnum):
    """What became of the last request (`FlightMode.answer`)."""

    NOT_ASKED = 0
    DONE = 1
    REFUSED = 2


class FlightPhase(IntEnum):
    """Where a flight is between its start and its end (`FlightState.state`)."""

    WAITING = 0
    FLYING = 1
    ENDED = 2
    FAILED = 3
