"""Random points for the two laws and the plants: an asymmetric vehicle, other gains on every axis."""

import random

from quad_core.vehicle import Vehicle

# Inertias all different, drag and integral gains large: what a flight would hide decides here.
VEHICLE = Vehicle()._replace(
    mass=0.83,
    gravity=9.71,
    arm_length=0.27,
    inertia_xx=4.1e-3,
    inertia_yy=6.7e-3,
    inertia_zz=9.8e-3,
    lift_coefficient=3.3e-3,
    torque_coefficient=2.1e-2,
    drag_coefficient=0.62,
    drag_torque_coefficient=3.9e-3,
)
VEHICLE_VALUES = {
    "m": VEHICLE.mass,
    "g": VEHICLE.gravity,
    "d": VEHICLE.arm_length,
    "I_xx": VEHICLE.inertia_xx,
    "I_yy": VEHICLE.inertia_yy,
    "I_zz": VEHICLE.inertia_zz,
    "k_L": VEHICLE.lift_coefficient,
    "k_M": VEHICLE.torque_coefficient,
    "k_F": VEHICLE.drag_coefficient,
    "k_T": VEHICLE.drag_torque_coefficient,
}
# First index (position), second index (velocity, adaptive gain) and drag coefficient of each axis.
INDICES = ((7, 8), (9, 10), (11, 12))


def position_points(count: int, seed: int) -> list[dict[str, float]]:
    """Return ``count`` assignments of every symbol of Eqs. 18-38."""
    chance = random.Random(seed)
    points = []
    for _ in range(count):
        point = dict(VEHICLE_VALUES)
        for first, second in INDICES:
            point |= {
                f"x{first}": chance.uniform(-4.0, 4.0),
                f"x{second}": chance.uniform(-4.0, 4.0),
                f"x{first}d": chance.uniform(-4.0, 4.0),
                f"x{first}d_dot": chance.uniform(-3.0, 3.0),
                f"x{first}d_ddot": chance.uniform(-3.0, 3.0),
                f"Gamma{first}": chance.uniform(-2.0, 2.0),
                f"k{first}": chance.uniform(0.3, 2.0),
                f"xi{first}": chance.uniform(1.5, 5.0),
                f"xi{second}_hat": chance.uniform(0.2, 6.0),
                f"alpha{second}": chance.uniform(0.5, 4.0),
            }
        point |= {f"d_{axis}": chance.uniform(-2.0, 2.0) for axis in "xyz"}
        point |= {f"U_{axis}": chance.uniform(-6.0, 6.0) for axis in "xyz"}
        point["psi_d"] = chance.uniform(-3.1, 3.1)
        points.append(point)
    return points
