"""Case 1 and Case 2 in the disturbance, 20 seeds, presets tuned and minimal: RMSE of each, without ROS."""

from figures import Figures
from flying import CONFIG

from quad_campaign.flight import flight_from_files
from quad_campaign.sweep import sweep

LIMITS = {"tuned": 0.02, "minimal": 0.08}


def main():
    figures = Figures()
    for preset, limit in LIMITS.items():
        for case in ("case1", "case2"):
            files = ("vehicles/paper", f"controllers/{preset}", f"scenarios/{case}")
            flight = flight_from_files([CONFIG / f"{file}.yaml" for file in files])
            results = sweep(flight, range(1, 21))
            ended = sum(result.outcome == "ended" for result in results)
            figures.check(ended == 20, f"{case} {preset}: {ended} of 20 seeds flown to the end")
            figures.at_most(f"{case} {preset}: worst 3-D RMSE", max(result.rmse for result in results), limit, "m")
            print(f"     {case} {preset}: best 3-D RMSE {min(result.rmse for result in results):.4g} m")
            print(f"     {case} {preset}: largest error {max(result.largest_error for result in results):.4g} m")
    return figures.code()
