"""``log VERB BAG``: look into, measure, check and verify recorded flights."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from quad_flight_log.bag_metadata import METADATA_FILE
from quad_flight_log.errors import FlightLogError
from quad_flight_log.metrics import METRICS, FlightMetrics, flight_metrics
from quad_flight_log.payload_hash import payload_hash, topic_hashes
from quad_flight_log.presentation import as_csv, as_json, judged, read_limits, table
from quad_flight_log.reader import Flight, open_flight

MEASURED = ("truth", "reference", "attitude_setpoint", "wrench_setpoint", "actuation")

_EXAMPLES = """examples:
  log metrics flights/case1-1-1
  log metrics flights/a flights/b --csv > both.csv
  log check flights/a --limits position_rmse=0.02 --limits limits.yaml
  log info flights/a/a_0.mcap
  log hash flights/a flights/b

A BAG is a bag directory or an MCAP file, closed or not; topics are found in any namespace, or in --namespace.
Exit codes: 0 good, 1 the flight or the bag is not, 2 bad usage or no readable bag."""


def measured(flight: Flight) -> FlightMetrics:
    """Return the metrics of an opened flight from whatever of the needed topics it has."""
    return flight_metrics(flight.arrays(*(topic for topic in MEASURED if flight.has(topic))))


def metrics_verb(flights: list[Flight], options: argparse.Namespace) -> int:
    """Print the metrics of one or more flights."""
    names, values = [_name(flight) for flight in flights], [measured(flight) for flight in flights]
    if options.json:
        print(as_json(names, values))
    elif options.csv:
        print(as_csv(names, values), end="")
    else:
        print(table(names, values))
    return 0


def check_verb(flights: list[Flight], options: argparse.Namespace) -> int:
    """Compare every flight with the limits; 1 if one is not kept or a bag is truncated."""
    limits = read_limits(options.limits)
    good = True
    for flight in flights:
        verdicts = judged(measured(flight), limits)
        for verdict in verdicts:
            mark = "ok  " if verdict.kept else "FAIL"
            found = "n/a" if verdict.value is None else f"{verdict.value:.5g}"
            unit = METRICS[verdict.metric].unit
            print(f"{mark} {_name(flight)}: {verdict.metric} = {found}, limit {verdict.limit:.5g} {unit}")
        if flight.truncated:
            print(f"FAIL {_name(flight)}: {flight.damage}")
        good &= all(verdict.kept for verdict in verdicts) and not flight.truncated
    return 0 if good else 1


def info_verb(flights: list[Flight], _options: argparse.Namespace) -> int:
    """Print what is in a bag."""
    for flight in flights:
        state = f"truncated: {flight.damage}" if flight.truncated else "complete"
        checked = "every message under a checksum" if flight.protected else "not every message under a checksum"
        print(f"{flight.path}\n  {state}, {checked}, written by {flight.library or 'unknown'}")
        print(f"  {flight.compressed_size} bytes compressed, {flight.uncompressed_size} uncompressed")
        for key, value in sorted(flight.metadata.items()):
            print(f"  {key}: {value}")
        width = max((len(name) for name in flight.topics), default=0)
        for topic in flight.topics.values():
            span = (topic.last - topic.first) * 1e-9
            print(f"  {topic.name.ljust(width)}  {topic.messages:>8}  {topic.size:>10} B  {span:>9.3f} s  {topic.type}")
    return 0


def verify_verb(flights: list[Flight], _options: argparse.Namespace) -> int:
    """Decode everything; 1 if a bag is truncated or its metadata.yaml tells something else than its content."""
    good = True
    for flight in flights:
        problems = [flight.damage] if flight.truncated else []
        for name in flight.topics:
            flight.array(name)
        _ = flight.parameters
        problems += _metadata_problems(flight)
        print(f"{'FAIL' if problems else 'ok  '} {flight.path}" + "".join(f"\n     {problem}" for problem in problems))
        good &= not problems
    return 0 if good else 1


def hash_verb(flights: list[Flight], options: argparse.Namespace) -> int:
    """Print the payload hash of each flight; 1 if several were given and they differ."""
    hashes = set()
    for flight in flights:
        value = payload_hash(flight)
        hashes.add(value)
        print(f"{value}  {flight.path}")
        if options.topics:
            for topic, digest in topic_hashes(flight).items():
                print(f"  {digest}  {topic}")
    return 0 if len(hashes) == 1 else 1


def _metadata_problems(flight: Flight) -> list[str]:
    path = flight.path.parent / METADATA_FILE
    if not path.is_file():
        return [f"{path}: missing"]
    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        counts = {
            item["topic_metadata"]["name"]: (item["topic_metadata"]["type"], item["message_count"])
            for item in told["topics_with_message_count"]
        }
        custom = {str(key): str(value) for key, value in (told["custom_data"] or {}).items()}
        files = told["relative_file_paths"]
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError) as error:
        return [f"{path}: cannot be read ({type(error).__name__})"]
    have = {topic.name: (topic.type, topic.messages) for topic in flight.topics.values()}
    problems = [f"{path}: names the files {files}, expected {flight.path.name}"] if files != [flight.path.name] else []
    if counts != have:
        wrong = sorted(name for name in {*counts, *have} if counts.get(name) != have.get(name))
        problems.append(f"{path}: types or counts differ from the bag's: {', '.join(wrong)}")
    if flight.metadata and custom != flight.metadata:
        problems.append(f"{path}: custom_data differs from what the bag itself holds")
    return problems


def _name(flight: Flight) -> str:
    folder = flight.path.parent.name
    return folder if flight.path.name.startswith(f"{folder}_0.mcap") else flight.path.name


def _parser() -> argparse.ArgumentParser:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="log", description=__doc__, epilog=_EXAMPLES, formatter_class=formatter)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, run in {
        "info": info_verb,
        "metrics": metrics_verb,
        "check": check_verb,
        "verify": verify_verb,
        "hash": hash_verb,
    }.items():
        summary = (run.__doc__ or "").strip()
        verb = verbs.add_parser(name, help=summary, description=summary, epilog=_EXAMPLES, formatter_class=formatter)
        verb.add_argument("bags", nargs="+", metavar="BAG", type=Path)
        verb.add_argument("--namespace", default="", help="namespace of the vehicle to read")
        verb.add_argument("--salvage", action="store_true", help="read a damaged bag up to the damage")
        verb.set_defaults(run=run)
        if name == "metrics":
            form = verb.add_mutually_exclusive_group()
            form.add_argument("--json", action="store_true", help="print JSON")
            form.add_argument("--csv", action="store_true", help="print CSV")
        if name == "check":
            text = "YAML file of metric: limit, or one KEY=VALUE; may be repeated"
            verb.add_argument("--limits", action="append", required=True, metavar="FILE|KEY=VALUE", help=text)
        if name == "hash":
            verb.add_argument("--topics", action="store_true", help="print the hash of every step topic too")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    options = _parser().parse_args(arguments)
    try:
        flights = [open_flight(bag, namespace=options.namespace, salvage=options.salvage) for bag in options.bags]
        return int(options.run(flights, options))
    except FlightLogError as error:
        print(f"log {options.verb}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 0


if __name__ == "__main__":
    sys.exit(main())
