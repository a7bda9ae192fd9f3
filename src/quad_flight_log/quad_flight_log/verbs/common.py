"""What verbs share: which bags, how they are opened, how they are called."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from quad_flight_log.reader import Flight, find_mcap, open_flight

_SHOW_FROM = 16 << 20  # bytes; smaller bags are read before a bar can be seen


def add_bags(parser: argparse.ArgumentParser, *, several: bool = True) -> None:
    """Add the positional BAG (``options.bags``, a list) and how to read it."""
    parser.add_argument(
        "bags", nargs="+" if several else 1, metavar="BAG", type=Path, help="bag directory or MCAP file"
    )
    parser.add_argument("--namespace", default="", help="namespace of the vehicle to read")
    parser.add_argument("--salvage", action="store_true", help="read a damaged bag up to the damage")


def opened(options: argparse.Namespace) -> list[Flight]:
    """Open all bags of ``options``, with a progress bar for long ones; raises FlightLogError."""
    flights = []
    for bag in options.bags:
        path = find_mcap(bag)
        with progress(f"read {path.name}", path.stat().st_size) as advance:
            flights.append(open_flight(path, namespace=options.namespace, salvage=options.salvage, progress=advance))
    return flights


@contextmanager
def progress(label: str, total: int, unit: str = "B") -> Iterator[Callable[[int, int], None]]:
    """Give a function (done, total) that moves a bar on the terminal; silent for small totals and for files."""
    if not sys.stderr.isatty() or (unit == "B" and total < _SHOW_FROM):
        yield lambda _done, _total: None
        return
    try:
        from tqdm import tqdm
    except ImportError:
        yield lambda _done, _total: None
        return
    with tqdm(desc=label, total=total, unit=unit, unit_scale=unit == "B", leave=False, file=sys.stderr) as bar:
        yield lambda done, _total: bar.update(done - bar.n)


def flight_name(flight: Flight) -> str:
    """Return what a flight is called in tables: its bag directory, else its file."""
    folder = flight.path.parent.name
    return folder if flight.path.name.startswith(f"{folder}_0.mcap") else flight.path.name
