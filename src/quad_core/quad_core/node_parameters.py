"""The parameters of each node, without those of the plug-in that it runs."""

from typing import Annotated, NamedTuple

from quad_core.guard_parameters import GuardParameters
from quad_core.parameters import Choice, Flag, Real, Text, Whole


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
