"""How much the values decide that the paper does not give: each scaled by 1/4 to 4, both cases, compiled loop.

What Table 2 lost or section 4 leaves open had to be assumed (docs/reference/paper_map.md). Each is moved alone here,
all others as in the preset; the flights are those of ``quad_flight.flight``.
"""

import argparse
import csv
import math
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from quad_analysis.metrics import flight_metrics
from quad_core.parameters import ParameterError, Value
from quad_core.resolution import resolve
from quad_flight.flight import flight_from_parameters, fly
from quad_flight.many import run_many

FACTORS = tuple(2.0 ** (step / 2.0) for step in range(-4, 5))
CASES = ("case1", "case2")
PRESETS = ("minimal", "tuned")
_ATTITUDE = ("roll", "pitch", "yaw")

_EXAMPLES = """examples:
  python studies/sensitivity.py --out docs/images            the study of docs/results/sensitivity.md
  python studies/sensitivity.py --out /tmp/s --preset minimal --case case2 --seeds 1

writes sensitivity.csv (one row per flight) and sensitivity-PRESET.png. Exit codes: 0 flown, 2 bad usage."""


class Assumed(NamedTuple):
    """One assumed value: the parameters ``names`` of ``role`` that hold it; where it is 0, a factor means ``unit``."""

    symbol: str
    equation: str
    role: str
    names: tuple[str, ...]
    unit: float = 1.0


ASSUMED = (
    Assumed("xi_hat(0)", "Eq. 37", "position_controller", tuple(f"aibs.{a}.initial_gain" for a in "xyz")),
    Assumed("rho_1", "Eq. 53", "attitude_controller", tuple(f"abfnitsm.{a}.linear_gain" for a in _ATTITUDE)),
    Assumed("rho_2", "Eq. 53", "attitude_controller", tuple(f"abfnitsm.{a}.power_gain" for a in _ATTITUDE)),
    Assumed(
        "Delta_1..3",
        "Eq. 54",
        "attitude_controller",
        tuple(f"abfnitsm.{a}.adaptation_{part}" for a in _ATTITUDE for part in ("constant", "angle", "rate")),
    ),
    Assumed(
        "Q_hat(0)",
        "Eq. 54",
        "attitude_controller",
        tuple(f"abfnitsm.{a}.initial_{part}" for a in _ATTITUDE for part in ("constant", "angle", "rate")),
    ),
    Assumed("sd of d_x, d_y, d_z", "sect. 4", "simulator", ("held_gaussian.acceleration_sd",)),
    Assumed("sd of d_phi, d_theta, d_psi", "sect. 4", "simulator", ("held_gaussian.angular_sd",)),
)


class Job(NamedTuple):
    """One flight of the study; ``factor`` 0 is the preset as it is."""

    preset: str
    case: str
    symbol: str
    factor: float
    seed: int


class Outcome(NamedTuple):
    """How it went: RMSE of position in m and of attitude in rad after the approach; NaN where it was lost."""

    job: Job
    outcome: str
    position_rmse: float
    attitude_rmse: float


def overrides(job: Job) -> dict[str, dict[str, Value]]:
    """Return the parameters of the nodes for ``job``; raises ParameterError if the scaled value is out of range."""
    base: dict[str, dict[str, Value]] = {
        "/**": {"flight.seed": job.seed},
        "trajectory": {"trajectory": job.case},
        "position_controller": {"preset": job.preset},
        "attitude_controller": {"preset": job.preset},
        # the guard would land what is to be measured
        "simulator": {"guard.enabled": False},
    }
    for assumed in ASSUMED:
        if assumed.symbol == job.symbol and job.factor > 0.0:
            known = resolve(assumed.role, base[assumed.role])
            values = {field.name: field.default for field in known.all_fields()}
            for name in assumed.names:
                value = float(values[name])
                base[assumed.role][name] = job.factor * (value if value > 0.0 else assumed.unit)
    return base


def fly_job(job: Job, compiled: bool = True) -> Outcome:
    """Fly ``job``; raises ParameterError as ``overrides``."""
    result = fly(flight_from_parameters(overrides(job)), compiled=compiled)
    metrics = flight_metrics(result.topics)
    lost = float("nan")
    if result.outcome != "ended" or metrics.position_rmse is None or metrics.attitude_rmse is None:
        return Outcome(job, result.outcome, lost, lost)
    return Outcome(job, result.outcome, metrics.position_rmse, metrics.attitude_rmse)


def jobs(presets: Iterable[str], cases: Iterable[str], seeds: int) -> list[Job]:
    """Return the flights of the study: the presets as they are, then each value at each factor but 1."""
    found = []
    for preset in presets:
        for case in cases:
            for seed in range(1, seeds + 1):
                found.append(Job(preset, case, "", 0.0, seed))
                found += [
                    Job(preset, case, assumed.symbol, factor, seed)
                    for assumed in ASSUMED
                    for factor in FACTORS
                    if factor != 1.0 or not _stands(assumed, preset)
                ]
    return found


def _stands(assumed: Assumed, preset: str) -> bool:
    """Tell whether factor 1 is the preset itself: it is not where the preset holds 0."""
    chosen = {"preset": preset} if assumed.role.endswith("controller") else {}
    values = {field.name: field.default for field in resolve(assumed.role, chosen).all_fields()}
    return any(values[name] for name in assumed.names)


def curve(outcomes: Sequence[Outcome], preset: str, case: str, assumed: Assumed, what: str) -> dict[float, float]:
    """Return {factor: median over the seeds} of ``what`` (a field of Outcome) for one value; lost flights give NaN."""
    chosen: dict[float, list[float]] = {}
    for outcome in outcomes:
        job = outcome.job
        if (job.preset, job.case) == (preset, case):
            at_preset = job.symbol == "" and _stands(assumed, preset)
            if job.symbol == assumed.symbol or at_preset:
                chosen.setdefault(job.factor or 1.0, []).append(getattr(outcome, what))
    return {factor: middle(values) for factor, values in sorted(chosen.items())}


def middle(values: Sequence[float]) -> float:
    """Return the median, NaN if any value is one: a lost flight must not be sorted away."""
    return float("nan") if any(math.isnan(value) for value in values) else median(values)


def write_table(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write one row per flight."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*Job._fields, *Outcome._fields[1:]])
        writer.writerows([*outcome.job, *outcome[1:]] for outcome in outcomes)


def draw(outcomes: Sequence[Outcome], preset: str, cases: Sequence[str], path: Path) -> None:
    """Draw position and attitude RMSE over the factor, one line per assumed value, one column per case."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = (("position_rmse", "position RMSE [m]"), ("attitude_rmse", "attitude RMSE [rad]"))
    figure, axes = pyplot.subplots(
        2, len(cases), figsize=(5.2 * len(cases), 7.0), sharex=True, sharey="row", squeeze=False, layout="constrained"
    )
    for row, (what, label) in enumerate(rows):
        for column, case in enumerate(cases):
            panel = axes[row][column]
            for number, assumed in enumerate(ASSUMED):
                points = curve(outcomes, preset, case, assumed, what)
                marker = "osv^Dx*"[number % 7]
                panel.plot(list(points), list(points.values()), marker=marker, ms=4, lw=1.2, label=assumed.symbol)
            panel.set_xscale("log", base=2)
            panel.set_xticks([0.25, 0.5, 1.0, 2.0, 4.0], ["1/4", "1/2", "1", "2", "4"])
            panel.grid(True, alpha=0.25)
            panel.set_title(f"{case}, preset {preset}" if row == 0 else "")
            panel.set_xlabel("factor on the assumed value" if row else "")
        axes[row][0].set_ylabel(label)
        axes[row][0].set_ylim(bottom=0.0)
    axes[0][0].legend(fontsize=7, ncols=2, loc="lower left")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def summary(outcomes: Sequence[Outcome], preset: str, case: str) -> list[str]:
    """Return a Markdown table: RMSE at a quarter, once and four times each value, and the lost flights."""
    lines = [
        f"{case}, preset `{preset}`, position RMSE in m / attitude RMSE in rad, median over the seeds",
        "",
        "| assumed value | x 1/4 | x 1 | x 4 | lost |",
        "|---|---|---|---|---|",
    ]
    for assumed in ASSUMED:
        positions = curve(outcomes, preset, case, assumed, "position_rmse")
        attitudes = curve(outcomes, preset, case, assumed, "attitude_rmse")
        lost = sum(
            outcome.outcome != "ended"
            for outcome in outcomes
            if (outcome.job.preset, outcome.job.case, outcome.job.symbol) == (preset, case, assumed.symbol)
        )
        cells = [f"{positions[factor]:.4f} / {attitudes[factor]:.4f}" for factor in (0.25, 1.0, 4.0)]
        lines.append(f"| {assumed.symbol} ({assumed.equation}) | {' | '.join(cells)} | {lost} |")
    return lines


def study(chosen: Sequence[Job], threads: int) -> list[Outcome]:
    """Fly ``chosen``; returns the outcomes in their order."""
    found: dict[int, Outcome] = {}
    for place, outcome in run_many(fly_job, chosen, threads=threads):
        found[place] = outcome
        if len(found) % 20 == 0 or len(found) == len(chosen):
            sys.stderr.write(f"sensitivity: {len(found)} of {len(chosen)} flights\n")
    return [found[place] for place in range(len(chosen))]


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly the study and write its table and pictures; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python studies/sensitivity.py",
        description=__doc__,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where the table and the pictures go")
    parser.add_argument("--preset", action="append", choices=PRESETS, help="may be repeated (default: both)")
    parser.add_argument("--case", action="append", choices=CASES, help="may be repeated (default: both)")
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="seeds 1..N (default: 3)")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, metavar="N")
    options = parser.parse_args(arguments)
    if options.seeds < 1 or options.threads < 1:
        parser.error("--seeds and --threads: expected at least 1")
    presets, cases = options.preset or list(PRESETS), options.case or list(CASES)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        outcomes = study(jobs(presets, cases, options.seeds), options.threads)
        write_table(outcomes, options.out / "sensitivity.csv")
        for preset in presets:
            draw(outcomes, preset, cases, options.out / f"sensitivity-{preset}.png")
    except (ParameterError, OSError) as error:
        sys.stderr.write(f"sensitivity: {error}\n")
        return 2
    for preset in presets:
        for case in cases:
            sys.stdout.write("\n".join([*summary(outcomes, preset, case), "", ""]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
