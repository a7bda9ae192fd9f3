"""Whether the motion is that of the thrust along the attitude: what it says of the heading, and of the thrust.

    a = e^(i psi) u + d,   a = change of v in T / T,   u = f / m times body z,   both horizontal, as x + i y
    S = sum conj(u') a' T,   P = sum |u'|^2 T,   Q = sum |a'|^2 T

psi is how far the vehicle's heading is from the one that is assumed, d what else acts. A prime takes the mean of the
last MEMORY s off, for a steady wind tells nothing; the sums forget in that time too. What is left over is Q - 2 Re S +
P with the heading as it is, and Q - 2 |S| + P with the best one, psi = arg S. What is no heading's, a push or a gust,
leaves both large. The strength is the mean of (a_z + g) / u_z: a heavier vehicle, a weaker battery, a lift.
"""

import math
from typing import NamedTuple

from quad_core.geometry import body_z, clamp
from quad_core.types import Quat, Vec3
from quad_core.vehicle import Vehicle

INTERVAL, LONGEST, MEMORY = 50_000_000, 0.2, 1.0
"""T at least in ns, and at most in s, after which a new one begins; for how long in s what was seen counts."""
FOUND, EXPLAINED, LEAST_TURN = 1.0, 0.3, math.radians(30.0)
"""Another heading is found when it explains so many m^2/s^3 more, leaves less than this share of what the present one
leaves, and is so many rad away."""
LOST = 6.0  # m^2/s^3 that no heading explains, from which on a heading that is carried on is not braked along
WEAKEST, STRONGEST, LEAST_THRUST = 0.7, 1.3, 0.3
"""Bounds of the strength, and the vertical thrust over the weight below which it does not show."""


class Evidence(NamedTuple):
    """What was seen: v and u when this interval began at plant step ``step``; means of a and u; S, P, Q; strength."""

    step: int
    v: Vec3
    u: Vec3
    mean_ax: float
    mean_ay: float
    mean_ux: float
    mean_uy: float
    along: float
    across: float
    thrust: float
    motion: float
    strength: float


NO_EVIDENCE = Evidence(-1, Vec3(), Vec3(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # before the first sample


def gathered(before: Evidence, vehicle: Vehicle, v: Vec3, q: Quat, thrust: float, step: int, period: int) -> Evidence:
    """Return the evidence with the sample of ``step``: velocity m/s, attitude as assumed, ``thrust`` N flown.

    ``period`` in ns. Within an interval it stays as it is.
    """
    if before.step >= 0 and (step - before.step) * period < INTERVAL:
        return before
    gap = (step - before.step) * period / 1e9
    up, size = body_z(q), thrust / vehicle.mass
    u = Vec3(size * up.x, size * up.y, size * up.z)
    if before.step < 0 or gap > LONGEST:
        # fmt: off
        return Evidence(
            step, v, u, before.mean_ax, before.mean_ay, before.mean_ux, before.mean_uy,
            before.along, before.across, before.thrust, before.motion, before.strength,
        )
        # fmt: on
    share = gap / MEMORY
    kept = 1.0 - share
    ax, ay = (v.x - before.v.x) / gap, (v.y - before.v.y) / gap
    ux, uy, uz = 0.5 * (u.x + before.u.x), 0.5 * (u.y + before.u.y), 0.5 * (u.z + before.u.z)
    mean_ax, mean_ay = kept * before.mean_ax + share * ax, kept * before.mean_ay + share * ay
    mean_ux, mean_uy = kept * before.mean_ux + share * ux, kept * before.mean_uy + share * uy
    ax, ay, ux, uy = ax - mean_ax, ay - mean_ay, ux - mean_ux, uy - mean_uy
    strength = before.strength
    if uz > LEAST_THRUST * vehicle.gravity:
        shown = ((v.z - before.v.z) / gap + vehicle.gravity) / uz
        strength = clamp(kept * strength + share * shown, WEAKEST, STRONGEST)
    # fmt: off
    return Evidence(
        step, v, u, mean_ax, mean_ay, mean_ux, mean_uy,
        kept * before.along + gap * (ux * ax + uy * ay),
        kept * before.across + gap * (ux * ay - uy * ax),
        kept * before.thrust + gap * (ux * ux + uy * uy),
        kept * before.motion + gap * (ax * ax + ay * ay),
        strength,
    )
    # fmt: on


def begun_anew(before: Evidence) -> Evidence:
    """Return ``before`` without what it says of a heading that is no longer used."""
    return Evidence(-1, before.v, before.u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, before.strength)


def unexplained(evidence: Evidence) -> float:
    """Return what the heading as it is leaves, in m^2/s^3."""
    return evidence.motion - 2.0 * evidence.along + evidence.thrust


def turn_found(evidence: Evidence) -> float:
    """Return psi in rad if another heading clearly explains the motion better, else 0."""
    left = unexplained(evidence)
    if left < FOUND:
        return 0.0
    size = math.sqrt(evidence.along * evidence.along + evidence.across * evidence.across)
    best = evidence.motion - 2.0 * size + evidence.thrust
    if left - best < FOUND or best > EXPLAINED * left:
        return 0.0
    turn = math.atan2(evidence.across, evidence.along)
    return turn if abs(turn) > LEAST_TURN else 0.0


def about_z(angle: float, q: Quat) -> Quat:
    """Return ``q`` turned by ``angle`` rad about the world's z axis."""
    s, c = math.sin(0.5 * angle), math.cos(0.5 * angle)
    return Quat(c * q.x - s * q.y, c * q.y + s * q.x, c * q.z + s * q.w, c * q.w - s * q.z)
