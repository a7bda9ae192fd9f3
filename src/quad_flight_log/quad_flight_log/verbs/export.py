"""Write topics as CSV, Parquet or MATLAB files: one file per topic, for MATLAB one struct per topic.

Names: wrench.force.z for nested messages, p_w[0] for arrays (in MATLAB nested structs and matrices).
"""

import argparse
from pathlib import Path

from quad_flight_log.bag.export import FORMATS, export
from quad_flight_log.verbs.common import add_bags, flight_name, opened

OWN_OUT = True
EXAMPLES = """examples:
  log export flights/case1-1-1 --out tables
  log export flights/case1-1-1 --format parquet --topic truth --topic reference --out tables
  log export flights/case1-1-1 --format mat --out matlab"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG, --format and --topic."""
    add_bags(parser, several=False)
    parser.add_argument("--format", choices=FORMATS, default="csv", help="default: csv")
    parser.add_argument("--topic", action="append", default=[], metavar="TOPIC", help="only this; may be repeated")


def run(options: argparse.Namespace) -> int:
    """Write the files and print their names, and what was left out."""
    (flight,) = opened(options)
    directory = options.out or Path(f"{flight_name(flight)}-{options.format}")
    found = export(flight, directory, options.format, options.topic)
    for path in found.paths:
        print(path)
    for why in found.left_out.values():
        print(f"left out: {why}")
    return 1 if found.left_out else 0
