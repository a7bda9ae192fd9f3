"""The topics of a flight: one table for all, and a node's links, which are matched before the flight.

The step topics come from ``quad_core.cascade``; here stand their messages, the topics of the flight itself and QoS.
rclpy does not say which publisher a message came from, so a second one is found by the graph: before the flight it
keeps nodes from being ready, in flight it is an event, and it is looked for once a second.
"""

import time
from collections import Counter
from collections.abc import Collection, Iterable
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.subscription import Subscription
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
from quad_node.event_log import EventLog

SHADOW_TOPICS = "shadow/"  # namespace in which shadow controllers answer, so that no vehicle obeys them

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


MANY_SENDERS = frozenset({"flight/nodes"})  # topics that every node of a flight publishes


class Links:
    """A node's publishers and subscriptions on topics of the flight; ``events``: where a QoS that fits none is told."""

    def __init__(self, ros: Node, roles: Collection[str], lockstep: bool, shadow: bool) -> None:
        """Link ``ros`` with the nodes of ``roles``; a ``shadow`` answers on topics of its own."""
        self._ros, self._roles, self._lockstep, self._shadow = ros, roles, lockstep, shadow
        self.events: EventLog | None = None
        self._out: list[tuple[Publisher, int, str]] = []
        self._in: dict[str, tuple[Subscription, str]] = {}

    def publisher(self, topic: str, match: bool = True) -> Publisher:
        """Return a publisher of a topic, of a shadow's own for an answer; READY waits for subscribers if ``match``."""
        aside = self._shadow and TOPICS[topic].step
        entry = TOPICS[SHADOW_TOPICS + topic if aside else topic]
        publisher = self._ros.create_publisher(entry.type, entry.wire, entry.qos(entry.history(self._lockstep)))
        readers = entry.subscribers_of(self._roles) if match else []
        self._out.append((publisher, len(readers), ", ".join(readers)))
        return publisher

    def subscribe(self, topic: str, callback: Any, depth: int = 10, raw: bool = False) -> Subscription:
        """Subscribe to a topic of the table and return it; READY waits for the publishers of a required one."""
        entry = TOPICS[topic]
        if self._shadow:
            depth = max(depth, entry.history(self._lockstep))
        qos = entry.qos(depth, keep_all=self._lockstep)
        watched = SubscriptionEventCallbacks(incompatible_qos=partial(self._on_other_qos, entry.name))
        heard = self._ros.create_subscription(entry.type, entry.wire, callback, qos, raw=raw, event_callbacks=watched)
        sources = [role for role in entry.publishers if role in self._roles]
        if entry.required and entry.exists(self._roles) and sources:
            self.expect(entry.wire, heard, " or ".join(sources))
        return heard

    def expect(self, topic: str, subscription: Subscription, role: str) -> None:
        """Have READY wait for one publisher of ``topic``, which is ``role``'s."""
        self._in[topic] = subscription, role

    def missing(self) -> list[str]:
        """Return the topics that are not matched with all the nodes they need, and whose part that is.

        What is sent before both ends have matched may be lost, and the graph may know of a writer earlier: both ends
        count what they have matched.
        """
        found = [
            f"a reader of {publisher.topic_name} ({readers})"
            for publisher, needed, readers in self._out
            if publisher.get_subscription_count() < needed
        ]
        return found + self.unheard()

    def unheard(self) -> list[str]:
        """Return the topics whose publishers are missing, or are too many."""
        sources = self._in.items()
        found = [f"{name} of {role}" for name, (heard, role) in sources if not heard.get_publisher_count()]
        return found + self.second_senders()

    def second_senders(self) -> list[str]:
        """Return one line per topic that two nodes send and one may."""
        return second_senders(self._ros, self._in)

    def drain(self, patience: float) -> None:
        """Wait at most ``patience`` s until subscribers have what was sent."""
        deadline = time.monotonic() + patience
        # who hears first that this node has left drops what it has not read of it, the reason too
        for publisher, _, _ in self._out:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _on_other_qos(self, topic: str, info: Any) -> None:
        policy = qos_policy_name_from_kind(info.last_policy_kind).lower()
        if self.events is not None:
            text = f"{topic}: a publisher of other {policy}; nothing of it is received"
            self.events.warn("other_qos", text, always=True)


def second_senders(graph: Node, topics: Iterable[str]) -> list[str]:
    """Return one line for each of ``topics`` with more than one publisher; a node that publishes twice is said to."""
    lines = []
    for topic in topics:
        # counting is all that a good flight pays for
        if topic in MANY_SENDERS or graph.count_publishers(topic) < 2:
            continue
        infos = graph.get_publishers_info_by_topic(topic)
        names = Counter(f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos)
        if len(infos) > 1:
            named = [name if count == 1 else f"{name} ({count} times)" for name, count in sorted(names.items())]
            lines.append(f"one publisher of {topic}, there are {len(infos)}: {', '.join(named)}")
    return lines
