"""Should the gains of a tuning become the preset ``tuned``? Both fly the same held-out flights of three campaigns.

A gains file is worth it where its flights cost less and none fails that did not fail before. The cost is that of the
tuning, by the scales of the plan ``paper``.
"""

import argparse
import statistics
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from quad_campaign.batch import fly_numbers, prepared, shipped
from quad_campaign.definition import Definition, Distribution, read_definition, settings_of
from quad_core.parameter_files import read_parameter_file

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "studies"))
from study_plan import find_plan, gains_file, read_plan

PLAN = read_plan(find_plan("paper"))
GAINS = gains_file(PLAN, "proposed", 1)

OBJECTIVE = PLAN.tuning.objective
_SEEDS = {"flight.seed": Distribution("uniform", (1000, 2**31 - 1), None)}  # tuned on 1, 2, 3
_NOMINAL = {
    case: Definition(f"nominal {case}", "", {"case": case}, _SEEDS, {"rmse": 0.15}, 1) for case in ("case1", "case2")
}


def settings(path: Path) -> list[str]:
    """Return a gains file as NODE.PARAM=VALUE."""
    content = read_parameter_file(path)
    return settings_of(
        {f"{node.strip('/*')}.{name}": value for node, values in content.items() for name, value in values.items()}
    )


def flown(definition: Definition, more: list[str], flights: int) -> list[dict[str, Any]]:
    """Return the rows of the campaign's first flights with ``more`` settings, on two threads."""
    changed = {**definition.flight, "set": [*definition.flight.get("set", []), *more]}
    batch = prepared(definition._replace(flight=changed))
    fly_numbers(batch, [0])
    with ThreadPoolExecutor(2) as pool:
        return [row for part in pool.map(lambda i: fly_numbers(batch, range(i, flights, 2)), range(2)) for row in part]


def variation(row: dict[str, Any]) -> float:
    """Return the torque variation per second of a flight at 500 Hz, N m/s."""
    return float(row["torque_variation"]) / (0.002 * row["steps"])


def cost(row: dict[str, Any]) -> float:
    """Return what the tuning minimises."""
    return float(row["rmse"]) / OBJECTIVE.rmse_scale + variation(row) / OBJECTIVE.variation_scale


def main(flights: int = 200, gains: Path = GAINS) -> None:
    """Print both, campaign by campaign."""
    changed = settings(gains)
    campaigns = [*_NOMINAL.values(), read_definition(shipped()["campaign_case2"])]
    print("campaign        gains    successes  RMSE median  worst, m  torque variation, N m/s  cost    cheaper")
    for definition in campaigns:
        preset = flown(definition, [], flights)
        tuned = flown(definition, changed, flights)
        wins = sum(cost(ours) < cost(theirs) for ours, theirs in zip(tuned, preset, strict=True))
        for name, rows in (("preset", preset), ("tuned", tuned)):
            errors = [row["rmse"] for row in rows]
            said = f"{100.0 * wins / flights:.0f} %" if name == "tuned" else ""
            print(
                f"{definition.name:15s} {name:8s} {sum(row['success'] for row in rows):5d}/{flights:<5d}"
                f"{statistics.median(errors):11.5f} {max(errors):10.5f}"
                f"{statistics.median(variation(row) for row in rows):15.3f}"
                f"{statistics.median(cost(row) for row in rows):18.3f}    {said}"
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=int, default=200, help="flights of each campaign (default: 200)")
    parser.add_argument("gains", nargs="?", type=Path, default=GAINS, help="parameter file (default: the study's)")
    main(**vars(parser.parse_args()))
