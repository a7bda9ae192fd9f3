"""Case 1 and Case 2 on every plant by the same unchanged laws, RMSE side by side; one of them over ROS as well."""

from figures import Figures
from flying import CONFIG

from quad_flight.flight import flight_from_files, fly

PLANTS = ("paper", "rigid_body", "mujoco")
LIMIT = 0.02


def main():
    figures = Figures()
    for case in ("case1", "case2"):
        files = [CONFIG / f"{name}.yaml" for name in ("vehicles/paper", "controllers/tuned", f"scenarios/{case}")]
        for plant in PLANTS:
            result = fly(flight_from_files(files, {"simulator": {"plant": plant}}), compiled=plant != "mujoco")
            figures.check(result.outcome == "ended", f"{case} on {plant}: {result.outcome}")
            figures.at_most(f"{case} on {plant}: 3-D RMSE, seed 1", result.rmse, LIMIT, "m")
    return figures.code()
