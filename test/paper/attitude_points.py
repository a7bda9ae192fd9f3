"""Random points for the attitude law: every symbol of Eqs. 39-60, other gains on every axis."""

import random

from paper_points import VEHICLE_VALUES

# Angle, rate and name of each axis.
AXES = ((1, 2, "phi"), (3, 4, "theta"), (5, 6, "psi"))


def attitude_points(count: int, seed: int, tilt: float = 1.2) -> list[dict[str, float]]:
    """Return ``count`` assignments; roll and pitch within ``tilt`` rad, yaw anywhere."""
    chance = random.Random(seed)
    points = []
    for _ in range(count):
        point = dict(VEHICLE_VALUES)
        for angle, rate, name in AXES:
            widest = tilt if name != "psi" else 3.1
            at = chance.uniform(-widest, widest)
            point |= {
                f"x{angle}": at,
                f"x{rate}": chance.uniform(-3.0, 3.0),
                f"x{angle}d": at - chance.uniform(-0.9, 0.9),
                f"x{angle}d_dot": chance.uniform(-2.0, 2.0),
                f"x{angle}d_ddot": chance.uniform(-5.0, 5.0),
                f"S{angle}": chance.uniform(-3.0, 3.0),
                f"delta_{name}1": chance.uniform(5.0, 50.0),
                f"delta_{name}2": chance.uniform(3.0, 12.0),
                f"rho_{name}1": chance.uniform(1.0, 5.0),
                f"rho_{name}2": chance.uniform(1.0, 4.0),
                f"sigma_{name}": chance.uniform(1.1, 2.2),
                f"d_{name}": chance.uniform(-2.0, 2.0),
            }
            for index in (1, 2, 3):
                point[f"Delta_{name}{index}"] = chance.uniform(0.5, 3.0)
                point[f"Q_{name}{index}"] = chance.uniform(0.5, 3.0)
                point[f"Q_{name}{index}_hat"] = chance.uniform(0.1, 3.0)
        point["delta"] = chance.uniform(0.1, 2.0)
        points.append(point)
    return points
