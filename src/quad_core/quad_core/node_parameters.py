"""The parameters of each node, without those of the plug-in that it runs, and those of the guard.

The guard's are limits and times that a vehicle may need otherwise; each is a row of ``docs/explanation/safety.md``.
None can change in flight: a limit cannot be widened while it protects something.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Flag, Real, Text, Whole


class CommandLimits(NamedTuple):
    """What a wrench must be to reach the rotors, and how long the last good one may serve."""

    too_old: Annotated[float, Real("s", "a wrench that answers an older state is refused", 0.001, 10.0)] = 0.1
    warn_age: Annotated[float, Real("s", "age of the last good wrench: the guard warns", 0.001, 10.0)] = 0.02
    lost_age: Annotated[float, Real("s", "age of the last good wrench: the backup law flies", 0.001, 10.0)] = 0.05


class StateLimits(NamedTuple):
    """What a state sample must be to be accepted, and how long the last accepted one may serve."""

    ahead: Annotated[float, Real("s", "a sample so far ahead of the vehicle's time is refused", 0.0, 10.0, "MRS")] = 0.5
    position_jump: Annotated[float, Real("m", "a sample this far off its prediction is refused", 0.01, 1e4)] = 1.0
    attitude_jump: Annotated[float, Real("rad", "a sample this far off is refused", 0.01, 3.2)] = math.radians(20.0)
    warn_age: Annotated[float, Real("s", "age of the accepted sample: thrust passes, torque not", 0.001, 10.0)] = 0.05
    lost_age: Annotated[float, Real("s", "age of the accepted sample: the backup law flies", 0.001, 10.0, "MRS")] = 0.1
    blind_age: Annotated[float, Real("s", "age of sample and body rate: it falls, and brakes late", 0.001, 100.0)] = 0.1
    gone_age: Annotated[float, Real("s", "age of sample and body rate: the motors stop", 0.001, 100.0)] = 3.0


class TiltLimits(NamedTuple):
    """How far the vehicle may lean, how long, and where motors off is the lesser evil."""

    large: Annotated[float, Real("rad", "tilt above which large_time counts", 0.1, 3.2, "PX4")] = math.radians(60.0)
    large_time: Annotated[float, Real("s", "time above tilt.large until the backup law flies", 0.0, 100.0, "PX4")] = 0.3
    extreme: Annotated[float, Real("rad", "tilt above which extreme_time counts", 0.1, 3.2, "MRS")] = math.radians(75.0)
    extreme_time: Annotated[float, Real("s", "time above tilt.extreme until the same or motors off", 0.0, 100.0)] = 0.1
    low_height: Annotated[float, Real("m", "below it over the ground extreme tilt stops the motors", 0.0, 100.0)] = 1.0


class ContactRule(NamedTuple):
    """When the vehicle stands on the ground, and when the backup law may stop the motors."""

    speed: Annotated[float, Real("m/s", "speed below which it is at rest", 0.001, 1.0)] = 0.1
    thrust: Annotated[float, Real("", "thrust over weight below which the ground carries it", 0.05, 1.0)] = 0.7
    time: Annotated[float, Real("s", "time at rest while descending that is contact", 0.05, 10.0)] = 0.5
    ramp: Annotated[float, Real("s", "time in which thrust goes down after contact", 0.05, 10.0)] = 0.5
    stop_height: Annotated[float, Real("m", "motors never stop higher above the ground", 0.0, 10.0)] = 0.3


class StepLimits(NamedTuple):
    """What a first flight in steps may do; beyond tilt, speed or box the vehicle is handed back at once."""

    tilt: Annotated[float, Real("rad", "largest tilt; from pi on: off", 0.01, 3.2)] = 3.2
    speed: Annotated[float, Real("m/s", "largest speed; 1e6: off", 0.01, 1e6)] = 1e6
    box: Annotated[float, Real("m", "farthest along x and y from the take-off, and above it; 1e6: off", 0.1, 1e6)] = 1e6
    least_thrust: Annotated[float, Real("", "least thrust over weight in the air; -1e6: off", -1e6, 1.0)] = -1e6
    most_thrust: Annotated[float, Real("", "largest thrust over weight; 1e6: off", 0.0, 1e6)] = 1e6


class GuardParameters(NamedTuple):
    """All parameters of the guard; ``ground_height`` is where the flight began unless said otherwise."""

    enabled: Annotated[bool, Flag("the guard checks commands and states; false: no backup law")] = True
    command: CommandLimits = CommandLimits()
    state: StateLimits = StateLimits()
    tilt: TiltLimits = TiltLimits()
    contact: ContactRule = ContactRule()
    step: StepLimits = StepLimits()
    ground_height: Annotated[float, Real("m", "height of the ground, world frame", -1e4, 1e4)] = 0.0
    has_commander: Annotated[bool, Flag("a commander lands while the position is good; else the guard")] = False


class SimulatorParameters(NamedTuple):
    """The simulator node: plant, disturbance, sensing and the lockstep it keeps."""

    plant: Annotated[str, Text("plug-in of group quad.plant")] = "rigid_body"
    disturbance: Annotated[str, Text("plug-in of group quad.disturbance")] = "held_gaussian"
    sensing: Annotated[str, Text("plug-in of group quad.sensing")] = "sensor"
    window: Annotated[int, Whole("steps", "how far the plant may run ahead of what is recorded", 1, 200)] = 60
    answer_timeout: Annotated[float, Real("s", "wall-clock time without an answer: failed", 0.1, 3600.0)] = 3.5
    odom_period_steps: Annotated[int, Whole("steps", "steps between two messages of odom", 1, 100_000)] = 10
    clock_period_steps: Annotated[int, Whole("steps", "steps between two messages of clock", 1, 100_000)] = 5
    publish_state: Annotated[bool, Flag("publish `state`; false: another node does, such as odometry_relay")] = True
    descent_timeout: Annotated[float, Real("s", "longest descent of the guard; it ends then", 1.0, 3600.0)] = 120.0
    guard: GuardParameters = GuardParameters()


class TrajectoryParameters(NamedTuple):
    """The trajectory node."""

    trajectory: Annotated[str, Text("plug-in of group quad.trajectory")] = "hover"
    period_steps: Annotated[int, Whole("steps", "plant steps between two references", 1, 100_000)] = 5


class RecorderParameters(NamedTuple):
    """The recorder node."""

    directory: Annotated[str, Text("directory of the bag, empty or none yet; empty: flights/<run id or time>")] = ""
    ack_steps: Annotated[int, Whole("steps", "between two acknowledgements; below simulator.window", 1, 199)] = 20
    finish_timeout: Annotated[float, Real("s", "time to wait for missing messages after the flight", 0.1, 600.0)] = 10.0


class OdometryRelayParameters(NamedTuple):
    """The odometry relay: an estimator's odometry or pose as `state`."""

    odometry: Annotated[str, Text("topic: nav_msgs/Odometry (body twist) or geometry_msgs/PoseStamped")] = "odom"
    world_frame: Annotated[str, Text("header.frame_id that is accepted (ENU); empty: any")] = "map"
    body_frame: Annotated[str, Text("child_frame_id that is accepted (FLU); empty: any")] = "base_link"
    delay: Annotated[float, Real("s", "known age of a sample at its arrival", 0.0, 1.0)] = 0.0
    on_ground: Annotated[bool, Flag("true: the vehicle stands on the ground at its first state")] = True
    stamps: Annotated[int, Choice(("flight", "first"), "stamps count from step 0 of the flight, or the first one")] = 0
