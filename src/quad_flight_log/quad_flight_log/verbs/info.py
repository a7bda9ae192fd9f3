"""Print what is in a bag: where it comes from, its topics, bytes per topic, what was dropped."""

import argparse

from quad_flight_log.report.text import info_json, info_text
from quad_flight_log.verbs.common import add_bags, opened

EXAMPLES = """examples:
  log info flights/case1-1-1
  log info flights/a/a_0.mcap --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG and --json."""
    add_bags(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print a block per bag."""
    flights = opened(options)
    print(info_json(flights) if options.json else "\n".join(info_text(flight) for flight in flights))
    return 0
