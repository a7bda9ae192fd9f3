"""The odometry relay: any estimator's nav_msgs/Odometry becomes the `state` that the controllers see."""

import sys

from nav_msgs.msg import Odometry

from quad_core.cascade import RELAY
from quad_core.cycle import is_flyable, seconds
from quad_core.geometry import normalized, rotate
from quad_core.lift_off import airborne, lifted_off, marked
from quad_core.types import Quat, Vec3, VehicleState
from quad_msgs.msg import FlightEvent, FlightMode
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import packer
from quad_node.conversion import stamp_ns
from quad_node.flight_node import FlightNode
from quad_node.main import run

STAMPS_FIRST = 1
_LEAST_NORM = 0.5


class OdometryRelay(FlightNode):
    """Turns pose (world) and twist (body) into `state`; a message that cannot be trusted is dropped and counted."""

    def __init__(self) -> None:
        """Subscribe to the estimator; raises as FlightNode."""
        super().__init__(RELAY)
        self._settings = self.resolved.node
        self._state_out = self.publisher("state")
        self._pack = packer(VehicleState, VehicleStateMsg, self.run)
        self._first: int | None = None
        self._lift, self._armed, self._begun = airborne(0.0), not self.commanded, False
        if self.commanded:
            self.subscribe("flight/mode", self._on_mode)
        self.create_subscription(Odometry, self._settings.odometry, self._on_odometry, topics.stream(64))

    def missing_links(self) -> list[str]:
        """Return what is not matched yet, the estimator included."""
        name = self._settings.odometry
        return super().missing_links() + ([f"{name} of the estimator"] if self.count_publishers(name) == 0 else [])

    def _on_odometry(self, message: Odometry) -> None:
        stamp = stamp_ns(message.header.stamp)
        for found, expected in (
            (message.header.frame_id, self._settings.world_frame),
            (message.child_frame_id, self._settings.body_frame),
        ):
            if expected and found != expected:
                self._refuse("wrong_frame", f"frame {found!r}, expected {expected!r}", stamp)
                return
        state = state_from_odometry(message)
        if state is None or not is_flyable(state):
            self._refuse("rejected_nonfinite", "a number that is not finite or out of range", stamp)
            return
        if self._first is None and stamp >= 0:  # what lies before all time is no beginning
            self._first = stamp if self._settings.stamps == STAMPS_FIRST else 0
        elapsed = -1 if self._first is None else stamp - self._first
        if elapsed < 0:
            self._refuse("stamp_backwards", f"stamp {stamp} ns lies before the flight", stamp)
            return
        step, before = elapsed // self.flight.plant_period, self.current_step
        self.current_step = step
        stands = self._settings.on_ground and not self._begun
        dt = seconds(max(step - before, 0), self.flight.plant_period)
        self._lift, self._begun = lifted_off(self._lift, state, self._armed and not stands, dt), True
        state = marked(state, self._lift)
        self._state_out.publish(self._pack(state, self.current_step, self.current_step + 1, elapsed))

    def _on_mode(self, message: FlightMode) -> None:
        if message.run_id == self.flight.run_id:
            self._armed = message.mode not in (FlightMode.DISARMED, FlightMode.ARMING)

    def _refuse(self, kind: str, found: str, stamp: int) -> None:
        self.counters["rejected"] += 1
        self.event(FlightEvent.WARNING, kind, f"{self._settings.odometry}: {found}; message ignored", stamp)


def state_from_odometry(message: Odometry) -> VehicleState | None:
    """Return position (world), velocity turned into the world, attitude and body rates; None without an attitude.

    The quaternion is normalised: estimators send single precision.
    """
    p, q = message.pose.pose.position, message.pose.pose.orientation
    v, w = message.twist.twist.linear, message.twist.twist.angular
    norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not norm > _LEAST_NORM:
        return None
    attitude = normalized(Quat(q.x, q.y, q.z, q.w))
    velocity = rotate(attitude, Vec3(v.x, v.y, v.z))
    return VehicleState(Vec3(p.x, p.y, p.z), velocity, attitude, Vec3(w.x, w.y, w.z))


def main() -> None:
    """Run the odometry relay."""
    sys.exit(run(RELAY, OdometryRelay, "Odometry relay: an estimator's nav_msgs/Odometry becomes state."))
