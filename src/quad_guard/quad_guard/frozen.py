"""Whether a state that repeats itself is frozen: a live vehicle would have shown a change by now.

    v t + n s >= 2 grain,  n u >= 2 grain,  |omega| t >= 4 grain,  w >= 2 grain       on any axis
    u' = (f - f_0) / m,  s' = u,  w' = J^-1 (tau - tau_0)

t is the time since the state last changed, v, n and omega are its velocity, body z axis and body rate, f_0 and tau_0
the wrench 0.05 s after that change, when the controllers have answered it, f and tau the one flown now. The grain is
the smallest change that the estimate has shown so far: an estimate in whole millimetres repeats itself in a calm hover,
one with noise never does. On the ground only thrust beyond the weight moves a vehicle.
"""

from typing import NamedTuple

from quad_core.geometry import body_z, clamp, norm
from quad_core.node_parameters import ContactRule
from quad_core.types import Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle, max_thrust
from quad_guard.checks import BodyState

COARSEST = 0.02  # m, m/s, rad/s and parts of a quaternion: the grain of an estimate that has not changed yet

LEAST = 1e-9  # m, m/s, rad, rad/s: a change below need not show
SETTLED = 0.05  # s after a change until the wrench is that of the unchanged state


class Grain(NamedTuple):
    """The smallest change of an estimate on any axis: m, m/s, rad/s; of a part of the quaternion."""

    p: float
    v: float
    omega: float
    q: float


class Missing(NamedTuple):
    """What a state that repeats itself has not shown: ``time`` s, ``speed`` u, ``shift`` s, ``turn`` w, as above.

    ``held`` is the wrench f_0, tau_0. ``shows``: a live vehicle would have shown it since the last change.
    """

    held: Wrench
    time: float
    speed: float
    shift: float
    turn: Vec3
    shows: bool


COARSEST_GRAIN = Grain(COARSEST, COARSEST, COARSEST, COARSEST)  # the grain before the first change
NOTHING_MISSING = Missing(Wrench(), 0.0, 0.0, 0.0, Vec3(), False)  # what is missing at a change


def finer(grain: Grain, before: BodyState, after: VehicleState) -> Grain:
    """Return the grain after a change from ``before`` to ``after``."""
    a, b = before.q_wb, after.q_wb
    return Grain(
        smallest(grain.p, before.p_w, after.p_w),
        smallest(grain.v, before.v_w, after.v_w),
        smallest(grain.omega, before.omega_b, after.omega_b),
        smaller(smaller(smaller(smaller(grain.q, a.x, b.x), a.y, b.y), a.z, b.z), a.w, b.w),
    )


def smallest(grain: float, before: Vec3, after: Vec3) -> float:
    """Return the grain of a vector after a change."""
    return smaller(smaller(smaller(grain, before.x, after.x), before.y, after.y), before.z, after.z)


def smaller(grain: float, before: float, after: float) -> float:
    """Return the grain of a number after a change; a number that stays the same does not tell its grain."""
    change = abs(after - before)
    return change if 0.0 < change < grain else grain


def missed(
    rule: ContactRule,
    vehicle: Vehicle,
    grain: Grain,
    missing: Missing,
    last: BodyState,
    height: float,
    flown: Wrench,
    dt: float,
) -> Missing:
    """Return what is missing ``dt`` s later under ``flown`` if the state still is ``last``, ``height`` m up."""
    thrust, weight = clamp(flown.thrust, 0.0, max_thrust(vehicle)), vehicle.mass * vehicle.gravity
    low = height <= rule.stop_height
    if low and thrust <= weight and norm(last.v_w) < rule.speed:
        return NOTHING_MISSING
    held = missing.held if missing.time >= SETTLED else flown
    before = weight if low else clamp(held.thrust, 0.0, max_thrust(vehicle))
    speed = missing.speed + dt * (thrust - before) / vehicle.mass
    time, shift = missing.time + dt, missing.shift + dt * speed
    turn = Vec3(
        missing.turn.x + dt * (flown.torque_b.x - held.torque_b.x) / vehicle.inertia_xx,
        missing.turn.y + dt * (flown.torque_b.y - held.torque_b.y) / vehicle.inertia_yy,
        missing.turn.z + dt * (flown.torque_b.z - held.torque_b.z) / vehicle.inertia_zz,
    )
    up, v = body_z(last.q_wb), last.v_w
    shows = (
        missing.shows
        or exceeds(grain.omega, turn.x, turn.y, turn.z)
        or exceeds(grain.v, up.x * speed, up.y * speed, up.z * speed)
        or exceeds(grain.p, time * v.x + up.x * shift, time * v.y + up.y * shift, time * v.z + up.z * shift)
        or time * norm(last.omega_b) >= max(4.0 * grain.q, LEAST)
    )
    return Missing(held, time, speed, shift, turn, shows)


def exceeds(grain: float, x: float, y: float, z: float) -> bool:
    """Return whether a change of a vector must show on one of its axes."""
    least = max(2.0 * grain, LEAST)
    return abs(x) >= least or abs(y) >= least or abs(z) >= least
