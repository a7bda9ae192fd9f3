"""Print the metrics of one or more flights; of a cut bag they are those of its readable part, which is said."""

import argparse

from quad_flight_log.analysis.frames import measured
from quad_flight_log.analysis.tables import truth_note
from quad_flight_log.report.text import as_csv, as_json, table
from quad_flight_log.verbs.common import add_bags, flight_name, opened

EXAMPLES = """examples:
  log metrics flights/case1-1-1
  log metrics flights/a flights/b --csv > both.csv
  log metrics flights/a --json --out results"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG, --json and --csv."""
    add_bags(parser)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print JSON")
    form.add_argument("--csv", action="store_true", help="print CSV")


def run(options: argparse.Namespace) -> int:
    """Print one column (CSV: one line) per flight."""
    flights = opened(options)
    names, values = [flight_name(flight) for flight in flights], [measured(flight) for flight in flights]
    form = as_json if options.json else as_csv if options.csv else table
    damage = [flight.damage if flight.truncated else "" for flight in flights]
    notes = [truth_note(flight) for flight in flights]
    print(form(names, values, damage=damage, notes=notes).rstrip("\n"))
    return 0
