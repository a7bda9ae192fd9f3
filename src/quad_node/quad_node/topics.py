"""The topics of a flight: one table for the nodes, the recorder, the docs and the tests."""

from typing import Any, NamedTuple

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from quad_core.node_parameters import SHADOW
from quad_msgs.msg import (
    Actuation,
    AttitudeInternals,
    AttitudeThrust,
    Disturbance,
    FlightEvent,
    FlightPlan,
    FlightState,
    NodeParameters,
    NodeStatus,
    PositionInternals,
    RecorderAck,
    TrajectoryPoint,
    VehicleState,
)

SIMULATOR = "simulator"
TRAJECTORY = "trajectory"
POSITION = "position_controller"
ATTITUDE = "attitude_controller"
RECORDER = "recorder"
RELAY = "odometry_relay"
SHADOW_POSITION = SHADOW + POSITION
SHADOW_ATTITUDE = SHADOW + ATTITUDE


SHADOW_TOPICS = "shadow/"  # where shadow controllers answer, so that nobody obeys them

# The plant may run ahead of the recorder by the simulator's window: a publisher must keep that much, and some repeats.
# No more: DDS walks through all of it at every acknowledgement, 2 ms for 1200.
STEP_HISTORY = 256


def stream(depth: int = 10) -> QoSProfile:
    """Return the QoS of control topics: reliable, because lockstep must not lose a sample."""
    return QoSProfile(depth=depth, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)


def latched(depth: int = 1) -> QoSProfile:
    """Return the QoS of topics that late joiners must still get."""
    profile = stream(depth)
    profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return profile


class Topic(NamedTuple):
    """One topic. ``publishers`` and ``subscribers`` are roles; a step topic has a message per step of its publisher."""

    name: str
    type: type[Any]
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    step: bool
    latched: bool
    paper: str

    @property
    def history(self) -> int:
        """How much its publisher keeps: with a message per step, as much as the plant may run ahead and more."""
        return STEP_HISTORY if self.step or self.name.startswith(SHADOW_TOPICS) else 10

    def qos(self, depth: int = 10) -> QoSProfile:
        """Return its QoS profile."""
        return latched(depth) if self.latched else stream(depth)


_ALL = (SIMULATOR, TRAJECTORY, POSITION, ATTITUDE, RECORDER)
_LAWS = (POSITION, ATTITUDE, SHADOW_POSITION, SHADOW_ATTITUDE)

TOPICS = {
    topic.name: topic
    for topic in (
        Topic("state", VehicleState, (SIMULATOR, RELAY), (TRAJECTORY, *_LAWS, RECORDER), True, False, "x1..x12"),
        Topic("truth", VehicleState, (SIMULATOR,), (RECORDER,), True, False, "x1..x12 without noise or delay"),
        Topic("disturbance", Disturbance, (SIMULATOR,), (RECORDER,), True, False, "D_P, D_A of eqs. 10-12"),
        Topic("actuation", Actuation, (SIMULATOR,), (*_LAWS, RECORDER), True, False, "eqs. 3, 8"),
        Topic(
            "reference",
            TrajectoryPoint,
            (TRAJECTORY,),
            (POSITION, SHADOW_POSITION, RECORDER),
            True,
            False,
            "eqs. 61-68",
        ),
        Topic(
            "attitude_setpoint",
            AttitudeThrust,
            (POSITION,),
            (ATTITUDE, SHADOW_ATTITUDE, RECORDER),
            True,
            False,
            "eq. 38",
        ),
        Topic("wrench_setpoint", WrenchStamped, (ATTITUDE,), (SIMULATOR, RECORDER), True, False, "eq. 56"),
        Topic("position_controller/internals", PositionInternals, (POSITION,), (RECORDER,), True, False, "eqs. 18-37"),
        Topic("attitude_controller/internals", AttitudeInternals, (ATTITUDE,), (RECORDER,), True, False, "eqs. 40-60"),
        Topic("shadow/attitude_setpoint", AttitudeThrust, (SHADOW_POSITION,), (RECORDER,), False, False, "eq. 38"),
        Topic("shadow/wrench_setpoint", WrenchStamped, (SHADOW_ATTITUDE,), (RECORDER,), False, False, "eq. 56"),
        Topic(
            "shadow/position_controller/internals", PositionInternals, (SHADOW_POSITION,), (RECORDER,), False, False, ""
        ),
        Topic(
            "shadow/attitude_controller/internals", AttitudeInternals, (SHADOW_ATTITUDE,), (RECORDER,), False, False, ""
        ),
        Topic("odom", Odometry, (SIMULATOR,), (RECORDER, RELAY), False, False, ""),
        Topic("/clock", Clock, (SIMULATOR,), (RECORDER,), False, False, ""),
        Topic("flight/plan", FlightPlan, (TRAJECTORY,), (SIMULATOR, RECORDER), False, True, ""),
        Topic("flight/state", FlightState, (SIMULATOR,), (TRAJECTORY, *_LAWS, RECORDER, RELAY), False, True, ""),
        Topic("flight/nodes", NodeStatus, _ALL, (SIMULATOR, RECORDER), False, True, ""),
        Topic("flight/parameters", NodeParameters, _ALL, (RECORDER,), False, True, ""),
        Topic("flight/events", FlightEvent, _ALL, (RECORDER,), False, False, ""),
        Topic("flight/recorded", RecorderAck, (RECORDER,), (SIMULATOR,), False, False, ""),
    )
}
