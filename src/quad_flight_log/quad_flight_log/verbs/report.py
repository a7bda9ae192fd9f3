"""Write one flight as a self-contained, interactive HTML page: figures, metrics, parameters, events."""

import argparse
import shlex
import sys

from quad_flight_log.verbs.common import add_bags, flight_name, opened

OWN_OUT = True
EXAMPLES = """examples:
  log report flights/case1-1-1                  writes flights/case1-1-1/report.html
  log report flights/case1-1-1 --out results    writes results/case1-1-1.html

The page holds everything: it opens from disk without a network."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG and --limits."""
    add_bags(parser)
    text = "limits to judge by, as for `log check` (default: those that the flight was held to when it was flown)"
    parser.add_argument("--limits", action="append", metavar="FILE|METRIC=VALUE", help=text)


def run(options: argparse.Namespace) -> int:
    """Write a page per bag and print where it is."""
    from quad_flight_log.report.html_page import write_page
    from quad_flight_log.report.pages import flight_page
    from quad_flight_log.report.text import read_limits

    limits = read_limits(options.limits) if options.limits else None
    for flight in opened(options):
        name = flight_name(flight)
        path = options.out / f"{name}.html" if options.out else flight.path.parent / "report.html"
        print(write_page(flight_page(flight, name, command_line(), limits), path))
    return 0


def command_line() -> str:
    """Return what was typed, for the page to say how it was made."""
    return shlex.join(["log", *sys.argv[1:]])
