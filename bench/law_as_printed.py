"""The laws as printed, flown from the reference and from the paper's initial condition: docs/results/as_printed.md.

  flights   how both cases go: start, plant, thrust of the vehicle
  seconds   what happens in the first seconds from the origin, Case 1, seed 1

Examples:
  python bench/law_as_printed.py flights --seeds 20
  python bench/law_as_printed.py seconds --thrust 20
"""

import argparse
import sys

import numpy as np
from paper_flight import CASES, PaperCase, paper_flight

from quad_core.geometry import body_z
from quad_core.types import Quat
from quad_flight.flight import fly
from quad_flight.many import sweep

MOMENTS = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 4.0, 7.0)


def main():
    """Print the table asked for; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("flights", "seconds"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--thrust", type=float, default=3.0, help="largest thrust of the vehicle in m g")
    options = parser.parse_args()
    if options.what == "flights":
        flights(range(1, options.seeds + 1))
    else:
        seconds(options.thrust)
    return 0


def flights(seeds):
    """Print how the seeds of each combination ended."""
    print("| start | case | plant | thrust | to the end | RMSE | largest error | diverged after |\n|" + "---|" * 8)
    for start in ("approach", "printed"):
        for case in CASES:
            for plant, drag in (("rigid_body", "corrected"), ("paper", "corrected"), ("paper", "printed")):
                for thrust in (2.0, 3.0, 20.0):
                    paper_case = PaperCase(
                        case,
                        "printed",
                        start,
                        vehicle={"thrust_to_weight": thrust},
                        plant=plant,
                        plant_changes={"drag_sign": drag},
                    )
                    name = plant if drag == "corrected" else f"{plant}, drag printed"
                    print(f"| {start} | {case} | {name} | {thrust:g} m g | {ending(paper_case, seeds)} |", flush=True)


def ending(paper_case, seeds):
    """Return the cells about how ``paper_case`` went: seeds that ended, their errors, and when the others diverged."""
    results = sweep(paper_flight(paper_case), seeds)
    whole = [result for result in results if result.outcome == "ended"]
    lost = [result.steps * 0.002 for result in results if result.outcome != "ended"]
    rmse = f"{min(r.rmse for r in whole):.3f} to {max(r.rmse for r in whole):.3f} m" if whole else ""
    largest = f"{max(r.score.largest_error for r in whole):.3g} m" if whole else ""
    times = f"{min(lost):.1f} to {max(lost):.1f} s" if lost else ""
    return f"{len(whole)} of {len(results)} | {rmse} | {largest} | {times}"


def seconds(thrust):
    """Print state and demand at a few moments of the flight from the origin."""
    paper_case = PaperCase(
        "case1", "printed", "printed", vehicle={"thrust_to_weight": thrust}, duration=MOMENTS[-1] + 0.1
    )
    topics = fly(paper_flight(paper_case), compiled=True).topics
    print(
        "| t | error | e_12 | xi_hat_12 | thrust asked for | desired roll, pitch | tilt | body rate |\n|" + "---|" * 8
    )
    for moment in MOMENTS:
        if moment * 1e9 > topics["truth"]["stamp_ns"][-1]:
            print(f"the flight ended after {topics['truth']['stamp_ns'][-1] * 1e-9:.2f} s: out of bounds")
            return
        truth, reference, setpoint, seen = (
            at(topics[name], moment)
            for name in ("truth", "reference", "attitude_setpoint", "position_controller/internals")
        )
        error = np.linalg.norm(truth["p_w"] - reference["p_w"])
        tilt = np.degrees(np.arccos(np.clip(body_z(Quat(*truth["q_wb"])).z, -1.0, 1.0)))
        roll, pitch = np.degrees(setpoint["angles"][:2])
        rate = np.linalg.norm(truth["omega_b"])
        print(
            f"| {moment:g} s | {error:.1f} m | {seen['velocity_error'][2]:.1f} m/s | {seen['adaptive_gain'][2]:.3g} /s "
            f"| {setpoint['thrust']:.3g} N | {roll:.0f}, {pitch:.0f} deg | {tilt:.0f} deg | {rate:.1f} rad/s |"
        )


def at(rows, moment):
    """Return the newest row at ``moment`` s."""
    return rows[np.searchsorted(rows["stamp_ns"], round(moment * 1e9), side="right") - 1]


if __name__ == "__main__":
    sys.exit(main())
