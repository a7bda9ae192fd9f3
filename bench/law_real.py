"""Presets for real conditions on held-out seeds: Case 2, plant rigid_body, start approach; also the delay margin.

  paper        vehicle paper: 10 ms, noise of scenario flight, rotor lag 30 ms, alone and together
  x500         vehicle x500: noise, 20 ms, lag 30 ms, mass 10 % above and 10 % below, each with all seeds
  crazyflie21  the same for vehicle crazyflie21 with 15 ms and its own lag of 30 ms
  channels     gyro 2 ms old, attitude 5 ms, position and velocity 30 ms at 50 Hz, noise and lag, of --vehicle: without
               prediction, and predicted over the age of each channel, which the state carries
  mujoco       the last conditions of --vehicle with plant mujoco beside rigid_body, each seed with both
  margin       largest extra delay of all states in ms that the prediction is set to, by bisection, without noise

Examples:
  python bench/law_real.py paper --preset paper_real
  python bench/law_real.py x500 --preset x500_real --preset x500_pid_real --preset x500
  python bench/law_real.py channels --vehicle x500 --preset x500_real
  python bench/law_real.py mujoco --vehicle x500 --preset x500_real --seeds 5
"""

import argparse
import sys

import numpy as np

from quad_flight.flight import fly, from_names
from quad_flight.many import sweep

NOISE = [
    f"simulator.sensor.{channel}_noise={size}"
    for channel, size in (("position", 0.01), ("velocity", 0.02), ("attitude", 3.4907e-3), ("rate", 8.7266e-3))
]
LAG = ["vehicle.rotor_time_constant=0.03"]
CONTROLLERS = ("position_controller", "attitude_controller")
GUARD_OFF = "simulator.guard.enabled=false"
FIRST, LOST = 1001, 0.3
"""The first held-out seed; m beyond which a flight counts as lost."""


def conditions(vehicle):
    """Return {name: settings} of a vehicle."""
    if vehicle == "paper":
        late = ["simulator.sensor.delay=0.01"]
        return {
            "nothing": [],
            "10 ms": late,
            "10 ms, noise": [*late, *NOISE],
            "10 ms, lag": [*late, *LAG],
            "10 ms, noise, lag": [*late, *NOISE, *LAG],
        }
    delay, mass, lag = (0.02, 0.2064, LAG) if vehicle == "x500" else (0.015, 0.0027, [])
    base = [f"simulator.sensor.delay={delay}", *NOISE, *lag]
    return {f"all, mass {sign}10 %": [*base, f"simulator.rigid_body.mass_error={sign}{mass}"] for sign in ("+", "-")}


def flown(vehicle, preset, settings, seeds):
    """Return the results of the flights of Case 2 on the held-out seeds, in order."""
    flight = from_names("case2", preset=preset, vehicle=vehicle, settings=[GUARD_OFF, *settings])
    return sweep(flight, range(FIRST, FIRST + seeds), threads=2)


def table(vehicle, presets, seeds, conditions):
    """Print one row per preset and condition, ``conditions`` being {name: settings}."""
    print("| preset | conditions | RMSE, median | worst | largest error | torque variation, median | worst | lost |")
    print("|---|---|---|---|---|---|---|---|")
    for preset in presets:
        for name, settings in conditions.items():
            results = flown(vehicle, preset, settings, seeds)
            good = [one for one in results if one.outcome == "ended" and one.score.largest_error <= LOST]
            lost = f"{len(results) - len(good)} of {len(results)}"
            if not good:
                print(f"| {preset} | {name} | | | | | | {lost} |", flush=True)
                continue
            rmse = 1e3 * np.array([one.rmse for one in good])
            torque = np.array([one.score.torque_variation for one in good])
            largest = 1e3 * max(one.score.largest_error for one in good)
            print(
                f"| {preset} | {name} | {np.median(rmse):.1f} mm | {rmse.max():.1f} mm | {largest:.0f} mm | "
                f"{np.median(torque):.1f} N m | {torque.max():.1f} N m | {lost} |",
                flush=True,
            )


def per_channel():
    """Return {name: settings}: sensors with a delay and a rate per channel, and what the prediction is told of them."""
    sensors = {"rate_delay": 0.002, "attitude_delay": 0.005, "position_delay": 0.03, "velocity_delay": 0.03}
    base = [f"simulator.sensor.{name}={value}" for name, value in sensors.items()]
    base += ["simulator.sensor.position_every=10", *NOISE, *LAG]  # 50 Hz beside a loop of 500 Hz
    told = {"position": 0.03, "attitude": 0.005, "rate": 0.002}
    return {
        "without prediction": [*base, *(f"{role}.prediction.enabled=false" for role in CONTROLLERS)],
        "an age per channel": [*base, *predicting(told)],
    }


def predicting(ages):
    """Return the settings that predict over {channel: age in s} in both controllers."""
    found = [f"{role}.prediction.{channel}_age={age}" for role in CONTROLLERS for channel, age in ages.items()]
    return [*found, *(f"{role}.prediction.{name}" for role in CONTROLLERS for name in ("enabled=true", "max_age=0.1"))]


def beside_mujoco(vehicle, presets, seeds):
    """Print how the same flights differ when MuJoCo integrates the vehicle: ratios of RMSE, seed by seed."""
    print("| preset | conditions | rigid_body, median | mujoco, median | mujoco over rigid_body, median | range |")
    print("|---|---|---|---|---|---|")
    name, settings = list(conditions(vehicle).items())[-1]
    settings = [*settings, "vehicle.rotor_drag_coefficient=0.0"]  # plant mujoco has none
    other = [text.replace("simulator.rigid_body.", "simulator.mujoco.") for text in settings]
    for preset in presets:
        flight = from_names(
            "case2", preset=preset, vehicle=vehicle, settings=["simulator.plant=mujoco", GUARD_OFF, *other]
        )
        ours = np.array([one.rmse for one in flown(vehicle, preset, settings, seeds)])
        theirs = np.array([fly(flight._replace(seed=seed)).rmse for seed in range(FIRST, FIRST + seeds)])
        ratios = theirs / ours
        print(
            f"| {preset} | {name} | {1e3 * np.median(ours):.1f} mm | {1e3 * np.median(theirs):.1f} mm | "
            f"{np.median(ratios):.4f} | {ratios.min():.4f} to {ratios.max():.4f} |",
            flush=True,
        )


def late(vehicle, preset, delay):
    """Return Case 2 of the first held-out seed, its state this late and predicted over just that."""
    settings = [f"simulator.sensor.delay={delay}", *predicting(dict.fromkeys(("position", "attitude", "rate"), delay))]
    return flown(vehicle, preset, settings, 1)[0]


def survives(one, quiet):
    """Return whether a flight stays within 0.3 m and does not ring: at most 10 times the torque variation ``quiet``."""
    return one.outcome == "ended" and one.score.largest_error <= LOST and one.score.torque_variation <= 10.0 * quiet


def margins(vehicle, presets):
    """Print the delay up to which each preset flies, to 1 ms."""
    print("| preset | delay margin |\n|---|---|")
    for preset in presets:
        low, high = 0.0, 0.1
        quiet = late(vehicle, preset, 0.0).score.torque_variation
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if survives(late(vehicle, preset, middle), quiet) else (low, middle)
        print(f"| {preset} | {1e3 * low:.0f} ms |", flush=True)


def main():
    """Print the table that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("paper", "x500", "crazyflie21", "channels", "mujoco", "margin"))
    parser.add_argument("--preset", action="append", required=True, help="controller file; may be repeated")
    parser.add_argument("--vehicle", default="paper", help="of channels, margin and mujoco (default: paper)")
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="held-out seeds from 1001 (default: 20)")
    options = parser.parse_args()
    if options.what == "margin":
        margins(options.vehicle, options.preset)
    elif options.what == "mujoco":
        beside_mujoco(options.vehicle, options.preset, options.seeds)
    elif options.what == "channels":
        table(options.vehicle, options.preset, options.seeds, per_channel())
    else:
        table(options.what, options.preset, options.seeds, conditions(options.what))
    return 0


if __name__ == "__main__":
    sys.exit(main())
