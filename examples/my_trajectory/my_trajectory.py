"""A trajectory of your own: straight up with a smooth start and end.

    z(t) = z_0 + h (10 s^3 - 15 s^4 + 6 s^5),    s = t / T

Fly it: scripts/fly my_trajectory --set trajectory.my_trajectory.height=3
"""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle


class Parameters(NamedTuple):
    """Where to, and how long the way up and the stay there last."""

    height: Annotated[float, Real("m", "h: how far up", 0.0, 100.0)] = 2.0
    climb: Annotated[float, Real("s", "T: how long the climb lasts", 0.1, 600.0)] = 4.0
    duration: Annotated[float, Real("s", "how long the flight lasts", 0.1, 3600.0)] = 6.0


class Plan(NamedTuple):
    """What is decided once, before step 0: the place above which to climb."""

    start_w: Vec3 = Vec3()


def plan(parameters: Parameters, vehicle: Vehicle, start: VehicleState) -> Plan:
    """Return the plan for a vehicle at ``start``."""
    return Plan(start.p_w)


def duration(parameters: Parameters, plan: Plan) -> float:
    """Return how long the flight lasts in s."""
    return parameters.duration


def sample(parameters: Parameters, plan: Plan, time: float) -> TrajectoryPoint:
    """Return the reference ``time`` s after take-off."""
    zero = Vec3(0.0, 0.0, 0.0)
    start, height = plan.start_w, parameters.height
    if time >= parameters.climb:
        above = Vec3(start.x, start.y, start.z + height)
        return TrajectoryPoint(time, above, zero, zero, zero, zero, 0.0, 0.0, 0.0)
    rate = 1.0 / parameters.climb
    s = time * rate
    z = height * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    v = height * rate * 30.0 * s * s * (1.0 - 2.0 * s + s * s)
    a = height * rate * rate * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s * s)
    jerk = height * rate * rate * rate * 60.0 * (1.0 - 6.0 * s + 6.0 * s * s)
    snap = height * rate * rate * rate * rate * 360.0 * (2.0 * s - 1.0)
    return TrajectoryPoint(
        time,
        Vec3(start.x, start.y, start.z + z),
        Vec3(0.0, 0.0, v),
        Vec3(0.0, 0.0, a),
        Vec3(0.0, 0.0, jerk),
        Vec3(0.0, 0.0, snap),
        0.0,
        0.0,
        0.0,
    )
