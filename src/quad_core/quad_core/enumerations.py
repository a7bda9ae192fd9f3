"""The numbers that messages and parameters carry for modes, requests, reasons and states, each named once.

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


ON_GROUND = (Mode.DISARMED, Mode.ARMING)  # the modes before take-off and after landing


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


class GuardMode(IntEnum):
    """What the guard does (`GuardStatus.mode`)."""

    PASS = 0  # the controller's wrench reaches the rotors
    DESCEND = 1  # the backup law flies
    KILL = 2  # motors off, for good


class GuardRequest(IntEnum):
    """What the commander asks of the guard (`FlightMode.guard_request`)."""

    NONE = 0
    RELEASE = 1
    DESCEND = 2
    KILL = 3


class GuardReason(IntEnum):
    """Why a mode of the guard was entered (`GuardStatus.reason`), the more severe later; from STATE_GONE on KILL."""

    GOOD = 0
    WRENCH_LOST = 1
    STATE_LOST = 2
    STATE_REFUSED = 3
    HEADING = 4
    TILT = 5
    SPIN = 6
    STEP_TILT = 7
    STEP_SPEED = 8
    STEP_BOX = 9
    REQUESTED = 10
    EXTREME_TILT = 11
    STATE_GONE = 12
    EXTREME_TILT_LOW = 13
    REQUESTED_KILL = 14


class CommandRefusal(IntEnum):
    """The first rule that a wrench breaks; ``quad_guard.checks`` has the rules and their words."""

    ACCEPTED = 0
    NOT_FINITE = 1
    NOT_NEWER = 2
    AHEAD = 3
    TOO_OLD = 4
    THRUST = 5
    TORQUE = 6


class StateRefusal(IntEnum):
    """The first rule that a state breaks."""

    ACCEPTED = 0
    NOT_FINITE = 1
    NOT_NEWER = 2
    AHEAD = 3
    POSITION_JUMP = 4
    ATTITUDE_JUMP = 5
    FROZEN = 6


class NodeState(IntEnum):
    """What a node says of itself (`NodeStatus.state`)."""

    STARTING = 0
    READY = 1
    FAULT = 3
    DONE = 4


class FlightClock(IntEnum):
    """What a flight waits for (`flight.mode`)."""

    LOCKSTEP = 0  # the plant waits for every command
    REALTIME = 1


class FlightPhase(IntEnum):
    """Where a flight is between its start and its end (`FlightState.state`)."""

    WAITING = 0
    FLYING = 1
    ENDED = 2
    FAILED = 3
