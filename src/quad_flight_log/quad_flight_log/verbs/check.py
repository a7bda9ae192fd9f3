"""Compare every flight with limits; 1 if one is not met, a bag is truncated or a rule of the judge is broken."""

import argparse

from quad_flight_log.analysis.frames import measured
from quad_flight_log.analysis.judge import faults
from quad_flight_log.analysis.metrics import METRICS
from quad_flight_log.analysis.tables import truth_note
from quad_flight_log.report.text import judged, read_limits
from quad_flight_log.verbs.common import add_bags, flight_name, opened

EXAMPLES = """examples:
  log check flights/a --limits position_rmse=0.02
  log check flights/a flights/b --limits limits.yaml --limits settling_time=5"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG and --limits."""
    add_bags(parser)
    text = "YAML file of metric: largest value, or one METRIC=VALUE; may be repeated, later ones win"
    parser.add_argument("--limits", action="append", required=True, metavar="FILE|METRIC=VALUE", help=text)


def run(options: argparse.Namespace) -> int:
    """Print one line per limit and flight."""
    limits = read_limits(options.limits)
    good = True
    for flight in opened(options):
        name = flight_name(flight)
        verdicts, found_faults = judged(measured(flight), limits), faults(flight)
        for verdict in verdicts:
            mark = "ok  " if verdict.met else "FAIL"
            found = "n/a" if verdict.value is None else f"{verdict.value:.5g}"
            print(
                f"{mark} {name}: {verdict.metric} = {found}, limit {verdict.limit:.5g} {METRICS[verdict.metric].unit}"
            )
        if truth_note(flight):
            print(f"note {name}: {truth_note(flight)}")
        if flight.truncated:
            print(f"FAIL {name}: {flight.damage}")
        for fault in found_faults:
            print(f"FAIL {name}: {fault}")
        good &= all(verdict.met for verdict in verdicts) and not flight.truncated and not found_faults
    return 0 if good else 1
