"""What verbs share: which bags, how they are opened, how they are called."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from quad_flight_log.bag.files import files_of
from quad_flight_log.bag.reader import Flight, open_flight

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
        large = sum(file.path.stat().st_size for file in files_of(bag).files) >= _SHOW_FROM
        advance = progress(f"read {bag.name}") if large else None
        flights.append(open_flight(bag, namespace=options.namespace, salvage=options.salvage, progress=advance))
    return flights


def progress(label: str, unit: str = "B") -> Callable[[int, int], None] | None:
    """Return a function (done, total) that shows a bar until both are equal, and again from there; None to a file."""
    if not sys.stderr.isatty():
        return None
    try:
        from tqdm import tqdm
    except ImportError:
        return None
    bar: Any = None

    def advance(done: int, total: int) -> None:
        nonlocal bar
        if bar is None:
            bar = tqdm(desc=label, total=total, unit=unit, unit_scale=True, leave=False, file=sys.stderr)
        bar.update(done - bar.n)
        if done >= total:
            bar.close()
            bar = None

    return advance


def flight_name(flight: Flight) -> str:
    """Return what a flight is called in tables: its bag directory, else its file."""
    folder = flight.path.parent.name
    return folder if flight.path.name.startswith(f"{folder}_0.") else flight.path.name
