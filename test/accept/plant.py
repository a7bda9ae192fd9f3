"""Scenario `flight` with x500: 20 seeds, mass +30 % and -30 %, and the delay at which it is lost, without ROS."""

from figures import Figures
from flying import CONFIG

from quad_flight.flight import flight_from_files, fly

SEEDS = range(101, 121)
"""None of those that the gains were found with (1 to 8)."""
FILES = [CONFIG / f"{name}.yaml" for name in ("vehicles/x500", "controllers/x500", "scenarios/flight")]
MASS = 2.064
RMSE_LIMIT, ACCELERATION, LOST = 0.10, 2.0, 0.5
DELAYS = [0.002 * i for i in range(5, 51)]
FEW = 5


def main():
    figures = Figures()
    path = flown(SEEDS[0], logging=True).topics["reference"]
    curve = path["a_w"][path["trajectory_time"] > 0.0]
    peak = float((curve**2).sum(axis=1).max() ** 0.5)
    figures.check(peak >= ACCELERATION, f"Case 2 as flown: peak acceleration {peak:.3f} m/s^2, at least {ACCELERATION}")
    for name, error in (("nominal mass", 0.0), ("mass +30 %", 0.3 * MASS), ("mass -30 %", -0.3 * MASS)):
        results = [flown(seed, mass=error) for seed in SEEDS]
        ended = sum(result.outcome == "ended" for result in results)
        figures.check(ended == len(results), f"flight, {name}: {ended} of {len(results)} seeds flown to the end")
        errors = [result.rmse for result in results]
        figures.at_most(f"flight, {name}: worst 3-D RMSE (best {min(errors):.4f} m)", max(errors), RMSE_LIMIT, "m")
        largest = max(result.score.largest_error for result in results)
        print(f"     flight, {name}: largest error {largest:.4f} m")
    lost = next((delay for delay in DELAYS if any(is_lost(flown(seed, delay=delay)) for seed in SEEDS[:FEW])), None)
    figures.check(lost is not None, f"flight: lost (error above {LOST} m, {FEW} seeds) at a delay of {lost} s")
    return figures.code()


def flown(seed, mass=0.0, delay=0.01, logging=False):
    changes = {
        "/**": {"flight.seed": seed},
        "simulator": {"rigid_body.mass_error": mass, "sensor.delay": delay},
    }
    return fly(flight_from_files(FILES, changes), compiled=True, logging=logging)


def is_lost(result):
    return result.outcome != "ended" or not result.score.largest_error <= LOST
