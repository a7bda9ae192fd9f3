"""Write several flights into one interactive HTML page, all in the same figures, and print their metrics."""

import argparse
from pathlib import Path

from quad_flight_log.report.text import table
from quad_flight_log.verbs.common import add_bags, opened
from quad_flight_log.verbs.report import command_line

OWN_OUT = True
EXAMPLES = """examples:
  log compare flights/a flights/b --out results
  log compare flights/a flights/b --names proposed,pid --out results

Flights of different trajectories get figures of their own."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG and --names."""
    add_bags(parser)
    parser.add_argument("--names", default="", metavar="A,B,...", help="names of the flights (default: their folders)")


def run(options: argparse.Namespace) -> int:
    """Print the table of metrics; write comparison.html into --out or here."""
    from quad_flight_log.analysis.tables import truth_note
    from quad_flight_log.errors import FlightLogError
    from quad_flight_log.report.html_page import write_page
    from quad_flight_log.report.pages import comparison_page, names_of
    from quad_flight_log.report.run import run_from_flight

    flights = opened(options)
    names = [name.strip() for name in options.names.split(",")] if options.names else names_of(flights)
    if len(names) != len(flights) or len(set(names)) != len(names) or not all(names):
        raise FlightLogError(f"--names: found {options.names!r}, expected {len(flights)} different names")
    values = [run_from_flight(flight, name).metrics for flight, name in zip(flights, names, strict=True)]
    print(table(names, values, notes=[truth_note(flight) for flight in flights]))
    path = (options.out or Path()) / "comparison.html"
    print(write_page(comparison_page(flights, names, command_line()), path))
    return 0
