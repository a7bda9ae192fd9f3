"""Write the verified prefix of a cut or damaged bag as a new, complete bag; the old one is left as it is.

Everything up to the first damage is kept with its metadata, parameters and times.
"""

import argparse
from pathlib import Path

from quad_flight_log.bag.recover import recover
from quad_flight_log.verbs.common import add_bags, flight_name, opened

OWN_OUT = True
EXAMPLES = """examples:
  log recover flights/killed
  log recover flights/killed/killed_0.mcap.part --out flights/saved"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG."""
    add_bags(parser, several=False)


def run(options: argparse.Namespace) -> int:
    """Recover and say what came of it."""
    options.salvage = True
    (flight,) = opened(options)
    name = flight_name(flight).removesuffix(".part").removesuffix(".mcap")
    directory = options.out or Path(f"{name}-recovered")
    found = recover(flight, directory)
    last = max((topic.last for topic in flight.topics.values() if topic.messages), default=0) * 1e-9
    print(f"{found.report.path}: {found.report.messages} messages, up to {last:.3f} s")
    print(f"damage: {flight.damage or 'none, the bag was complete'}")
    for topic in found.left_out:
        print(f"left out: {flight.unreadable[topic]}")
    return 0
