"""Decode everything; 1 if a bag is truncated or its metadata.yaml tells something else than its content."""

import argparse

from quad_flight_log.bag.verification import problems_of
from quad_flight_log.verbs.common import add_bags, opened

EXAMPLES = """examples:
  log verify flights/case1-1-1
  log verify flights/*"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG."""
    add_bags(parser)


def run(options: argparse.Namespace) -> int:
    """Print one line per bag, and what is wrong with it."""
    good = True
    for flight in opened(options):
        problems = problems_of(flight)
        print(f"{'FAIL' if problems else 'ok  '} {flight.path}" + "".join(f"\n     {problem}" for problem in problems))
        good &= not problems
    return 0 if good else 1
