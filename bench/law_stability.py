"""Where the paper's stability claims hold and what its parts contribute: docs/explanation/stability.md.

  rates       share of the time from t = 0 in which the Lyapunov functions of both laws rise, and why
  integral    poles of the position loop for several k, and what k does in flight
  adaptation  the adaptive gain beside fixed ones, the estimates Q_hat beside none
  surface     convergence of one axis alone for several layers of sat(e), and the attitude error of a flight with each

Examples:
  python bench/law_stability.py rates
  python bench/law_stability.py surface --seeds 3
"""

import argparse
import sys

import numpy as np
from law_surface import convergence
from paper_flight import ATTITUDE_ADAPTATION_OFF, CASES, POSITION_ADAPTATION_OFF, PaperCase, paper_flight

from quad_analysis.metrics import flight_metrics
from quad_flight.flight import fly
from quad_flight.many import sweep

AXES = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")
XI7 = 4.25


def main():
    """Print the tables asked for; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("rates", "integral", "adaptation", "surface"))
    parser.add_argument("--seeds", type=int, default=0, help="seeds 1..N (default: 20, where flights are logged 2)")
    options = parser.parse_args()
    {"rates": rates, "integral": integral, "adaptation": adaptation, "surface": surface}[options.what](options.seeds)
    return 0


def table(*columns):
    """Print the head of a table."""
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)


def row(*cells):
    """Print a row of a table."""
    print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


def logged(paper_case, seeds):
    """Yield the topics of each seed's flight from t = 0 on."""
    for seed in range(1, (seeds or 2) + 1):
        result = fly(paper_flight(paper_case)._replace(seed=seed), compiled=True)
        start = round(result.trajectory_start * 1e9)
        yield {name: rows[rows["stamp_ns"] >= start] for name, rows in result.topics.items()}


def rates(seeds):
    """Print how often L_P (eq. 35) and l (eq. 57) rise, both without their estimation errors, and the reason."""
    table("preset", "case", "L_P rises", "e_8 d beats the rest", *(f"{name}: l rises" for name in ANGLES), "-e I > 0")
    for preset in ("printed", "minimal", "tuned"):
        for case in CASES:
            found = np.mean([rising(topics) for topics in logged(PaperCase(case, preset), seeds)], axis=0)
            row(preset, case, *(f"{100.0 * share:.0f} %" for share in found))


def rising(topics):
    """Return the shares of one flight: L_P, the disturbance term, l of the three axes, and -e I over all axes."""
    position, attitude = topics["position_controller/internals"], topics["attitude_controller/internals"]
    pulled = topics["disturbance"]["lumped_acceleration_w"][
        np.searchsorted(topics["disturbance"]["step"], position["step"])
    ]
    left = (position["velocity_error"] * (pulled - position["disturbance_estimate"])).sum(axis=1)
    crossed = -attitude["angle_error"] * attitude["surface_integral"]
    return [
        (np.diff(position["lyapunov"]) > 0.0).mean(),
        (left + position["lyapunov_rate"] > 0.0).mean(),
        *(np.diff(attitude["lyapunov"], axis=0) > 0.0).mean(axis=0),
        (crossed > 0.0).mean(),
    ]


def integral(seeds):
    """Print the poles of eqs. 19, 21, 29 and the worst RMSE over the seeds for several k."""
    table("xi_hat", "k", "poles, rad/s")
    for gain in (1.0, 7.0):
        for k in (0.0, 0.01, 0.1, 1.0):
            poles = np.linalg.eigvals([[-XI7, 1.0, -k], [-1.0, -gain, 0.0], [1.0, 0.0, 0.0]])
            row(f"{gain:g}", f"{k:g}", ", ".join(f"{pole:.3g}" for pole in sorted(poles, key=lambda pole: -pole.real)))
    print()
    table("k", *(f"{preset}, {case}" for preset in ("minimal", "tuned") for case in CASES))
    for k in (0.0, 0.01, 0.1, 1.0):
        change = {f"{axis}.integral_gain": k for axis in AXES}
        paper_cases = [PaperCase(case, preset, position=change) for preset in ("minimal", "tuned") for case in CASES]
        row(f"{k:g}", *(f"{spread(one, seeds)} m" for one in paper_cases))


def spread(paper_case, seeds):
    """Return lowest and highest RMSE in m over the seeds."""
    errors = [
        result.rmse if result.outcome == "ended" else float("inf")
        for result in sweep(paper_flight(paper_case), range(1, (seeds or 20) + 1))
    ]
    return f"{min(errors):.4f} to {max(errors):.4f}"


def fixed(gain):
    """Return the position parameters of a gain that does not adapt."""
    return POSITION_ADAPTATION_OFF | {f"{axis}.{name}": gain for axis in AXES for name in ("initial_gain", "max_gain")}


def adaptation(seeds):
    """Print the RMSE of adaptive and fixed gains, with the static error under 1 m/s^2 that each fixed gain leaves."""
    table("preset", "gain xi_hat_8", *CASES, "static error per m/s^2")
    for preset in ("minimal", "tuned"):
        for name, change, gain in (
            ("adapts", {}, None),
            ("frozen where it starts", POSITION_ADAPTATION_OFF, 1.0 if preset == "minimal" else 7.0),
            *((f"fixed at {value:g}", fixed(value), value) for value in (4.0, 7.0, 10.0, 12.0)),
        ):
            cells = [f"{spread(PaperCase(case, preset, position=change), seeds)} m" for case in CASES]
            row(preset, name, *cells, f"{1.0 / (1.0 + XI7 * gain):.4f} m" if gain else "")  # eqs. 19, 29 at rest
    print()
    table("preset", "estimates Q_hat", *(f"attitude RMSE, {case}" for case in CASES), "Q_hat_1 at the end")
    for preset in ("minimal", "tuned"):
        for name, change in (("adapt", {}), ("stay 0", ATTITUDE_ADAPTATION_OFF)):
            errors, ends = [], []
            for case in CASES:
                flown = list(logged(PaperCase(case, preset, attitude=change), seeds))
                errors.append(np.mean([flight_metrics(topics).attitude_rmse for topics in flown]))
                ends += [topics["attitude_controller/internals"]["adaptive_constant"][-1] for topics in flown]
            row(preset, name, *(f"{error:.4f} rad" for error in errors), np.round(np.mean(ends, axis=0), 2).tolist())


def surface(seeds):
    """Print how fast one axis settles for several layers, and what each layer does to flights of Case 2."""
    table("layer of sat(e)", "rho_1", *(f"{band:g} rad" for band in (0.1, 0.01, 0.001)), "overshoot", "abs(s) < 0.01")
    for linear_gain in (3.0, 20.0):
        for width in (1.0, 0.3, 0.1, 0.05, 0.02):
            row(
                f"{width:g}{' (printed)' if width == 1.0 else ''}", f"{linear_gain:g}", *convergence(width, linear_gain)
            )
    print()
    table("layer of sat(e)", "preset", "attitude RMSE", "position RMSE", "torque total variation")
    for preset in ("minimal", "tuned"):
        for width in (1.0, 0.3, 0.1, 0.05, 0.02):
            change = {f"{axis}.surface_width": width for axis in ANGLES}
            flown = [flight_metrics(topics) for topics in logged(PaperCase("case2", preset, attitude=change), seeds)]
            means = [np.mean([getattr(one, name) for one in flown]) for name in METRICS]
            row(f"{width:g}", preset, f"{means[0]:.4f} rad", f"{means[1]:.4f} m", f"{means[2]:.1f} N m")


METRICS = ("attitude_rmse", "position_rmse", "torque_total_variation")

if __name__ == "__main__":
    sys.exit(main())
