"""Rates and accelerations of the set attitude from jerk and snap of the reference: the flatness chain of Eq. 38.

    theta = atan(m),  m = (cos psi L_x + sin psi L_y) / L_z                 L = a_d + g e_z,  L' = jerk,  L'' = snap
    phi   = atan(cos theta n),  n = (sin psi L_x - cos psi L_y) / L_z

differentiated twice, with (atan m)' = m'/(1 + m^2) and (atan m)'' = m''/(1 + m^2) - 2 m m'^2/(1 + m^2)^2. Of what the
law adds to the reference nothing is differentiated, so no noise enters. Source: Mellinger and Kumar, ICRA 2011, for
Z-Y-X angles; ``test_flatness.py`` derives it with SymPy.
"""

import math
from typing import NamedTuple

from quad_core.types import TrajectoryPoint, Vec3

LEAST_LIFT = 0.05  # share of g below which the vertical part of L gives no direction: the chain then answers zero


class AngleDerivatives(NamedTuple):
    """First and second derivatives of (phi, theta, psi), rad/s and rad/s^2."""

    rates: Vec3
    accelerations: Vec3


class Jet(NamedTuple):
    """A number and its first two time derivatives."""

    value: float
    rate: float
    acceleration: float


def angle_derivatives(reference: TrajectoryPoint, heading: float, gravity: float) -> AngleDerivatives:
    """Return the derivatives of the angles of Eq. 38 along ``reference``.

    ``heading`` is the yaw in rad in whose frame the thrust is tilted, which turns as the reference's does; ``gravity``
    in m/s^2. Roll and pitch get zero where the reference all but falls freely.
    """
    yaw_rate, yaw_acceleration = reference.yaw_rate, reference.yaw_acceleration
    vertical = Jet(reference.a_w.z + gravity, reference.jerk_w.z, reference.snap_w.z)
    if abs(vertical.value) < LEAST_LIFT * gravity:
        return AngleDerivatives(Vec3(0.0, 0.0, yaw_rate), Vec3(0.0, 0.0, yaw_acceleration))
    forward, right = turned_frame(reference, heading)
    pitch = arctangent(quotient(forward, vertical))
    roll = arctangent(product(cosine(pitch), quotient(right, vertical)))
    return AngleDerivatives(
        Vec3(roll.rate, pitch.rate, yaw_rate), Vec3(roll.acceleration, pitch.acceleration, yaw_acceleration)
    )


def turned_frame(reference: TrajectoryPoint, heading: float) -> tuple[Jet, Jet]:
    """Return cos psi L_x + sin psi L_y and sin psi L_x - cos psi L_y (m/s^2) with their derivatives."""
    c, s = math.cos(heading), math.sin(heading)
    a, j, snap = reference.a_w, reference.jerk_w, reference.snap_w
    rate, acceleration = reference.yaw_rate, reference.yaw_acceleration
    forward, right = c * a.x + s * a.y, s * a.x - c * a.y
    along, across = c * j.x + s * j.y, s * j.x - c * j.y
    forward_rate = along - rate * right
    right_rate = across + rate * forward
    return (
        Jet(forward, forward_rate, c * snap.x + s * snap.y - rate * across - acceleration * right - rate * right_rate),
        Jet(right, right_rate, s * snap.x - c * snap.y + rate * along + acceleration * forward + rate * forward_rate),
    )


def quotient(above: Jet, below: Jet) -> Jet:
    """Return above/below with its derivatives; ``below`` is not 0."""
    value = above.value / below.value
    rate = (above.rate - value * below.rate) / below.value
    acceleration = (above.acceleration - 2.0 * rate * below.rate - value * below.acceleration) / below.value
    return Jet(value, rate, acceleration)


def product(a: Jet, b: Jet) -> Jet:
    """Return a b with its derivatives."""
    return Jet(
        a.value * b.value,
        a.rate * b.value + a.value * b.rate,
        a.acceleration * b.value + 2.0 * a.rate * b.rate + a.value * b.acceleration,
    )


def cosine(angle: Jet) -> Jet:
    """Return the cosine of an angle in rad with its derivatives."""
    c, s = math.cos(angle.value), math.sin(angle.value)
    return Jet(c, -s * angle.rate, -c * angle.rate * angle.rate - s * angle.acceleration)


def arctangent(x: Jet) -> Jet:
    """Return atan x in rad with its derivatives."""
    slope = 1.0 / (1.0 + x.value * x.value)
    return Jet(
        math.atan(x.value), slope * x.rate, slope * x.acceleration - 2.0 * x.value * slope * slope * x.rate * x.rate
    )
