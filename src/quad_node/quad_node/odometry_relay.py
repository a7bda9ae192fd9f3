"""The odometry relay: the one door for estimators. Odometry, or a pose alone, becomes the `state` of the controllers.

Subscribes: the estimator's topic, actuation (Actuation), with a commander flight/mode/steps (FlightMode).
Publishes: state (VehicleState).

What is done with a sample is ``quad_core.estimator``. Before the flight the relay is READY only once the estimator
sends what can be flown; in flight it names on `flight/events` what is wrong, and ends when the estimator is silent.
"""

import sys
import time
from typing import Any

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy

from quad_core.cascade import RELAY
from quad_core.cycle import is_flyable, seconds
from quad_core.enumerations import ON_GROUND
from quad_core.estimator import Drive, Estimator, Sample
from quad_core.geometry import normalized
from quad_core.lift_off import Standing, airborne, lifted_off, sinks
from quad_core.types import Actuation, Quat, Vec3, VehicleState, with_ground
from quad_msgs.msg import Actuation as ActuationMsg
from quad_msgs.msg import FlightMode
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import UNUSABLE, packer, stamp_ns, unpacker
from quad_node.flight_node import FlightNode
from quad_node.main import run

STAMPS_FIRST = 1
TYPES = {"nav_msgs/msg/Odometry": Odometry, "geometry_msgs/msg/PoseStamped": PoseStamped}
_LEAST_SQUARE = 0.5
_PATIENCE = 5.0  # s before the flight in which an estimator may send what cannot be used
_AT_REST = 0.15  # m/s: what an estimate may drift by while the vehicle stands
_LATE = 0.05  # s in real time: the guard descends on a wrench as old
_SILENT = 0.25  # s in real time: the guard descends after 0.1 s
_BEGINS = 0.03  # s in real time: so long nothing new as the flight begins, and the guard ends it after 0.05 s
_SILENT_LOCKSTEP = 2.5  # s: less than the simulator waits for an answer, so that the estimator is named


class OdometryRelay:
    """Turns pose (world) and twist (body) into `state`; a message that cannot be used is dropped and counted."""

    def __init__(self) -> None:
        """Look for the estimator; raises as FlightNode."""
        self.node = node = FlightNode(RELAY, watch=self._watch, needs=self._needs)
        self._settings = node.settings
        self._topic: str = self._settings.odometry
        self._period = node.flight.plant_period
        self._state_out = node.links.publisher("state")
        self._pack = packer(VehicleState, VehicleStateMsg, node.run)
        self._unpack = unpacker(Actuation, ActuationMsg, run=node.run)
        from_first = self._settings.stamps == STAMPS_FIRST
        self.estimator = Estimator(self._topic, self._period, from_first, node.lockstep, self._settings.delay)
        asks = self._settings.on_ground and not node.commanded  # a commander asks itself
        self._standing = Standing() if asks else None
        self._lift, self._armed, self._begun = airborne(0.0), not node.commanded, False
        self._accepted, self._refusal, self._waits_for, self._is_subscribed = 0, "", "", False
        self._first_at = self._accepted_at = 0.0
        self._newest: Sample | None = None
        node.measures.append(self._measured)
        node.links.subscribe("actuation", self._on_actuation, raw=True)
        if node.commanded:
            node.links.subscribe("flight/mode", self._on_mode)

    def _needs(self) -> list[str]:
        """Return what keeps the estimator from being flown with."""
        why = "" if self._is_subscribed else self._subscribe()
        if not why:
            why = self._unusable() if self._accepted else self._refusal or f"a message on {self._topic}"
        if why != self._waits_for:  # shown while the flight waits
            self._waits_for = why
            self.node.publish_status(why)
        return [why] if why else []

    def _subscribe(self) -> str:
        """Subscribe to the topic with the type that it has; return why this is not possible yet."""
        infos = self.node.ros.get_publishers_info_by_topic(self._topic)
        if not infos:
            return f"{self._topic} of the estimator"
        kind = TYPES.get(infos[0].topic_type)
        if kind is None:
            self._first_at = self._first_at or time.monotonic()
            self._refusal = f"{self._topic}: found {infos[0].topic_type}, expected {' or '.join(TYPES)}"
            return self._refusal
        # one that sends best effort cannot be received otherwise; a lost sample would halt lockstep
        reliable = all(info.qos_profile.reliability == ReliabilityPolicy.RELIABLE for info in infos)
        chosen = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(depth=64, reliability=chosen)
        source = self.node.ros.create_subscription(kind, self._topic, self.step, qos)
        self.node.links.expect(self._topic, source, "the estimator")  # so that it has one publisher
        self._is_subscribed = True
        return ""

    def _unusable(self) -> str:
        """Return why the estimator whose messages are accepted cannot be flown with, empty if it can be."""
        if others := topics.second_senders(self.node.ros, [self._topic]):
            return others[0]
        moves = self._standing.refusal(_AT_REST, self._topic) if self._standing is not None else ""
        return self.estimator.refusal() or moves

    def _watch(self) -> None:
        """Give up an estimator that sends nothing that can be used; relay what came just before the flight began."""
        node, now = self.node, time.monotonic()
        if node.done.done():
            return
        if node.flying and not self._begun and self._newest is not None:
            self._relay(self._newest, now)
        if not node.flying:
            why = self._unusable() if self._accepted else self._refusal
            if self._first_at and now - self._first_at > _PATIENCE and why:
                self._give_up("estimator_refused", why)
            return
        limit = _SILENT_LOCKSTEP if node.lockstep else _SILENT
        if self._begun and now - self._accepted_at - node.slept > limit:
            self._silent()

    def _silent(self) -> None:
        since = seconds(self.estimator.good_step, self._period)
        refused = f"no message that can be used ({self._refusal})" if self._refusal else "silent"
        self._give_up("estimator_silent", f"{self._topic}: {self.estimator.stall or refused} since {since:.3f} s")

    def _give_up(self, kind: str, text: str) -> None:
        self.node.events.error(kind, text)
        self.node.finish(1, text)

    def step(self, message: Odometry | PoseStamped) -> None:
        """Take in a message of the estimator; in flight it becomes a state."""
        now = time.monotonic()
        self._first_at = self._first_at or now
        sample, problem = self._sample_of(message, now)
        if sample is None:
            self._refusal = f"{self._topic}: {problem}"
            self.node.events.reject(self._topic, problem, kind="rejected_odometry")
            return
        self._accepted, self._refusal = self._accepted + 1, ""
        if self.node.flying:
            self._relay(sample, now)
        else:
            self.estimator.wait(sample)
            self._newest = sample
            if self._standing is not None:
                self._standing.note(now, VehicleState(sample.p_w, sample.twist_linear or Vec3()))

    def _sample_of(self, message: Odometry | PoseStamped, now: float) -> tuple[Sample | None, str]:
        """Return a message as a sample, or None and why it cannot be used."""
        frames = [(message.header.frame_id, self._settings.world_frame)]
        if isinstance(message, Odometry):
            frames.append((message.child_frame_id, self._settings.body_frame))
        for found, expected in frames:
            if expected and found != expected:
                return None, f"frame {found!r}, expected {expected!r}"
        stamp = stamp_ns(message.header.stamp)
        sample = sample_of(message, stamp, now)
        if sample is None:
            return None, "a quaternion that is not of length 1"
        parts = VehicleState(sample.p_w, sample.twist_linear or Vec3(), sample.q_wb, sample.twist_angular or Vec3())
        if not is_flyable(parts):
            return None, "a number that is not finite or out of range"
        return sample, ""

    def _relay(self, sample: Sample, now: float) -> None:
        node, period = self.node, self._period
        found = self.estimator.take(sample)
        while self.estimator.news:
            kind, text = self.estimator.news.popleft()
            if kind == "wrong_pose":
                self._give_up(kind, text)
                return
            node.events.warn(kind, text, always=kind == "wrong_twist")  # each part of it once in a flight
        if found is None:
            begins = not node.lockstep and seconds(self.estimator.good_step, period) < _BEGINS
            if begins and self.estimator.stall and now - self._accepted_at > _BEGINS:
                self._silent()
            return
        passed, self._accepted_at = now - self._accepted_at, now
        step, state = found
        if self.estimator.stall and seconds(step - self.estimator.good_step, period) > _SILENT:
            self._silent()
            return
        if self._begun and passed > _LATE and not node.lockstep:
            node.events.warn("estimator_late", f"{self._topic}: nothing for {1e3 * passed:.0f} ms")
        if not is_flyable(state):
            node.events.reject(self._topic, "its state is out of range", kind="rejected_odometry")
            return
        dt = seconds(max(step - node.current_step, 0), period)
        stands = self._settings.on_ground and not self._begun
        self._lift = lifted_off(self._lift, state, self._armed and not stands, dt)
        self._begun, node.current_step = True, step
        if sinks(self._lift, state):
            text = f"sinks at lift-off, found {state.v_w.z:.1f} m/s: expected a z axis that points up"
            self._give_up("estimator_sinks", f"{self._topic}: {text}")
            return
        state = with_ground(state, self._lift.ground_z, self._lift.on_ground)
        self._state_out.publish(self._pack(state, step, step + 1, step * period))

    def _on_actuation(self, payload: bytes) -> None:
        try:
            found = self._unpack(payload)
        except UNUSABLE as error:
            self.node.events.unusable("actuation", payload, error)
            return
        self.estimator.owner_is_at(found.step + 1)
        if found.finite:
            vehicle, torque = self.node.vehicle, found.value.torque_b
            spin = torque.x / vehicle.inertia_xx, torque.y / vehicle.inertia_yy, torque.z / vehicle.inertia_zz
            self.estimator.drive(Drive(found.value.thrust / vehicle.mass, vehicle.gravity, Vec3(*spin)))

    def _on_mode(self, message: FlightMode) -> None:
        if not self.node.is_foreign("flight/mode", message.run):
            self._armed = message.mode not in ON_GROUND

    def _measured(self) -> dict[str, Any]:
        """Return what was counted of the estimator, its spacing and its largest jitter."""
        estimator = self.estimator
        shown = {"spacing_ms": 1e3 * estimator.spacing, "largest_jitter_us": 1e-3 * estimator.jitter_ns}
        derived = {"velocity_derived": estimator.derives_velocity, "rates_derived": estimator.derives_rate}
        return {**estimator.counts, **shown, **{name: int(value) for name, value in derived.items()}}


def sample_of(message: Odometry | PoseStamped, stamp: int, arrived: float) -> Sample | None:
    """Return pose and twist of a message, None without an attitude.

    The quaternion is normalised: estimators send single precision.
    """
    pose = message.pose.pose if isinstance(message, Odometry) else message.pose
    p, q = pose.position, pose.orientation
    square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not square > _LEAST_SQUARE:
        return None
    place, attitude = Vec3(p.x, p.y, p.z), normalized(Quat(q.x, q.y, q.z, q.w))
    if not isinstance(message, Odometry):
        return Sample(stamp, arrived, place, attitude)
    v, w = message.twist.twist.linear, message.twist.twist.angular
    return Sample(stamp, arrived, place, attitude, Vec3(v.x, v.y, v.z), Vec3(w.x, w.y, w.z))


def main() -> None:
    """Run the odometry relay."""
    sys.exit(run(RELAY, OdometryRelay, "Odometry relay: an estimator's odometry or pose becomes state."))
