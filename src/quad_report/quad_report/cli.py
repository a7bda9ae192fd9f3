"""``log COMMAND BAG``: look into, measure, check, export, replay and draw recorded flights."""

import argparse
import contextlib
import gc
import inspect
import io
import json
import os
import shlex
import signal
import sys
import textwrap
import time
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TextIO, cast

from quad_analysis import text
from quad_analysis.flight_checks import RECORD, equal_stamps, failed_checks, judgement, read_limits, run_ids
from quad_analysis.replay import Replay, replay
from quad_analysis.tables import TOPICS, measured, measured_between, truth_note, truth_topic
from quad_core.cascade import ATTITUDE, POSITION, STAGE
from quad_core.command_line import Parser, open_streams
from quad_flight_log.errors import FlightLogError, one_line, printable
from quad_flight_log.export import export, export_one_table
from quad_flight_log.payload_hash import payload_hash, topic_hashes
from quad_flight_log.reader import Flight, open_flight

_LONGEST_LINE = 800
_LONGEST_CELL = 300
_EXAMPLES = """examples:
  log info flights/case1-1-1
  log metrics flights/case1-1-1 flights/case1-2-1
  log COMMAND --help

A BAG is a bag directory or one of its files, closed or not; topics are found in any namespace, or in --namespace.
Exit codes: 0 good, 1 the flight or the bag is not, 2 bad usage, no readable bag or a defect of log, 130 interrupted.
A bag that is no whole record of one flight, as every log of others, gives 1 in metrics, check, hash, replay and report.
In metrics and report 1 means that alone: a failed flight gives 0. Lines of check begin with FAIL, unknown, ok or
note."""


def _info(options: argparse.Namespace) -> int:
    """Print what is in a bag: where it comes from, its topics, bytes per topic, what was dropped.

    log info flights/case1-1-1
    """
    for flight in _opened(options):
        state = f"truncated: {flight.damage}" if flight.truncated else "complete"
        print(f"{flight.path}\n  {state}, {flight.size} bytes, written by {flight.written_by or 'unknown'}")
        for key, value in sorted(flight.metadata.items()):
            print(f"  {_cell(key)}: {_cell(value)}")
        rows = [["topic", "messages", "bytes", "share", "rate", "dropped", "type"]]
        payload = sum(topic.size for topic in flight.topics.values())
        for topic in flight.topics.values():
            span = (topic.last - topic.first) * 1e-9
            rate = f"{(topic.messages - 1) / span:.1f} Hz" if topic.messages > 1 and span > 0.0 else "-"
            share = f"{100.0 * topic.size / payload:.1f} %" if payload else "-"
            dropped = flight.metadata.get(f"dropped.{topic.name}", "0")
            cells = (topic.name, topic.messages, topic.size, share, rate, dropped, topic.type)
            rows.append([_cell(str(cell)) for cell in cells])
        print(textwrap.indent(text.aligned(rows, range(1, 6)), "  "))
    return 0


def _cell(content: str) -> str:
    """Return text of a bag as one short line, so that it cannot pass for lines of ours."""
    short = content if len(content) <= _LONGEST_CELL else f"{content[:_LONGEST_CELL]} ..."
    return short.replace("\n", "\\n").replace("\t", "\\t")


def _metrics(options: argparse.Namespace) -> int:
    """Print the metrics of one or more flights; 1 if a bag is no whole record of one flight: a note says why.

    --state and --reference compare the positions of any two topics instead: Odometry, a pose, a point or a state.

    log metrics flights/a flights/b
    log metrics flights/a flights/b --names proposed,pid --latex > table.tex
    log metrics flights/real-1 --state /vicon/pose --reference /set_point
    """
    if bool(options.state) != bool(options.reference):
        raise FlightLogError("log metrics: --state and --reference: found one of them, expected both")
    flights = _opened(options)
    of = partial(measured_between, state=options.state, reference=options.reference) if options.state else measured
    names, values = _names(options, flights), list(map(of, flights))
    faults = [failed_checks(flight, RECORD) for flight in flights]
    notes = [
        "; ".join(filter(None, [*found, truth_note(flight)])) for found, flight in zip(faults, flights, strict=True)
    ]
    if options.json:
        rows = zip(names, values, notes, strict=True)
        print(json.dumps([{"flight": name, **item._asdict(), "note": note} for name, item, note in rows], indent=2))
    elif options.csv or options.latex:
        print((text.csv_table if options.csv else text.latex_table)(names, values))
        sys.stderr.write("".join(f"{line}\n" for line in text.noted(names, notes)))
    else:
        print(text.table(names, values, notes=notes))
    return 1 if any(faults) else 0


def _check(options: argparse.Namespace) -> int:
    """Judge every flight by its bag and by limits; 1 if one is failed or, for what its bag lacks, unknown.

    log check flights/a flights/b --limits limits.yaml --limits settling_time=5
    """
    asked, good = read_limits(options.limits), True
    for flight in _opened(options):
        judged = judgement(flight, measured(flight), asked or None)
        lines = [f"FAIL {flight.name}: {problem}" for problem in judged.problems]
        lines += [f"unknown {flight.name}: {lack}" for lack in judged.unknown]
        lines = lines or [f"ok   {flight.name}: {judged.text}"]
        note = truth_note(flight)
        print("\n".join([*lines, f"note {flight.name}: {note}"] if note else lines))
        good &= judged.verdict == "good"
    return 0 if good else 1


def _hash(options: argparse.Namespace) -> int:
    """Print the payload hash of each flight; 1 if several differ, or a bag is no whole record of one flight.

    log hash flights/a flights/b
    """
    hashes, whole = set(), True
    for flight in _opened(options):
        value, faults = payload_hash(flight), failed_checks(flight, RECORD)
        hashes.add(value)
        whole &= not faults
        print(f"{value}  {flight.path}" + f"  (no whole flight: {'; '.join(faults)})" * bool(faults))
        for topic, digest in topic_hashes(flight).items() if options.topics else ():
            print(f"  {digest}  {topic}")
    if len(hashes) > 1:
        print(f"the flights differ: {len(hashes)} different hashes; --topics shows where")
    return 0 if whole and len(hashes) == 1 else 1


def _export(options: argparse.Namespace) -> int:
    """Write topics as CSV or Parquet files; 1 if a topic cannot be read: it is named, the others written.

    Without --out they are written into NAME-csv or NAME-parquet in this directory. --one-table writes the numbers of
    all topics that metrics read, or of --topic, into one file, flight.csv or .parquet: a row per state of the vehicle,
    each value that of the newest message up to then.

    log export flights/case1-1-1 --topic truth --topic reference --out tables
    log export flights/case1-1-1 --one-table --parquet
    """
    (flight,) = _opened(options)
    out = options.out or Path(f"{flight.name}-{'parquet' if options.parquet else 'csv'}")
    if options.one_table:
        topics = options.topic or [topic for topic in TOPICS if flight.has(topic)]
        print(export_one_table(flight, out, topics, truth_topic(flight), parquet=options.parquet))
        return 0
    paths, left_out = export(flight, out, options.topic, parquet=options.parquet)
    print("\n".join([*map(str, paths), *(f"left out: {why}" for why in left_out)]))
    return 1 if left_out else 0


def _replay(options: argparse.Namespace) -> int:
    """Feed recorded inputs to the controllers again; every bit of their answers must be the recorded one.

    Exit code 1: it is not, or the bag is no whole record of one flight. Of two flights in one bag none is replayed.

    log replay flights/case1-1-1
    """
    (flight,) = _opened(options)
    faults = failed_checks(flight, RECORD)
    print("".join(f"{flight.name}: {fault}\n" for fault in faults), end="")
    if failed_checks(flight, (run_ids, equal_stamps)):
        return 1
    found = [replay(flight, role) for role in STAGE]
    for item in found:
        _print_replay(item)
    return 0 if all(item.equal for item in found) and not faults else 1


def _shadow(options: argparse.Namespace) -> int:
    """Print what a pair of laws would have commanded on a flight, next to what was flown, and what that betrays.

    The laws that flew are the default, or those of the nodes; another law starts from its defaults, or from --preset.
    The memory is carried from the first step on, and begun anew every second. A bag of others needs --vehicle.

    log shadow flights/case1-1-1 --position pid --attitude se3
    log shadow flights/real-1 --position aibs --attitude abfnitsm --vehicle my_vehicle.yaml
    """
    _print_shadow(_opened(options)[0], options)
    return 0


def _print_shadow(flight: Flight, options: argparse.Namespace) -> bool:
    """Print what a pair of laws does on a flight; returns whether a mistake of sign, scale or frame shows."""
    from quad_analysis.refly import gains_of, refly, vehicle_settings
    from quad_analysis.shadow import lines, mistakes, shadow

    values, gains = vehicle_settings(flight, options.vehicle), gains_of(options.preset)
    laws = {POSITION: options.position, ATTITUDE: options.attitude}
    carried, anew = (shadow(flight, laws, values, gains, anew=each) for each in (False, True))
    print("\n".join(lines(carried, anew)))
    if values:
        try:
            print(refly(flight, values).horizon())
        except FlightLogError as error:
            print(f"no horizon of open loop: {error}")
    return bool(mistakes(anew))


def _refly(options: argparse.Namespace) -> int:
    """Fly the commands of a flight again, each second from the recorded state: how far open loop holds.

    The vehicle is the recorded one, or that of --vehicle; a bag of others needs it.

    log refly flights/case1-1-1
    log refly flights/real-1 --vehicle my_vehicle.yaml
    """
    from quad_analysis.refly import refly, vehicle_settings

    (flight,) = _opened(options)
    print(refly(flight, vehicle_settings(flight, options.vehicle)).text())
    return 0


def _print_replay(item: Replay) -> None:
    print(f"{item.role}: {item.law}, {len(item.steps)} steps, {len(item.recorded)} numbers each")
    for note in item.notes:
        print(f"  {note}")
    if item.missing:
        print(f"  {item.missing} steps were answered only in one of record and replay")
    found = [one for one in item.differences() if one.differing]
    rows = [[one.name, str(one.differing), str(one.first_step), f"{one.largest:.4g}"] for one in found]
    if rows:
        head = ["number", "steps that differ", "first", "largest"]
        print(textwrap.indent(text.aligned([head, *rows], range(1, 4)), "  "))
    else:
        print("  every bit is equal" if item.equal else "  nothing differs where both answered")


def _report(options: argparse.Namespace) -> int:
    """Write a flight as a self-contained, interactive HTML page: verdict, playback, figures, metrics, events.

    Several flights of one trajectory come into one page, comparison.html in this directory or in --out, all in the
    same figures. Every figure has a button that saves it as SVG. Exit code 1: a bag is no whole record of one flight,
    or lacks what its verdict needs.

    log report flights/case1-1-1                  writes flights/case1-1-1/report.html
    log report flights/a flights/b --names proposed,pid --out results    writes results/comparison.html
    """
    from quad_report.page import report_page, write_page

    flights, command = _opened(options), shlex.join(["log", *sys.argv[1:]])
    names = _names(options, flights)
    page = report_page(flights, names, command)
    if len(flights) == 1:
        path = options.out / f"{flights[0].name}.html" if options.out else flights[0].path.parent / "report.html"
    else:
        path = (options.out or Path()) / "comparison.html"
        print(text.table(names, [measured(flight) for flight in flights], notes=list(map(truth_note, flights))))
    print(write_page(page, path))
    if page.lacks:
        print(f"no verdict: {'; '.join(page.lacks)}")
    return 1 if page.lacks else 0


def _names(options: argparse.Namespace, flights: Sequence[Flight]) -> list[str]:
    names = options.names.split(",") if options.names else [flight.name for flight in flights]
    if len(names) != len(flights) or len(set(names)) != len(names):
        raise FlightLogError(f"--names: found {','.join(names)!r}, expected {len(flights)} different names")
    return names


def _figure(options: argparse.Namespace) -> int:
    """Draw a figure of flights of one trajectory for a paper: PDF, SVG or PNG, of an exact width, fonts embedded.

    --figure: path, x, y, z, roll, pitch, yaw, error (default), effort, spectrum, thrust, torque, and what the laws of
    these flights have; another name is refused with the list.

    log figure flights/a flights/b --names proposed,pid --figure error --out error.pdf --width 88mm
    """
    from quad_report.drawing import figures_by_name, save
    from quad_report.page import runs_of_one_trajectory

    flights = _opened(options)
    found = figures_by_name(runs_of_one_trajectory(flights, _names(options, flights)))
    if options.figure not in found:
        raise FlightLogError(f"--figure: found {options.figure!r}, expected one of {', '.join(found) or 'none'}")
    save(found[options.figure], options.out, options.width, options.height)
    print(options.out)
    return 0


def _millimetres(text: str) -> float:
    number = text.rstrip("acdefghijklmnopqrstuvwxyz")
    factor = {"mm": 1.0, "cm": 10.0, "in": 25.4}.get(text.removeprefix(number).strip())
    value = float(number) * factor if factor else 0.0
    if not 10.0 <= value <= 1000.0:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected 10mm to 1000mm, in mm, cm or in")
    return value


def _import(options: argparse.Namespace) -> int:
    """Make a bag of a log of others (ULog, tlog, Crazyflie micro-SD, rosbag2, CSV, Parquet); say what is doubtful.

    --map names the columns: px4, mavlink, crazyflie, nanobench, idsia, ros, bag, or a file of your own. ULog, Crazyflie
    logs and bags have a map by default, .tlog too. Without --out the bag is written into NAME in this directory.

    log import flight.ulg --out flights/real-1
    log import lap.csv --map my_map.yaml --out flights/real-2
    """
    (path,) = options.bags
    _print_imported(path, options.map, options.out or Path(path.name.split(".")[0]))
    return 0


def _print_imported(path: Path, map_name: str, out: Path) -> bool:
    """Make the bag ``out`` of a log of others and print what is in it; returns whether anything is doubtful."""
    from quad_log_import.doubts import doubts, unchecked
    from quad_log_import.maps import read_recording
    from quad_log_import.write import write_recording

    recording, name = read_recording(path, map_name)
    found = doubts(recording)
    write_recording(recording, found, path, name, out)
    for item, (t, _, source) in recording.signals.items():
        rate = (len(t) - 1) / (t[-1] - t[0])
        print(f"{item}: {len(t)} samples, {t[-1] - t[0]:.1f} s, {rate:.1f} Hz, from {source}")
    notes = [f"note {note}" for note in (*recording.notes, *unchecked(recording))]
    print("\n".join([*notes, *(f"doubt {doubt}" for doubt in found), str(out)]))
    return bool(found)


def _observe(options: argparse.Namespace) -> int:
    """Record what an autopilot says over MAVLink in flight, until Ctrl-C, and compare our laws; nothing is sent.

    Joins and leaves at any time. Writes OUT.tlog as it goes (log import makes a bag of it, too), at the end the bag
    OUT, its report.html and, with --vehicle, shadow.txt. Exit code 1: something is doubtful, or a mistake shows.

    log observe --vehicle my_vehicle.yaml --position aibs --attitude geometric_pid
    log observe --listen 0.0.0.0:14540 --out flights/real-1
    """
    from quad_log_import.telemetry import address, listen
    from quad_report.page import report_page, write_page

    out = options.out or Path(time.strftime("flights/observed-%Y%m%d-%H%M%S"))
    out.parent.mkdir(parents=True, exist_ok=True)
    telemetry = out.with_name(f"{out.name}.tlog")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.suppress(KeyboardInterrupt):
        listen(address(options.listen), telemetry, print)
    is_doubtful = _print_imported(telemetry, options.map, out)
    flight = open_flight(out)
    print(write_page(report_page([flight], [flight.name], f"log observe of {telemetry}"), out / "report.html"))
    if options.vehicle is not None:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            is_doubtful |= _print_shadow(flight, options)
        (out / "shadow.txt").write_text(said.getvalue(), encoding="utf-8")
        print(said.getvalue(), end="")
    return int(is_doubtful)


def _view(options: argparse.Namespace) -> int:
    """Show the flight that records into BAG, or the newest below flights/, in the browser while it flies.

    Prints an address of this machine, opens a browser where there is a screen, and ends with the flight.

    log view --live
    log view --live flights/case1-1-1
    """
    from quad_report.live import Feed, follow, serve, under_way

    if not options.live:
        raise FlightLogError("found no --live, with which it shows the flight under way; a bag: log play BAG")
    path = under_way(options.bags)
    feed = Feed(path.parent.name)
    serve(feed, partial(follow, path, feed))
    return 0


def _play(options: argparse.Namespace) -> int:
    """Play a bag in the browser at its own pace: prints an address of this machine and begins when a browser opens it.

    log play flights/case1-1-1 --speed 4
    """
    from quad_report.flight_figures import run_from_flight
    from quad_report.live import Feed, play, serve

    (flight,) = _opened(options)
    run, feed = run_from_flight(flight, flight.name), Feed(flight.name)
    if not run.has("truth"):
        raise flight.without_topics("there is nothing to play")
    serve(feed, partial(play, run, feed, options.speed))
    return 0


def _speed(text: str) -> float:
    value = float(text)
    if not 0.01 <= value <= 1000.0:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected 0.01 to 1000")
    return value


_REPEATED: dict[str, Any] = {"action": "append", "default": []}
FLAGS: dict[str, dict[str, Any]] = {
    "--json": {"action": "store_true", "help": "print JSON"},
    "--csv": {"action": "store_true", "help": "print CSV, a line per flight"},
    "--latex": {"action": "store_true", "help": "print a LaTeX tabular, the least bold"},
    "--parquet": {"action": "store_true", "help": "write Parquet files"},
    "--one-table": {"action": "store_true", "help": "write one file on one time base"},
    "--figure": {"default": "error", "metavar": "NAME", "help": "which figure (default: error)"},
    "--width": {"type": _millimetres, "default": 88.0, "metavar": "SIZE", "help": "as 88mm (default), 8.8cm, 3.46in"},
    "--height": {"type": _millimetres, "metavar": "SIZE", "help": "by default by the width and the panels"},
    "--out FILE": {"type": Path, "required": True, "metavar": "FILE", "help": "FILE.pdf, .svg or .png"},
    "--topics": {"action": "store_true", "help": "print the hash of every step topic too"},
    "--limits": {
        **_REPEATED,
        "metavar": "FILE|METRIC=VALUE",
        "help": "YAML file of metric: largest value, or one METRIC=VALUE; may be repeated, later ones win "
        "(default: the limits that the flight was held to when flown)",
    },
    "--topic": {**_REPEATED, "metavar": "TOPIC", "help": "only this; may be repeated"},
    "--state": {"default": "", "metavar": "TOPIC", "help": "topic with the flown positions"},
    "--reference": {"default": "", "metavar": "TOPIC", "help": "topic with the positions that were asked for"},
    "--names": {"default": "", "metavar": "A,B,...", "help": "names of the flights (default: their folders)"},
    "--out": {"type": Path, "metavar": "DIR", "help": "directory of what is written"},
    "--map": {"default": "", "metavar": "NAME|FILE", "help": "map of columns, shipped or a YAML file"},
    "--listen": {"default": "127.0.0.1:14540", "metavar": "HOST:PORT", "help": "UDP port that the autopilot sends to"},
    "--live": {"action": "store_true", "help": "the flight under way; log play shows a bag"},
    "--speed": {"type": _speed, "default": 1.0, "metavar": "X", "help": "times the flight's own pace (default: 1)"},
    "--position": {"metavar": "LAW", "help": "position law (default: the one that flew)"},
    "--attitude": {"metavar": "LAW", "help": "attitude law (default: the one that flew)"},
    "--preset": {"type": Path, "metavar": "FILE", "help": "gains of the laws (default: those that flew, or tuned)"},
    "--vehicle": {"type": Path, "metavar": "FILE", "help": "vehicle file, as scripts/identify writes it"},
    "--namespace": {"default": "", "help": "namespace of the vehicle"},
}
COMMANDS: dict[str, tuple[Callable[[argparse.Namespace], int], int | str, tuple[str, ...]]] = {
    "info": (_info, "+", ()),
    "metrics": (_metrics, "+", ("--json", "--csv", "--latex", "--names", "--state", "--reference")),
    "check": (_check, "+", ("--limits",)),
    "hash": (_hash, "+", ("--topics",)),
    "export": (_export, 1, ("--topic", "--parquet", "--one-table", "--out")),
    "replay": (_replay, 1, ()),
    "shadow": (_shadow, 1, ("--position", "--attitude", "--preset", "--vehicle")),
    "refly": (_refly, 1, ("--vehicle",)),
    "report": (_report, "+", ("--names", "--out")),
    "figure": (_figure, "+", ("--figure", "--names", "--out FILE", "--width", "--height")),
    "view": (_view, "?", ("--live",)),
    "play": (_play, 1, ("--speed",)),
    "import": (_import, 1, ("--map", "--out")),
    "observe": (_observe, 0, ("--listen", "--map", "--position", "--attitude", "--preset", "--vehicle", "--out")),
}
"""{command: (function, how many bags, flags)}. A function's docstring is its help, the last paragraph examples.

It returns the exit code, and raises FlightLogError for what makes exit code 2.
"""


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="log", description=__doc__, epilog=_EXAMPLES)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (run, bags, flags) in COMMANDS.items():
        about, _, examples = inspect.cleandoc(run.__doc__ or "").rpartition("\n\n")
        own = commands.add_parser(
            name, help=about.splitlines()[0], description=about, epilog="examples:\n" + textwrap.indent(examples, "  ")
        )
        if bags:
            own.add_argument("bags", nargs=bags, metavar="BAG", type=Path, help="bag directory or one of its files")
        for flag in (*flags, "--namespace"):
            own.add_argument(flag.split()[0], **FLAGS[flag])
    return parser


def _opened(options: argparse.Namespace) -> list[Flight]:
    """Open all bags of ``options``; raises FlightLogError."""
    return [open_flight(bag, namespace=options.namespace) for bag in options.bags]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    open_streams()
    options = _parser().parse_args(arguments)
    try:
        with contextlib.redirect_stdout(cast("TextIO", _Printable(sys.stdout))):
            return COMMANDS[options.command][0](options)
    except KeyboardInterrupt:
        return _complain(options.command, "interrupted", 130)
    except FlightLogError as error:
        return _complain(options.command, str(error))
    except OSError as error:
        return _complain(options.command, f"{error.filename or ''}: {error.strerror or error}")
    except (MemoryError, RecursionError) as error:
        return _complain(options.command, f"the bag asks for more than this machine gives ({type(error).__name__})")
    except Exception as error:  # Python's own exit code, 1, would say that the flight failed
        print(printable(traceback.format_exc()), file=sys.stderr)
        problem = f"a defect of this program, not of the flight: {type(error).__name__}: {one_line(error)}"
        return _complain(options.command, problem)


def _complain(command: str, problem: str, code: int = 2) -> int:
    line = printable(" ".join(problem.split()))
    print(f"log {command}: {line if len(line) <= _LONGEST_LINE else line[:_LONGEST_LINE] + ' ...'}", file=sys.stderr)
    return code


class _Printable:
    """Standard output for what bags hold: no text reaches a terminal as a command, or in letters that it lacks."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._encoding = stream, stream.encoding or "utf-8"

    def write(self, text: str) -> int:
        try:
            self._stream.write(printable(text).encode(self._encoding, "backslashreplace").decode(self._encoding))
            self._stream.flush()
        except BrokenPipeError:  # the reader has left, and the exit code still is that of the flight
            os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
        return len(text)

    def flush(self) -> None:
        self._stream.flush()


def console() -> None:
    """Run the command line and leave."""
    gc.set_threshold(200_000, 50, 100)  # a bag is millions of tuples, none in a cycle: a fifth of a command's time
    sys.exit(main())


if __name__ == "__main__":
    console()
