"""Write layouts for Foxglove and PlotJuggler that show every quantity of a flight; needs the messages installed."""

import argparse
from pathlib import Path

OWN_OUT = True
EXAMPLES = """examples:
  log layouts --out layouts                       writes layouts/flight.json (Foxglove) and layouts/flight.xml
  log layouts --namespace second --out layouts    for the vehicle in the namespace /second"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --namespace."""
    parser.add_argument("--namespace", default="", help="namespace of the vehicle")


def run(options: argparse.Namespace) -> int:
    """Write both files and print where they are."""
    directory: Path = options.out or Path()
    directory.mkdir(parents=True, exist_ok=True)
    for name, text in layout_files(options.namespace).items():
        path = directory / name
        path.write_text(text, encoding="utf-8")
        print(path)
    return 0


def layout_files(namespace: str = "") -> dict[str, str]:
    """Return {file name: text} of the layouts of this installation's topics."""
    from quad_flight_log.errors import FlightLogError
    from quad_flight_log.report.layouts import foxglove, plotjuggler, tabs

    try:
        from quad_node.topics import TOPICS
    except ImportError as error:
        raise FlightLogError(f"layouts need ROS 2 and the messages of this workspace ({error})") from error
    found = tabs({topic.name: topic.type for topic in TOPICS.values() if topic.step}, namespace)
    return {"flight.json": foxglove(found, namespace), "flight.xml": plotjuggler(found)}
