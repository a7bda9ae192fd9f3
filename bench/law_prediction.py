"""What the prediction of late states is worth, and which of its simpler forms does: Case 2, preset tuned, seed 1.

  ages      RMSE in m and torque variation in N m over the delay of all states, with and without the prediction
  methods   the same for simpler predictions: position by velocity alone, with the acceleration that thrust explains,
            with the attitude turned by the gyro, with the angular acceleration of the newest torque, as shipped
  noise     10 ms with the noise of scenario flight, with rotors that lag by 30 ms, with both

Examples:
  python bench/law_prediction.py ages
  python bench/law_prediction.py noise --set position_controller.prediction.smoothing=10.0
"""

import argparse
import sys
from typing import Any

from quad_core.cascade import STAGE
from quad_core.geometry import ZERO, add, rotated_by_vector, scale
from quad_core.plugins import law_of
from quad_core.prediction import Shown, ahead, angular_acceleration, held_for, modelled_acceleration, with_prediction
from quad_core.types import VehicleState
from quad_flight.flight import fly, from_names
from quad_flight.stages import PerStage

CONTROLLERS = ("position_controller", "attitude_controller")
CHANNELS = ("position", "attitude", "rate")
DELAYS = (0.0, 0.005, 0.01, 0.02, 0.03, 0.045, 0.06)
NOISE = tuple(
    f"simulator.sensor.{channel}_noise={size}"
    for channel, size in (("position", 0.01), ("velocity", 0.02), ("attitude", 3.4907e-3), ("rate", 8.7266e-3))
)
LAG = ("vehicle.rotor_time_constant=0.03",)
VELOCITY, ACCELERATION, GYRO, TORQUE = 1.0, 2.0, 3.0, 4.0
WITHOUT = tuple(f"{role}.prediction.enabled=false" for role in CONTROLLERS)
"""A late state turns the prediction on, unless told otherwise."""
NAMES = {VELOCITY: "p + v A", ACCELERATION: "and v + a A", GYRO: "and gyro", TORQUE: "and newest torque"}


def simple(parameters, vehicle, known, state, actuation, dt):
    """Predict with less; ``smoothing`` says which form, as it has no other use here."""
    held, age, form = held_for(known, state, dt), parameters.position_age, parameters.smoothing
    omega, q, acceleration = state.omega_b, state.q_wb, ZERO
    if form >= TORQUE and known.initialised:
        omega = add(omega, scale(age, angular_acceleration(vehicle, omega, actuation.torque_b)))
    if form >= GYRO:
        q = rotated_by_vector(q, scale(0.5 * age, add(state.omega_b, omega)))
    if form >= ACCELERATION and known.initialised:
        acceleration = modelled_acceleration(
            vehicle, rotated_by_vector(q, scale(-0.5 * age, omega)) if form >= GYRO else q, actuation.thrust
        )
    p, v = ahead(state.p_w, state.v_w, acceleration, age), add(state.v_w, scale(age, acceleration))
    now = VehicleState(p, v, q, omega)
    known = known._replace(reading=state, held=held, predicted=now, initialised=True)
    return now, known, Shown(ZERO, ZERO, ZERO, 0.0)


def predicting(age):
    """Return the settings that predict over ``age`` s in both controllers."""
    found = []
    for role in CONTROLLERS:
        found += [f"{role}.prediction.enabled=true", f"{role}.prediction.max_age=0.1"]
        found += [f"{role}.prediction.{channel}_age={age}" for channel in CHANNELS]
    return found


def flown(delay, settings, form=0.0):
    """Return one cell: RMSE in mm and torque variation in N m of the flight."""
    if form:
        settings = [*settings, *(f"{role}.prediction.smoothing={form}" for role in CONTROLLERS)]
    flight = from_names("case2", settings=[f"simulator.sensor.delay={delay}", *settings])
    if form:
        laws = [law_of(resolved.plugins["law"].module) for resolved in (flight.resolved[role] for role in CONTROLLERS)]
        kinds: list[Any] = [STAGE[role].inputs_type for role in CONTROLLERS]
        stages = PerStage(*(with_prediction(law, kind, simple) for law, kind in zip(laws, kinds, strict=True)))
        flight = flight._replace(modules=flight.modules._replace(stages=stages))
    result = fly(flight, compiled=not form, logging=False)
    if result.outcome != "ended":
        return f"{result.outcome}"
    return f"{1e3 * result.rmse:.2f} mm, {result.score.torque_variation:.1f}"


def main():
    """Print the table that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("ages", "methods", "noise"))
    parser.add_argument("--set", action="append", default=[], metavar="NODE.PARAM=VALUE", help="as scripts/fly")
    options = parser.parse_args()
    if options.what == "ages":
        print("| delay | without prediction | predicted |\n|---|---|---|")
        for delay in DELAYS:
            print(f"| {1e3 * delay:g} ms | {flown(delay, [*WITHOUT, *options.set])} |", end=" ", flush=True)
            print(f"{flown(delay, [*predicting(delay), *options.set])} |", flush=True)
    elif options.what == "methods":
        print(f"| delay | {' | '.join(NAMES.values())} |\n|---|" + "---|" * len(NAMES))
        for delay in (0.005, 0.01, 0.02):
            cells = [flown(delay, [*predicting(delay), *options.set], form) for form in NAMES]
            print(f"| {1e3 * delay:g} ms | {' | '.join(cells)} |", flush=True)
    else:
        for name, extra in (("none", ()), ("noise", NOISE), ("lag", LAG), ("noise and lag", (*NOISE, *LAG))):
            print(f"| {name} | {flown(0.01, [*predicting(0.01), *extra, *options.set])} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
