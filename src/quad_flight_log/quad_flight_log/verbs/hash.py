"""Print the payload hash of each flight; 1 if several were given and they differ, or if a bag is cut."""

import argparse

from quad_flight_log.bag.payload_hash import payload_hash, topic_hashes
from quad_flight_log.verbs.common import add_bags, opened

EXAMPLES = """examples:
  log hash flights/a flights/b
  log hash flights/a --topics"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG and --topics."""
    add_bags(parser)
    parser.add_argument("--topics", action="store_true", help="print the hash of every step topic too")


def run(options: argparse.Namespace) -> int:
    """Print one line per flight."""
    hashes, whole = set(), True
    for flight in opened(options):
        value = payload_hash(flight)
        hashes.add(value)
        whole &= not flight.truncated
        cut = f"  (of the readable part of a cut bag: {flight.damage})" if flight.truncated else ""
        print(f"{value}  {flight.path}{cut}")
        if options.topics:
            for topic, digest in topic_hashes(flight).items():
                print(f"  {digest}  {topic}")
    return 0 if whole and len(hashes) == 1 else 1
