"""Draw the paper's figures and the insides of flights as PNG, PDF or SVG files."""

import argparse
import sys
from pathlib import Path

from quad_flight_log.verbs.common import add_bags, opened

OWN_OUT = True
FORMATS = ("png", "pdf", "svg")
EXAMPLES = """examples:
  log plot flights/case1-1-1                        writes flights/case1-1-1/figures/*.png and *.pdf
  log plot flights/case1-1-1 --only figure-05 --format svg
  log plot flights/a flights/b --out results        both flights in the same figures"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG, --format and --only."""
    add_bags(parser)
    parser.add_argument("--format", action="append", choices=FORMATS, help="may be repeated (default: png and pdf)")
    parser.add_argument("--only", default="", metavar="TEXT", help="only the figures whose file name begins with this")


def run(options: argparse.Namespace) -> int:
    """Write the figures and print where each is."""
    from quad_flight_log.errors import FlightLogError
    from quad_flight_log.report.pages import flight_figures, names_of
    from quad_flight_log.report.printed_figures import write_figures
    from quad_flight_log.report.run import run_from_flight

    flights = opened(options)
    if len(flights) > 1 and options.out is None:
        raise FlightLogError("figures of several flights need --out DIR")
    runs = [run_from_flight(flight, name) for flight, name in zip(flights, names_of(flights), strict=True)]
    figures = flight_figures(runs)
    chosen = [figure for figure in figures if figure.key.startswith(options.only)]
    if not chosen:
        have = ", ".join(figure.key for figure in figures) or "no figure: the bag has none of the topics needed"
        raise FlightLogError(f"--only {options.only}: there is {have}")
    directory: Path = options.out or flights[0].path.parent / "figures"
    write_figures(chosen, directory, options.format or ("png", "pdf"), done=lambda path: print(path, flush=True))
    print(f"{len(chosen)} figures in {directory}", file=sys.stderr)
    return 0
