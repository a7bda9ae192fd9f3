"""`ros2 run quad_dynamics check_plant`: plays the attitude controller and tells how a plant keeps the contract."""

import math
import sys
import time

from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from quad_core.bounds import is_flyable
from quad_core.rotations import rotate
from quad_core.timing import steps_to_cover
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_dynamics.check_plant.manoeuvres import Manoeuvre, manoeuvres
from quad_dynamics.check_plant.report import Report
from quad_msgs.msg import Actuation as ActuationMsg
from quad_msgs.msg import FlightPlan, FlightState
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node import topics
from quad_node.codec import pack_wrench
from quad_node.conversion import reader, set_stamp, stamp_ns
from quad_node.flight_node import FlightNode
from quad_node.main import run

ROLES = f"{topics.SIMULATOR},{topics.ATTITUDE}"
HELP = f"""Checks a plant or hardware bridge against docs/swap_the_plant.md, as the only other node of its flight.

usage: ros2 run quad_dynamics check_plant [--ros-args -p flight.mode:=realtime -p vehicle.mass:=0.56 ...]

Start the plant with the same vehicle and `flight.roles:={ROLES}`, high enough to move by a metre:
  ros2 run quad_dynamics simulator --ros-args -p flight.roles:={ROLES} -p disturbance:=none &
  ros2 run quad_dynamics check_plant

It answers states with short manoeuvres (climb, one doublet of torque about each axis), then falls silent.
HARDWARE: only without propellers. Takes every flight.* and vehicle.* parameter.
Exit code: 0 kept, 1 broken, 2 bad usage."""

_STILL = 0.3
_OWN = ("an unanswered state is repeated, unchanged", "a command for another step is ignored")
_NONFINITE = "a command that is not finite is ignored"
_OUT = (topics.TOPICS["state"], topics.TOPICS["actuation"], topics.TOPICS["flight/state"])
_TOOLS = (topics.TOPICS["truth"], topics.TOPICS["disturbance"], topics.TOPICS["odom"], topics.TOPICS["/clock"])


class PlantCheck(FlightNode):
    """Answers `state` with manoeuvres; first it withholds answers, last it falls silent."""

    def __init__(self, report: Report) -> None:
        """Subscribe to all that a plant may send; raises as FlightNode."""
        super().__init__(topics.ATTITUDE)
        self._report = report
        self._read = reader(VehicleState, VehicleStateMsg)
        self._plan_out = self.publisher("flight/plan")
        self._wrench_out = self.publisher("wrench_setpoint")
        self._left: list[Manoeuvre] = manoeuvres(self.vehicle)
        self._until = 0
        self._before: VehicleState | None = None
        self._last: tuple[int, VehicleState] | None = None
        self._probe = [*_OWN, _NONFINITE] if self.lockstep else []
        self._probed = 0.0
        self._actuated = -1
        self.subscribe("state", self._on_state, depth=64)
        self.subscribe("actuation", self._on_actuation, depth=64)
        self.create_subscription(Odometry, "odom", self._on_odometry, topics.stream(64))

    def _on_state(self, message: VehicleStateMsg) -> None:
        state, step = self._read(message), message.step
        self.heard = time.monotonic()
        self.flying = True
        if self._last is None:
            self._first(state, step)
        self._judge_state(state, step, stamp_ns(message.stamp))
        again = self._last is not None and self._last[0] == step
        if self._last is not None and again:
            same = "" if self._last[1] == state else f"step {step} came again with other numbers"
            self._report.add(_OWN[0], same)
            if self._probe and self._probe[0] == _OWN[0]:
                self._next_probe(step)
            return
        self._last = (step, state)
        if not self._probe:
            self._answer(state, step)
        elif step > 0:
            self._report.add(self._probe[0], f"the plant went on to step {step}")
            self._probe.clear()
            self._answer(state, step)

    def _first(self, state: VehicleState, step: int) -> None:
        self._report.add("the first state is step 0", "" if step == 0 else f"found step {step}")
        self._before = state
        steps = sum(steps_to_cover(part.duration, self.flight.plant_period) for part in self._left)
        plan = FlightPlan(trajectory="check_plant", start="printed", end_step=step + 2 * steps + 100_000)
        set_stamp(plan.end, plan.end_step * self.flight.plant_period)
        self._plan_out.publish(plan)
        self._endpoints()

    def _judge_state(self, state: VehicleState, step: int, stamp: int) -> None:
        expected = step * self.flight.plant_period
        wrong = "" if stamp == expected else f"step {step} has stamp {stamp} ns, expected {expected}"
        self._report.add("stamp of state = step x flight.plant_period", wrong)
        wrong = "" if is_flyable(state) else f"step {step}: {state}"
        self._report.add("state is finite, within bounds, its quaternion of norm 1", wrong)
        if self._last is not None and step != self._last[0]:
            late = step - self._last[0] - 1
            wrong = "" if (late == 0 if self.lockstep else late >= 0) else f"{step} after {self._last[0]}"
            self._report.add("steps come in order" + (", none left out" if self.lockstep else ""), wrong)

    def _next_probe(self, step: int) -> None:
        """Lockstep: send what must not move the plant; ``on_tick`` goes on when it did not."""
        self._probe.pop(0)
        self._probed = time.monotonic()
        if self._probe and self._probe[0] == _OWN[1]:
            self._send(Wrench(self.vehicle.mass * self.vehicle.gravity, Vec3()), step + 3)
        elif self._probe:
            self._send(Wrench(math.nan, Vec3()), step)

    def on_tick(self) -> None:
        """Go on after a probe that the plant withstood."""
        if self._last is None or not self._probe or not self._probed or time.monotonic() - self._probed < _STILL:
            return
        self._report.add(self._probe[0])
        self._next_probe(self._last[0])
        if not self._probe:
            self._answer(self._last[1], self._last[0])

    def _answer(self, state: VehicleState, step: int) -> None:
        if step >= self._until and self._until and self._left:
            done = self._left.pop(0)
            assert self._before is not None
            self._report.add(done.name, done.judge(self._before, state))
            self._until = 0
        if not self._left:
            return
        if not self._until:
            self._before = state
            self._until = step + steps_to_cover(self._left[0].duration, self.flight.plant_period)
        self._send(self._left[0].wrench, step)

    def _send(self, wrench: Wrench, step: int) -> None:
        self._wrench_out.publish(pack_wrench(wrench, step * self.flight.plant_period))

    def _on_actuation(self, message: ActuationMsg) -> None:
        if self.lockstep and message.step not in (self._actuated, self._actuated + 1):
            self._report.add("actuation of every step", f"step {message.step} after {self._actuated}")
        self._report.add("actuation of every step")
        self._actuated = message.step
        finite = math.isfinite(message.thrust) and all(math.isfinite(part) for part in message.torque_b)
        self._report.add("actuation is finite", "" if finite else f"step {message.step}")

    def _on_odometry(self, message: Odometry) -> None:
        frames = (message.header.frame_id, message.child_frame_id)
        wrong = "" if frames == ("map", "base_link") else f"found {frames}"
        self._report.add("odom is in map and base_link (REP 105)", wrong, optional=True)
        if self._last is None or stamp_ns(message.header.stamp) != self._last[0] * self.flight.plant_period:
            return
        q, v = message.pose.pose.orientation, message.twist.twist.linear
        found = rotate(Quat(q.x, q.y, q.z, q.w), Vec3(v.x, v.y, v.z))
        off = max(abs(a - b) for a, b in zip(found, self._last[1].v_w, strict=True))
        wrong = "" if off < 0.1 else f"turned into the world it misses v_w by {off:.3g} m/s"
        self._report.add("twist of odom is in the body frame", wrong, optional=True)

    def _endpoints(self) -> None:
        for topic in (*_OUT, *_TOOLS):
            optional = topic in _TOOLS
            name = topic.name if topic.name.startswith("/") else self.resolve_topic_name(topic.name)
            found = self.get_publishers_info_by_topic(name)
            label = f"{topic.name}: {topic.type.__module__.split('.')[0]}/{topic.type.__name__}, reliable"
            label += ", latched" if topic.latched else ""
            if not found:
                self._report.add(label, "nobody publishes it", optional)
                continue
            wrong = []
            for info in found:
                if info.topic_type.rsplit("/", 1)[-1] != topic.type.__name__:
                    wrong.append(f"type {info.topic_type}")
                if info.qos_profile.reliability != ReliabilityPolicy.RELIABLE:
                    wrong.append("best effort")
                if topic.latched and info.qos_profile.durability != DurabilityPolicy.TRANSIENT_LOCAL:
                    wrong.append("not transient local")
            self._report.add(label, ", ".join(wrong), optional)

    def on_flight_ended(self, message: FlightState) -> None:
        """Judge how the plant takes silence, and leave."""
        if self._left:
            self._report.add(
                "all manoeuvres flown", f"the flight ended before {self._left[0].name!r}: {message.reason}"
            )
        named = "wrench_setpoint" in message.reason or topics.ATTITUDE in message.reason
        failed = message.state == FlightState.FAILED
        wrong = "" if failed and named else f"flight/state {message.state}, reason {message.reason!r}"
        self._report.add("a silent controller ends the flight as FAILED, named", wrong)
        self.finish(0, "checked")


def main() -> None:
    """Run the check and print what was found."""
    if "--help" in sys.argv or "-h" in sys.argv:
        sys.stdout.write(HELP + "\n")
        sys.exit(0)
    report = Report()
    arguments = [*sys.argv, "--ros-args", "-p", f"flight.roles:={ROLES}"]
    code = run(topics.ATTITUDE, lambda: PlantCheck(report), "", arguments)
    if code == 2:
        sys.exit(2)
    if code == 1:
        report.add("a flight", "none was flown to its end: see the messages above")
    sys.stdout.write(report.text() + "\n")
    sys.exit(1 if report.failed else 0)
