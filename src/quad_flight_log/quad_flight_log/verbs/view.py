"""Look at a bag, or at a flight while it is flown, in three dimensions: needs no ROS desktop, only rerun-sdk."""

import argparse
import subprocess
import tempfile
from pathlib import Path

from quad_flight_log.report.rerun_command import viewer_command
from quad_flight_log.verbs.common import flight_name, opened

OWN_OUT = True
EXAMPLES = """examples:
  log view flights/case1-1-1                       opens a window
  log view flights/case1-1-1 --web                 opens in the browser, served to this machine only
  log view flights/case1-1-1 --save case1.rrd      writes the recording, opens nothing
  log view --live                                  follows the flight of this ROS domain
  log view --live --namespace uav1 --web"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG or --live, --save and --web."""
    parser.add_argument("bags", nargs="*", metavar="BAG", type=Path, help="bag directory or MCAP file")
    parser.add_argument("--namespace", default="", help="namespace of the vehicle to look at")
    parser.add_argument("--salvage", action="store_true", help="read a damaged bag up to the damage")
    parser.add_argument("--live", action="store_true", help="subscribe to a flight instead of reading a bag")
    parser.add_argument("--save", type=Path, metavar="FILE.rrd", help="write a recording and open nothing")
    parser.add_argument("--web", action="store_true", help="open in the browser instead of a window")


def run(options: argparse.Namespace) -> int:
    """Write the recording and open it, or follow a flight."""
    from quad_flight_log.errors import FlightLogError

    if options.live == bool(options.bags) or len(options.bags) > 1:
        raise FlightLogError("expected one BAG or --live")
    if options.live:
        try:
            from quad_flight_log.live.view import view
        except ImportError as error:
            raise FlightLogError(f"--live needs ROS 2 and the messages of this workspace ({error})") from error
        return view(options.namespace, save=options.save, web=options.web)
    if options.save:
        print(_recorded(options, options.save))
        return 0
    with tempfile.TemporaryDirectory(prefix="log-view-") as folder:
        path = _recorded(options, Path(folder, "flight.rrd"))
        return subprocess.run(viewer_command(str(path), web=options.web), check=False).returncode


def _recorded(options: argparse.Namespace, path: Path) -> Path:
    from quad_flight_log.analysis.tables import text_table, truth_note
    from quad_flight_log.report.rerun_recording import write_recording
    from quad_flight_log.report.run import run_from_flight

    (flight,) = opened(options)
    if truth_note(flight):
        print(truth_note(flight))
    events = []
    if flight.has("flight/events"):
        table = text_table(flight, "flight/events")
        events = [(float(row["stamp_ns"]) * 1e-9, f"{row['node']}: {row['kind']}: {row['text']}") for row in table]
    return write_recording(run_from_flight(flight, flight_name(flight)), path, events)
