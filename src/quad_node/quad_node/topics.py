"""The topics of a flight: one table for the nodes, the recorder, the docs and the tests.

The step topics come from ``quad_core.cascade``; here stand their messages, the topics of the flight itself and QoS.
"""

from collections.abc import Collection
from importlib import import_module
from typing import Any, NamedTuple

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState

from quad_core.cascade import (
    COMMANDER,
    RECORDER,
    RELAY,
    SHADOW,
    SHADOWS,
    SIGNALS,
    SIMULATOR,
    STAGES,
    TRAJECTORY,
    Signal,
)
from quad_core.roles import Stage
from quad_core.types import Wrench
from quad_msgs.msg import (
    AutopilotStatus,
    FlightEvent,
    FlightPlan,
    FlightRequest,
    FlightState,
    GuardStatus,
    NodeParameters,
    NodeStatus,
    RecorderAck,
)

SHADOW_TOPICS = "shadow/"
"""Namespace in which shadow controllers answer, so that no vehicle obeys them."""

# The plant may run ahead of the recorder by the simulator's window: a publisher must keep that much.
LOCKSTEP_HISTORY = 256
# 2 s at 1 kHz: a node that was stopped for a second loses nothing.
REALTIME_HISTORY = 2048


def stream(depth: int = 10) -> QoSProfile:
    """Return the QoS of control topics: reliable, because lockstep must not lose a sample."""
    return QoSProfile(depth=depth, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)


def latched(depth: int = 1) -> QoSProfile:
    """Return the QoS of topics that late joiners must still get."""
    profile = stream(depth)
    profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return profile


class Topic(NamedTuple):
    """One topic. ``publishers`` and ``subscribers`` are roles; a step topic has a message per step of its publisher.

    ``only_with``: the role without which a flight does not have it, empty if every flight has. ``foreign``: drivers of
    others may send it, so a publisher of any reliability is heard. ``required``: a flight needs it; no node waits for a
    topic that its publisher may leave out.
    """

    name: str
    type: type[Any]
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    step: bool = False
    latched: bool = False
    paper: str = ""
    only_with: str = ""
    foreign: bool = False
    required: bool = False

    def exists(self, roles: Collection[str]) -> bool:
        """Return whether a flight of ``roles`` has this topic."""
        return not self.only_with or self.only_with in roles

    def publisher_of(self, roles: Collection[str]) -> str:
        """Return which role publishes it in a flight of ``roles``: an optional node that does replaces the first."""
        return next((role for role in reversed(self.publishers) if role in roles), self.publishers[0])

    def subscribers_of(self, roles: Collection[str]) -> list[str]:
        """Return which roles of a flight of ``roles`` subscribe to it."""
        return [role for role in self.subscribers if role in roles and role != self.publisher_of(roles)]

    @property
    def wire(self) -> str:
        """Its name between the nodes of a flight. Under its own name a latched step topic shows the newest alone.

        Latched with the history that a flight needs, it would send all of that to a late subscriber, the oldest first.
        """
        return f"{self.name}/steps" if self.step and self.latched else self.name

    def history(self, lockstep: bool) -> int:
        """Return how many samples its publisher keeps for those that do not follow."""
        if self.step or self.name.startswith(SHADOW_TOPICS):
            return LOCKSTEP_HISTORY if lockstep else REALTIME_HISTORY
        return 10

    def qos(self, depth: int = 10, keep_all: bool = False) -> QoSProfile:
        """Return its QoS profile.

        ``keep_all``: a reader keeps what it has not read yet. Otherwise it keeps the last ``depth`` of all publishers
        together, and those of a foreign one displace the message that a step in lockstep waits for.
        """
        profile = latched(depth) if self.latched and not self.step else stream(depth)
        if keep_all:
            profile.history = HistoryPolicy.KEEP_ALL
        if self.foreign:
            profile.reliability = ReliabilityPolicy.BEST_EFFORT
        return profile


def message_type(kind: type[Any]) -> type[Any]:
    """Return the message class of the name of a NamedTuple: of ``quad_core.types``, or what a stage shows of itself."""
    if kind is Wrench:
        return WrenchStamped
    package = next((stage.messages for stage in STAGES if stage.internals is kind), "quad_msgs")
    found: type[Any] = getattr(import_module(f"{package}.msg"), kind.__name__)
    return found


def _step_topic(signal: Signal) -> Topic:
    """Return the topic of a row of the cascade: the stages that take it are among its subscribers."""
    taking = [stage.role for stage in STAGES if signal.topic in [taken.topic for taken in stage.inputs]]
    stages = [stage.role for stage in STAGES if stage.role in (*signal.readers, *taking)]
    others = [role for role in signal.readers if role not in stages]
    return Topic(
        signal.topic,
        message_type(signal.kind),
        (signal.publisher, signal.instead) if signal.instead else (signal.publisher,),
        (*others, *stages, *(SHADOW + role for role in stages), RECORDER),
        signal.every_step,
        signal.latched,
        signal.paper,
        signal.only_with,
        required=signal.required,
    )


def _shadow_topics(stage: Stage) -> tuple[Topic, Topic]:
    """Return the answer of a stage's shadow controller and its internals."""
    role, answer, inside = SHADOW + stage.role, message_type(stage.output_type), message_type(stage.internals)
    return (
        Topic(SHADOW_TOPICS + stage.output, answer, (role,), (RECORDER,), paper=stage.paper, only_with=role),
        Topic(SHADOW_TOPICS + stage.internals_topic, inside, (role,), (RECORDER,), only_with=role),
    )


_STAGES = tuple(stage.role for stage in STAGES)
_ALL = (SIMULATOR, TRAJECTORY, *_STAGES, RECORDER)
_LISTENERS = (TRAJECTORY, *_STAGES, *SHADOWS, RECORDER, RELAY, COMMANDER)

TOPICS = {
    topic.name: topic
    for topic in (
        *map(_step_topic, SIGNALS.values()),
        *(topic for stage in STAGES for topic in _shadow_topics(stage)),
        Topic("odom", Odometry, (SIMULATOR,), (RECORDER, RELAY)),
        Topic("clock", Clock, (SIMULATOR,), (RECORDER,)),
        Topic("flight/plan", FlightPlan, (TRAJECTORY,), (SIMULATOR, COMMANDER, RECORDER), latched=True, required=True),
        Topic("flight/state", FlightState, (SIMULATOR,), _LISTENERS, latched=True, required=True),
        Topic("flight/guard", GuardStatus, (SIMULATOR,), (COMMANDER, RECORDER), latched=True),
        Topic("flight/autopilot", AutopilotStatus, (SIMULATOR,), (COMMANDER, RECORDER), latched=True),
        Topic("flight/nodes", NodeStatus, _ALL, (SIMULATOR, COMMANDER, RECORDER), latched=True, required=True),
        Topic("flight/request", FlightRequest, (SIMULATOR,), (COMMANDER, RECORDER), only_with=COMMANDER),
        Topic("battery_state", BatteryState, (SIMULATOR,), (COMMANDER, RECORDER), only_with=COMMANDER, foreign=True),
        Topic("flight/parameters", NodeParameters, _ALL, (RECORDER,), latched=True),
        Topic("flight/events", FlightEvent, _ALL, (RECORDER,)),
        Topic("flight/recorded", RecorderAck, (RECORDER,), (SIMULATOR,), required=True),
    )
}
