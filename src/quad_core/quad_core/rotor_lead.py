"""Torque commanded ahead of rotors that lag, as an attitude controller may be asked to (an addition to the paper).

    y_k+1 = b y_k + (1 - b) tau_k,   b = e^(-T/T_f)          torque that the rotors are to give, N m
    u_k   = y_k + (1 - b)/(1 - a) (tau_k - y_k),   a = e^(-T/T_r)

tau is what the law asks for, u what is sent. Rotors of time constant T_r that get u give y exactly: their lag is
exchanged for T_f, the shorter the dearer, since noise of the law's torque is sent on (1 - b)/(1 - a), about T_r/T_f
times as large. Thrust is sent unchanged: the position law's loop is slow compared with the rotors.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, add, scale, subtract
from quad_core.parameters import Flag, Real
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Vehicle


class RotorLead(NamedTuple):
    """Whether torque is commanded ahead of the rotors, and what lag is left."""

    enabled: Annotated[
        bool, Flag("torque is commanded ahead of vehicle.rotor_time_constant; false: as the law asks")
    ] = False
    remaining_lag: Annotated[
        float, Real("s", "time constant T_f of the torque that is left; none is added to faster rotors", 1e-4, 1.0)
    ] = 0.03


class Given(NamedTuple):
    """What the rotors give by now if they lag as the vehicle says: y in N m."""

    torque_b: Vec3 = Vec3()


class LeadShown(NamedTuple):
    """What the internals show: the torque sent less the law's in N m."""

    torque_lead_b: Vec3 = Vec3()


def ahead_of_rotors(
    parameters: RotorLead, vehicle: Vehicle, given: Given, wrench: Wrench, dt: float
) -> tuple[Wrench, Given, LeadShown]:
    """Return the wrench to send for the next ``dt`` s in place of ``wrench``, the memory and what is shown of it."""
    lag = vehicle.rotor_time_constant
    if lag <= parameters.remaining_lag:
        return wrench, Given(wrench.torque_b), LeadShown(ZERO)
    missing = subtract(wrench.torque_b, given.torque_b)
    share = -math.expm1(-dt / parameters.remaining_lag)
    torque = add(given.torque_b, scale(share / -math.expm1(-dt / lag), missing))
    given = Given(add(given.torque_b, scale(share, missing)))
    return Wrench(wrench.thrust, torque), given, LeadShown(subtract(torque, wrench.torque_b))
