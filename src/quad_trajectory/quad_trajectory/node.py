"""The trajectory node: plans at the first state, then publishes the reference of each of its steps.

Subscribes: state (VehicleState).
Publishes: reference (TrajectoryPoint), flight/plan (FlightPlan).
With a commander it subscribes also: reference (TrajectoryPoint), flight/mode/steps (FlightMode).
With a commander it publishes instead: mission/reference (TrajectoryPoint), flight/plan (FlightPlan).
Topics that every node has: ``quad_node.flight_node``.

With a commander it answers on `mission/reference`, begins when the mode becomes MISSION, from the reference flown then,
and rests in every other mode: what it has not flown yet it flies when MISSION comes back.
"""

import math
import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from rclpy.publisher import Publisher

from quad_core.cascade import TRAJECTORY
from quad_core.cycle import seconds, steps_to_cover
from quad_core.enumerations import ON_GROUND, Mode
from quad_core.geometry import euler_from_quaternion, norm, quaternion_from_euler
from quad_core.parameters import Choice, fields
from quad_core.records import finite_check
from quad_core.types import NOT_BEGUN, TrajectoryPoint, Vec3, VehicleState
from quad_msgs.msg import FlightPlan
from quad_msgs.msg import TrajectoryPoint as TrajectoryPointMsg
from quad_node.codec import Stamped, packer, set_stamp
from quad_node.flight_node import FlightNode
from quad_node.main import run
from quad_node.responder import Responder, Sample

_SAMPLES = 400  # instants at which a plan is looked at before the flight
_is_finite = finite_check(TrajectoryPoint)


class Trajectory:
    """Samples one trajectory plug-in."""

    def __init__(self) -> None:
        """Load the trajectory named by the parameters; raises as FlightNode."""
        self.node = node = FlightNode(TRAJECTORY)
        self.responder = Responder(node, self.step)
        self._plugin = node.resolved.plugins["trajectory"]
        self._plan: Any = None
        self._first_stamp = self._last_stamp = self._length = 0
        self._commanded = node.commanded
        self._begun = not self._commanded
        if self._commanded:
            self.responder.take("flight/mode", lag=1)
            self.responder.take("reference", lag=1)
        self._plan_out = node.links.publisher("flight/plan")
        self._reference_out = node.links.publisher("mission/reference" if self._commanded else "reference")
        self._pack = packer(TrajectoryPoint, TrajectoryPointMsg, node.run)

    def step(self, sample: Sample, arrivals: list[Stamped | None]) -> Iterator[tuple[Publisher, Any]]:
        """Give the reference of one step, and whenever it begins the plan."""
        reference, flies = None, True
        if self._commanded:
            mode, reference = (arrival.value if arrival else None for arrival in arrivals)
            flies = mode is not None and mode.mode == Mode.MISSION
            self._apply_mode(sample, flies, mode is not None and mode.mode in ON_GROUND)
        if self._plan is None:
            try:
                plan = self._make_plan(sample, _as_state(reference) if reference else self._start(sample.state))
            except ValueError as error:  # a plug-in's plan() refuses what it cannot fly within its limits
                text = f"{self._plugin.name}: no plan from this start: {error}"
                self.node.events.error("plan_refused", text, sample.stamp_ns)
                self.node.finish(1, text)
                return
            yield self._plan_out, plan
        next_step = sample.step + self.node.period_steps
        if flies and (not self._commanded or self._is_left(sample)):
            time = seconds(sample.stamp_ns - self._first_stamp, 1)
            point = self._plugin.module.sample(self._plugin.parameters, self._plan, time)
            if not _is_finite(point):
                text = f"{self._plugin.name}: non-finite reference at step {sample.step}"
                self.node.events.error("reference_nonfinite", text, sample.stamp_ns)
                self.node.finish(1, text)
                return
        else:
            point = (reference or _standing(sample.state))._replace(trajectory_time=NOT_BEGUN)
        yield self._reference_out, self._pack(point, sample.step, next_step, sample.stamp_ns)

    def _start(self, state: VehicleState) -> VehicleState:
        # a commander asks before it arms whether the estimate stands, and a plan of the mission comes after that
        return state._replace(v_w=Vec3()) if self._commanded and state.on_ground else state

    def _apply_mode(self, sample: Sample, flies: bool, is_on_ground: bool) -> None:
        """Begin, go on, rest or forget what was flown, as the commander's mode wants it."""
        passed, self._last_stamp = sample.stamp_ns - self._last_stamp, sample.stamp_ns
        if flies and not self._begun:
            self._plan, self._begun = None, True  # from where the reference is now
        elif not flies and self._begun:
            self._begun = not is_on_ground and self._is_left(sample)
            self._first_stamp += passed

    def _is_left(self, sample: Sample) -> bool:
        """Return whether some of the trajectory is still to be flown."""
        return sample.stamp_ns - self._first_stamp < self._length

    def _make_plan(self, sample: Sample, start: VehicleState) -> FlightPlan:
        module, parameters = self._plugin.module, self._plugin.parameters
        self._plan = module.plan(parameters, self.node.vehicle, start)
        self._first_stamp = sample.stamp_ns
        approach = -module.sample(parameters, self._plan, 0.0).trajectory_time
        length = module.duration(parameters, self._plan)
        period = self.node.flight.plant_period
        steps = steps_to_cover(length, period)
        self._length = steps * period
        message = FlightPlan(
            trajectory=self._plugin.name,
            start=self._start_mode(),
            end_step=sample.step + steps,
            run=self.node.run,
            **_bounds(module, parameters, self._plan, length, self.node.vehicle.gravity),
        )
        set_stamp(message.stamp, sample.stamp_ns)
        set_stamp(message.trajectory_start, sample.stamp_ns + round(approach * 1e9))
        set_stamp(message.end, message.end_step * period)
        remarks = getattr(module, "remarks", None)
        for text in remarks(parameters) if remarks else []:
            self.node.events.info("plan_remark", text, sample.stamp_ns, always=True)
        return message

    def _start_mode(self) -> str:
        for field in fields(self._plugin.parameters):
            if field.name == "start" and isinstance(field.spec, Choice):
                return str(field.default)
        return "approach"


def _standing(state: VehicleState) -> TrajectoryPoint:
    return TrajectoryPoint(p_w=state.p_w, yaw=euler_from_quaternion(state.q_wb).z)


def _as_state(reference: TrajectoryPoint) -> VehicleState:
    """Return a level vehicle that is where the reference is and moves as it does."""
    turned = quaternion_from_euler(Vec3(0.0, 0.0, reference.yaw))
    return VehicleState(reference.p_w, reference.v_w, turned, Vec3())


def _bounds(module: ModuleType, parameters: Any, plan: Any, length: float, gravity: float) -> dict[str, Any]:
    """Return the fields of FlightPlan that bound a plan of ``length`` s, found at 400 instants; gravity in m/s^2.

    Raises ValueError if a number of a reference is not finite.
    """
    points = [module.sample(parameters, plan, length * index / _SAMPLES) for index in range(_SAMPLES)]
    if not all(map(_is_finite, points)):
        raise ValueError("a number of its reference is not finite")
    low, high = ([side(axis) for axis in zip(*(point.p_w for point in points), strict=True)] for side in (min, max))
    return {
        "low": low,
        "high": high,
        "speed": max(norm(point.v_w) for point in points),
        "acceleration": max(norm(point.a_w) for point in points),
        "tilt": max(math.atan2(math.hypot(point.a_w.x, point.a_w.y), gravity + point.a_w.z) for point in points),
    }


def main() -> None:
    """Run the trajectory node."""
    sys.exit(run(TRAJECTORY, Trajectory, "Reference generator: answers state with reference (eqs. 61-68)."))
