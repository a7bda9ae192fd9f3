"""Limits and times of the guard: every default is a row of ``docs/explanation/safety.md``.

None can change in flight: a limit cannot be widened while it protects something.
"""

from typing import Annotated, NamedTuple

from quad_core.parameters import Flag, Real, Whole


class CommandLimits(NamedTuple):
    """What a wrench must be to reach the rotors, and how long the last good one may serve."""

    thrust_margin: Annotated[
        float,
        Real(
            "",
            "refused: thrust beyond this times the largest, or below minus that; the allocation holds the rest",
            1.0,
            1e6,
            "addition",
        ),
    ] = 2.0
    torque_margin: Annotated[
        float,
        Real(
            "",
            "refused: torque about an axis beyond this times the largest that four rotors make",
            1.0,
            1e9,
            "addition",
        ),
    ] = 100.0
    too_old: Annotated[
        float, Real("s", "refused: it answers a state so far behind the newest one", 0.001, 10.0, "addition")
    ] = 0.1
    warn_age: Annotated[
        float, Real("s", "warning: the last good wrench has not answered a state for longer", 0.001, 10.0)
    ] = 0.02
    lost_age: Annotated[
        float, Real("s", "backup law: the last good wrench has not answered a state for longer", 0.001, 10.0)
    ] = 0.05


class StateLimits(NamedTuple):
    """What a state sample must be to be accepted, and how long the last accepted one may serve."""

    ahead: Annotated[float, Real("s", "refused: a sample so far ahead of the vehicle's own time", 0.0, 10.0, "MRS")] = (
        0.5
    )
    position_jump: Annotated[
        float, Real("m", "refused: so far from where the last sample's velocity leads", 0.01, 1e4, "ArduPilot")
    ] = 1.0
    attitude_jump: Annotated[
        float, Real("rad", "refused: turned so far from where the last sample's rates lead", 0.01, 3.2, "ArduPilot")
    ] = 0.3490658503988659
    refused_count: Annotated[
        int, Whole("", "so many refused samples within the window end the controller's flight", 1, 1000, "ArduPilot")
    ] = 10
    refused_window: Annotated[
        float, Real("s", "the window in which refused samples are counted", 0.01, 10.0, "ArduPilot")
    ] = 0.2
    frozen_motion: Annotated[
        float,
        Real(
            "m, m/s, rad, rad/s",
            "a repeated sample is frozen once a live one had changed by more, and by two of the least steps it takes",
            0.0,
            10.0,
            "addition",
        ),
    ] = 1e-9
    warn_age: Annotated[float, Real("s", "warning: the last accepted sample is older", 0.001, 10.0, "MRS")] = 0.05
    lost_age: Annotated[float, Real("s", "backup law: the last accepted sample is older", 0.001, 10.0, "MRS")] = 0.1
    blind_age: Annotated[
        float, Real("s", "sink faster: the last accepted sample and body rate are older", 0.001, 100.0, "MRS")
    ] = 0.5
    gone_age: Annotated[
        float, Real("s", "motors off: the last accepted sample and body rate are older", 0.001, 100.0, "addition")
    ] = 3.0


class TiltLimits(NamedTuple):
    """How far the vehicle may lean, how long, and where motors off is the lesser evil."""

    large: Annotated[float, Real("rad", "tilt that may not last", 0.1, 3.2, "PX4 FailureDetector")] = 1.0471975511965976
    large_time: Annotated[
        float, Real("s", "backup law: tilt above ``large`` for longer", 0.0, 100.0, "PX4 FailureDetector")
    ] = 0.3
    extreme: Annotated[float, Real("rad", "tilt of a vehicle that falls over", 0.1, 3.2, "MRS")] = 1.3089969389957472
    extreme_time: Annotated[
        float, Real("s", "backup law or motors off: tilt above ``extreme`` for longer", 0.0, 100.0, "MRS")
    ] = 0.1
    low_height: Annotated[
        float, Real("m", "extreme tilt below this height above the ground: motors off", 0.0, 100.0, "")
    ] = 1.0


class BackupLaw(NamedTuple):
    """The guard's own law: bandwidths, speeds and limits."""

    attitude_bandwidth: Annotated[
        float, Real("rad/s", "natural frequency of roll and pitch", 0.1, 100.0, "addition")
    ] = 8.0
    attitude_damping: Annotated[float, Real("", "damping ratio of roll and pitch", 0.1, 10.0, "")] = 0.9
    yaw_rate_bandwidth: Annotated[float, Real("rad/s", "bandwidth of yaw-rate damping", 0.1, 100.0, "addition")] = 3.0
    velocity_bandwidth: Annotated[
        float, Real("rad/s", "bandwidth of the horizontal velocity", 0.01, 10.0, "addition")
    ] = 1.2
    vertical_bandwidth: Annotated[
        float, Real("rad/s", "bandwidth of the vertical velocity", 0.01, 20.0, "addition")
    ] = 4.0
    vertical_integral: Annotated[
        float, Real("1/s^2", "integral gain of the vertical velocity", 0.0, 100.0, "addition")
    ] = 2.0
    brake_tilt: Annotated[float, Real("rad", "largest tilt used to stop above walking pace", 0.01, 0.8, "addition")] = (
        0.35
    )
    landing_tilt: Annotated[
        float, Real("rad", "largest tilt used below walking pace: that of touchdown", 0.01, 0.8, "addition")
    ] = 0.15
    walking_pace: Annotated[
        float, Real("m/s", "horizontal speed below which the vehicle descends", 0.05, 10.0, "addition")
    ] = 0.6
    descent_speed: Annotated[float, Real("m/s", "speed of the controlled descent", 0.05, 5.0, "PX4 MPC_LAND_SPEED")] = (
        0.8
    )
    blind_thrust: Annotated[
        float, Real("", "thrust over weight without a velocity that can be trusted", 0.5, 1.0, "PX4")
    ] = 0.94
    unseen_thrust: Annotated[
        float, Real("", "thrust over weight without any state for ``blind_age``", 0.2, 1.0, "addition")
    ] = 0.7
    lowest_thrust: Annotated[float, Real("", "least thrust over weight in the air", 0.0, 1.0, "addition")] = 0.2
    torque_thrust: Annotated[
        float,
        Real(
            "",
            "limit, in weights, on the thrust that roll and pitch torque may add; keep below 1 or the vehicle climbs",
            0.1,
            1.0,
            "addition",
        ),
    ] = 0.7
    torque_bandwidth: Annotated[
        float, Real("rad/s", "bandwidth of the observer of unknown torque", 0.1, 100.0, "addition")
    ] = 15.0
    torque_found: Annotated[
        float,
        Real(
            "",
            "unknown roll or pitch torque, in hover torques of one rotor, from which on it is compensated",
            0.01,
            10.0,
            "addition",
        ),
    ] = 0.2
    thrust_share: Annotated[
        float,
        Real("", "largest thrust of the backup law over the largest there is: the rest makes torque", 0.1, 1.0, ""),
    ] = 0.9


class ContactRule(NamedTuple):
    """When the vehicle stands on the ground, and when the backup law may stop the motors."""

    speed: Annotated[float, Real("m/s", "slower: at rest", 0.001, 1.0, "addition")] = 0.1
    thrust: Annotated[
        float, Real("", "thrust over weight below which the ground carries the vehicle", 0.05, 1.0, "")
    ] = 0.7
    time: Annotated[float, Real("s", "at rest for so long while descending: contact", 0.05, 10.0, "addition")] = 0.5
    ramp: Annotated[float, Real("s", "time in which thrust goes down after contact", 0.05, 10.0, "addition")] = 0.5
    stop_height: Annotated[
        float, Real("m", "motors never stop higher above the ground than this", 0.0, 10.0, "addition")
    ] = 0.3


class GuardParameters(NamedTuple):
    """All parameters of the guard; ``ground_height`` is where the flight began unless said otherwise."""

    enabled: Annotated[bool, Flag("whether the guard stands between the command and the rotors")] = True
    command: CommandLimits = CommandLimits()
    state: StateLimits = StateLimits()
    tilt: TiltLimits = TiltLimits()
    backup: BackupLaw = BackupLaw()
    contact: ContactRule = ContactRule()
    ground_height: Annotated[float, Real("m", "height of the ground, world frame", -1e4, 1e4, "addition")] = 0.0
    has_commander: Annotated[
        bool, Flag("a commander flies above: it lands where the position is good; else the guard descends")
    ] = False
    settle_time: Annotated[
        float,
        Real(
            "s",
            "commands and state must be good for this long before the controllers get the vehicle back",
            0.0,
            10.0,
            "addition",
        ),
    ] = 0.2
    release_tilt: Annotated[
        float, Real("rad", "no release to the controller at a larger tilt", 0.01, 1.5, "addition")
    ] = 0.5235987755982988
