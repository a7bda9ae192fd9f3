"""From N and N m to the normalised setpoints of PX4, and what its mixer will make of them.

PX4 allocates with its own matrix: motors = M (torque setpoint, thrust setpoint), M being the inverse of the rotors'
effectiveness (CA_ROTORn_PX, PY, KM), each column divided by a scale:

::

    roll, pitch: the larger of sqrt(|column|^2 / (rotors / 2))        yaw: the column's maximum
    thrust:      the mean of the column's magnitudes

The setpoints for a wrench w undo that: sp = M^-1 u with the rotor commands u = E^-1 w / T_m, where E holds the true
arms and drag ratio. For a symmetric X with arms l (m), s = sqrt(1/2) and FLU torque this is

::

    thrust_z = -T / (4 T_m)       torque = (t_x / (4 l T_m s), -t_y / (4 l T_m s), -t_z / (4 k_q T_m))

Rotors are counted as PX4 counts them: 0 front right, 1 rear left, 2 front left, 3 rear right.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_autopilot import frames, thrust
from quad_core.geometry import clamp
from quad_core.parameters import ParameterError
from quad_core.types import Actuation, Rotors, Vec3, Wrench
from quad_px4.parameters import INTERFACE, AirframeParameters

MOTORS = 12  # controls in an ActuatorMotors message; those without a motor are NaN
FLAG_TOLERANCE = 1e-6
_LEAST_SHARE = 1e-6  # of the thrust of a hover, for each rotor

Array = NDArray[np.float64]


class Mapping(NamedTuple):
    """What stands between a wrench and PX4: 4 x 4 matrices; made by ``build``.

    ``rotors_of_wrench`` gives the thrusts in N, in PX4's order, for FRD torque in N m and thrust in N;
    ``wrench_of_rotors`` is its inverse; ``setpoint_of_rotors`` gives normalised torque and thrust for rotor commands
    0..1. ``order`` names the PX4 rotors that are the stack's 1 rear right, 2 front right, 3 front left, 4 rear left.
    """

    airframe: AirframeParameters
    rotors_of_wrench: Array
    wrench_of_rotors: Array
    setpoint_of_rotors: Array
    order: tuple[int, int, int, int]


class ThrustTorque(NamedTuple):
    """VehicleThrustSetpoint and VehicleTorqueSetpoint: FRD, normalised to -1..1."""

    thrust: Vec3
    torque: Vec3


def build(airframe: AirframeParameters) -> Mapping:
    """Return the mapping of an airframe; raises ParameterError for an unknown thrust or rotors that cannot fly it."""
    thrust.require(airframe.max_rotor_thrust, INTERFACE.page, "airframe.max_rotor_thrust")
    rotors = (airframe.rotor0, airframe.rotor1, airframe.rotor2, airframe.rotor3)
    quadrants = [(rotor.px > 0.0, rotor.py > 0.0) for rotor in rotors]
    one_each = [(False, True), (True, True), (True, False), (False, False)]
    if sorted(quadrants) != sorted(one_each) or any(rotor.px == 0.0 or rotor.py == 0.0 for rotor in rotors):
        found = ", ".join(f"({rotor.px:g}, {rotor.py:g})" for rotor in rotors)
        raise ParameterError(f"airframe.rotorN.px, py: found {found}, expected one rotor in each quadrant (X)")
    px4 = np.array([[-rotor.py, rotor.px, rotor.km, 1.0] for rotor in rotors]).T
    ratios = [math.copysign(airframe.drag_ratio or abs(rotor.km), rotor.km) for rotor in rotors]
    true = np.array([[-rotor.py, rotor.px, ratio, 1.0] for rotor, ratio in zip(rotors, ratios, strict=True)]).T
    if min(abs(np.linalg.det(px4)), abs(np.linalg.det(true))) < 1e-9:
        raise ParameterError("airframe.rotorN.km: found rotors that cannot yaw, expected opposite rotors of one sign")
    mix, rotors_of_wrench = np.linalg.inv(px4), np.linalg.inv(true)
    if min(hover := rotors_of_wrench[:, 3].tolist()) < _LEAST_SHARE:
        found = ", ".join(f"{share:.3g}" for share in hover)
        raise ParameterError(f"airframe.rotorN: found shares of {found} in the thrust of a hover, expected all above 0")
    mix /= _scales(mix)
    first, second, third, fourth = (quadrants.index(quadrant) for quadrant in one_each)
    return Mapping(airframe, rotors_of_wrench, true, np.linalg.inv(mix), (first, second, third, fourth))


def _scales(mix: Array) -> Array:
    """Return by what PX4 divides each column of its mixer."""
    tilting = float(np.sqrt(np.max(np.sum(mix[:, :2] ** 2, axis=0)) / 2.0))
    return np.array([tilting, tilting, np.max(mix[:, 2]), np.mean(np.abs(mix[:, 3]))])


def compensated(airframe: AirframeParameters, fraction: float) -> float:
    """Return what PX4 needs for ``fraction`` (0..1) of a rotor's largest thrust."""
    return thrust.compensated(airframe.thr_mdl_fac, airframe.thrust_curve, fraction)


def slope(airframe: AirframeParameters, fraction: float) -> float:
    """Return the derivative of ``compensated`` at ``fraction``, by which a small torque about a hover is scaled."""
    if airframe.thr_mdl_fac == airframe.thrust_curve:
        return 1.0
    u = thrust.signal(clamp(fraction, 0.01, 1.0), airframe.thrust_curve)
    made = 2.0 * airframe.thrust_curve * u + 1.0 - airframe.thrust_curve
    return (2.0 * airframe.thr_mdl_fac * u + 1.0 - airframe.thr_mdl_fac) / made


def rotor_commands(mapping: Mapping, wrench: Wrench) -> Array:
    """Return the share of its largest thrust that each rotor (PX4's order) must give for a FLU ``wrench``."""
    return _shares(mapping, *frames.body(wrench.torque_b), wrench.thrust)


def _shares(mapping: Mapping, *wrench: float) -> Array:
    forces: Array = mapping.rotors_of_wrench @ np.array(wrench)
    return forces / mapping.airframe.max_rotor_thrust


def allocated(mapping: Mapping, wrench: Wrench) -> Array:
    """Return what each rotor (PX4's order) can give of a FLU ``wrench``, 0..1 of its largest thrust.

    Where they cannot give all of it, yaw gives way first, then thrust, which is never raised, then roll and pitch:
    clipped one by one, rotors that yaw takes to their ends would give no roll nor pitch at all.
    """
    whole = rotor_commands(mapping, wrench)
    if whole.min() >= 0.0 and whole.max() <= 1.0:
        return whole
    torque, lift = frames.body(wrench.torque_b), max(wrench.thrust, 0.0)
    unit = _shares(mapping, 0.0, 0.0, 0.0, 1.0)
    tilt, yaw = _shares(mapping, torque.x, torque.y, 0.0, 0.0), _shares(mapping, 0.0, 0.0, torque.z, 0.0)
    part = 1.0
    for t, u in zip(tilt, unit, strict=True):
        if part * t < -lift * u:
            part = -lift * u / t
        for other, its_unit in zip(tilt, unit, strict=True):
            spread = t * its_unit - other * u  # one rotor at its most, the other at rest
            if part * spread > its_unit:
                part = its_unit / spread
    tilt = part * tilt
    level = min(lift, *((1.0 - tilt) / unit)) * unit + tilt
    part = 1.0
    for share, turn in zip(level, yaw, strict=True):
        room = max(share if turn < 0.0 else 1.0 - share, 0.0)  # rounding may have left less than none
        if part * abs(turn) > room:
            part = room / abs(turn)
    found: Array = np.clip(level + part * yaw, 0.0, 1.0)
    return found


def thrust_torque(mapping: Mapping, wrench: Wrench) -> ThrustTorque:
    """Return the normalised setpoints for a FLU ``wrench`` in N and N m."""
    x, y, z, collective = (mapping.setpoint_of_rotors @ rotor_commands(mapping, wrench)).tolist()
    gain = slope(mapping.airframe, collective)
    torque = Vec3(_unit(gain * x), _unit(gain * y), _unit(gain * z))
    return ThrustTorque(Vec3(0.0, 0.0, -compensated(mapping.airframe, clamp(collective, 0.0, 1.0))), torque)


def motors(mapping: Mapping, wrench: Wrench) -> list[float]:
    """Return the controls of ActuatorMotors for a FLU ``wrench``: 0..1 for rotors 0 to 3, NaN for the others."""
    commands = [compensated(mapping.airframe, u) for u in allocated(mapping, wrench).tolist()]
    return commands + [math.nan] * (MOTORS - len(commands))


def collective(mapping: Mapping, newtons: float) -> Vec3:
    """Return the normalised thrust vector (FRD) for a collective thrust in N."""
    fraction = clamp(newtons / (4.0 * mapping.airframe.max_rotor_thrust), 0.0, 1.0)
    return Vec3(0.0, 0.0, -compensated(mapping.airframe, fraction))


def predict(mapping: Mapping, wrench: Wrench) -> Actuation:
    """Return what the rotors will make of a FLU ``wrench``: a prediction, not a measurement.

    Speeds are unknown and 0. When rotors saturate PX4 gives way in much the same order as ``allocated``; the achieved
    numbers are then only roughly right.
    """
    largest = mapping.airframe.max_rotor_thrust
    forces = largest * allocated(mapping, wrench)
    x, y, z, total = (mapping.wrench_of_rotors @ forces).tolist()
    made, asked = frames.body(Vec3(x, y, z)), wrench.torque_b
    slack = FLAG_TOLERANCE * largest
    return Actuation(
        Rotors(0.0, 0.0, 0.0, 0.0),
        Rotors(*forces[list(mapping.order)].tolist()),
        total,
        made,
        total < wrench.thrust - slack,
        total > wrench.thrust + slack,
        abs(made.x - asked.x) > slack,
        abs(made.y - asked.y) > slack,
        abs(made.z - asked.z) > slack,
    )


def _unit(value: float) -> float:
    return clamp(value, -1.0, 1.0)
