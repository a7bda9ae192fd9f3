"""``log COMMAND BAG``: look into, measure, check, verify, repair, convert, replay and draw recorded flights."""

import argparse
import contextlib
import io
import os
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, NoReturn, TextIO, cast

from quad_core.cascade import ATTITUDE, POSITION, STAGE
from quad_core.parameters import ParameterError
from quad_core.resolution import parse_settings
from quad_flight_log.analysis.flight_checks import failed_checks
from quad_flight_log.analysis.frames import measured
from quad_flight_log.analysis.metrics import METRICS
from quad_flight_log.analysis.replay import replay
from quad_flight_log.analysis.tables import truth_note
from quad_flight_log.bag.export import FORMATS, export, write_csv
from quad_flight_log.bag.files import files_of
from quad_flight_log.bag.payload_hash import payload_hash, topic_hashes
from quad_flight_log.bag.reader import Flight, open_flight
from quad_flight_log.bag.recover import recover
from quad_flight_log.bag.verification import problems_of
from quad_flight_log.errors import FlightLogError, printable
from quad_flight_log.report import text

Options = argparse.Namespace

_SHOW_FROM = 16 << 20  # bytes; smaller bags are read before a bar can be seen
_LONGEST_LINE = 800
_EXAMPLES = """examples:
  log info flights/case1-1-1
  log metrics flights/case1-1-1 flights/case1-2-1
  log COMMAND --help

A BAG is a bag directory or one of its files, closed or not; topics are found in any namespace, or in --namespace.
Exit codes: 0 good, 1 the flight or the bag is not, 2 bad usage or no readable bag."""


class Command(NamedTuple):
    """One command. ``run`` returns the exit code and raises FlightLogError for what makes exit code 2.

    ``bags``: how many it takes, as in argparse, empty for none. ``own_out``: it handles ``options.out`` itself; else
    what it prints is also written to ``DIR/COMMAND.txt`` (.json, .csv with --json, --csv).
    """

    run: Callable[[Options], int]
    about: str
    examples: str
    arguments: Mapping[str, Mapping[str, Any]] = MappingProxyType({})
    bags: str = "+"
    own_out: bool = False


def _info(options: Options) -> int:
    flights = _opened(options)
    print(text.info_json(flights) if options.json else "\n".join(map(text.info_text, flights)))
    return 0


def _metrics(options: Options) -> int:
    flights = _opened(options)
    names, values = [flight.name for flight in flights], [measured(flight) for flight in flights]
    if options.json and options.csv:
        raise FlightLogError("found --json and --csv, expected one of them")
    form = text.as_json if options.json else text.as_csv if options.csv else text.table
    damage = [flight.damage if flight.truncated else "" for flight in flights]
    print(form(names, values, damage=damage, notes=[truth_note(flight) for flight in flights]).rstrip("\n"))
    return 0


def _check(options: Options) -> int:
    limits, good = text.read_limits(options.limits), True
    for flight in _opened(options):
        verdicts, failed = text.judged(measured(flight), limits), failed_checks(flight)
        for verdict in verdicts:
            found = "n/a" if verdict.value is None else f"{verdict.value:.5g}"
            limit = f"limit {verdict.limit:.5g} {METRICS[verdict.metric].unit}"
            print(f"{'ok  ' if verdict.met else 'FAIL'} {flight.name}: {verdict.metric} = {found}, {limit}")
        if truth_note(flight):
            print(f"note {flight.name}: {truth_note(flight)}")
        if flight.truncated:
            failed.insert(0, flight.damage)
        for problem in failed:
            print(f"FAIL {flight.name}: {problem}")
        good &= all(verdict.met for verdict in verdicts) and not failed
    return 0 if good else 1


def _verify(options: Options) -> int:
    good = True
    for flight in _opened(options):
        problems = problems_of(flight)
        print(f"{'FAIL' if problems else 'ok  '} {flight.path}" + "".join(f"\n     {problem}" for problem in problems))
        good &= not problems
    return 0 if good else 1


def _hash(options: Options) -> int:
    hashes, whole = set(), True
    for flight in _opened(options):
        value = payload_hash(flight)
        hashes.add(value)
        whole &= not flight.truncated
        cut = f"  (of the readable part of a cut bag: {flight.damage})" if flight.truncated else ""
        print(f"{value}  {flight.path}{cut}")
        for topic, digest in topic_hashes(flight).items() if options.topics else ():
            print(f"  {digest}  {topic}")
    return 0 if whole and len(hashes) == 1 else 1


def _recover(options: Options) -> int:
    options.salvage = True
    (flight,) = _opened(options)
    name = flight.name.removesuffix(".part").removesuffix(".mcap")
    found = recover(flight, options.out or Path(f"{name}-recovered"))
    last = max((topic.last for topic in flight.topics.values() if topic.messages), default=0) * 1e-9
    print(f"{found.report.path}: {found.report.messages} messages, up to {last:.3f} s")
    print(f"damage: {flight.damage or 'none, the bag was complete'}")
    for topic in found.left_out:
        print(f"left out: {flight.unreadable[topic]}")
    return 0


def _export(options: Options) -> int:
    (flight,) = _opened(options)
    found = export(flight, options.out or Path(f"{flight.name}-{options.format}"), options.format, options.topic)
    for line in [*map(str, found.paths), *(f"left out: {why}" for why in found.left_out.values())]:
        print(line)
    return 1 if found.left_out else 0


def _replay(options: Options) -> int:
    (flight,) = _opened(options)
    try:
        settings = parse_settings(options.settings)
    except ParameterError as error:
        raise FlightLogError(str(error)) from error
    others = [role for role in settings if role not in (*STAGE, "/**")]
    if others:
        raise FlightLogError(f"--set {others[0]}: only {' and '.join(STAGE)} are replayed")
    found = []
    for role in [options.only] if options.only else STAGE:
        changes = {**settings.get("/**", {}), **settings.get(role, {})}
        law = {POSITION: options.position, ATTITUDE: options.attitude}.get(role)
        found.append(replay(flight, role, law=law, settings=changes, progress=_progress(role, " steps")))
    print(text.replay_json(found) if options.json else "\n".join(map(text.replay_text, found)))
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "replay.json").write_text(text.replay_json(found), encoding="utf-8")
        for item in found:
            columns = {"step": item.steps}
            for name in item.recorded:
                columns[f"{name} recorded"], columns[f"{name} replayed"] = item.recorded[name], item.replayed[name]
            write_csv(options.out / f"replay_{item.role}.csv", columns)
    return 0 if all(item.equal or item.changed for item in found) else 1


def _plot(options: Options) -> int:
    from quad_flight_log.report.pages import flight_figures, names_of
    from quad_flight_log.report.printed_figures import write_figures
    from quad_flight_log.report.run import run_from_flight

    flights = _opened(options)
    if len(flights) > 1 and options.out is None:
        raise FlightLogError("figures of several flights need --out DIR")
    figures = flight_figures([run_from_flight(*each) for each in zip(flights, names_of(flights), strict=True)])
    chosen = [figure for figure in figures if figure.key.startswith(options.only)]
    if not chosen:
        have = ", ".join(figure.key for figure in figures) or "no figure: the bag lacks all topics needed"
        raise FlightLogError(f"--only {options.only}: there is {have}")
    directory: Path = options.out or flights[0].path.parent / "figures"
    write_figures(chosen, directory, options.format or ("png", "pdf"), done=lambda path: print(path, flush=True))
    print(f"{len(chosen)} figures in {directory}", file=sys.stderr)
    return 0


def _report(options: Options) -> int:
    from quad_flight_log.report.html_page import write_page
    from quad_flight_log.report.pages import flight_page

    limits = text.read_limits(options.limits) if options.limits else None
    for flight in _opened(options):
        path = options.out / f"{flight.name}.html" if options.out else flight.path.parent / "report.html"
        print(write_page(flight_page(flight, flight.name, _typed(), limits), path))
    return 0


def _compare(options: Options) -> int:
    from quad_flight_log.report.html_page import write_page
    from quad_flight_log.report.pages import comparison_page, names_of
    from quad_flight_log.report.run import run_from_flight

    flights = _opened(options)
    names = [name.strip() for name in options.names.split(",")] if options.names else names_of(flights)
    if len(names) != len(flights) or len(set(names)) != len(names) or not all(names):
        raise FlightLogError(f"--names: found {options.names!r}, expected {len(flights)} different names")
    values = [run_from_flight(*each).metrics for each in zip(flights, names, strict=True)]
    print(text.table(names, values, notes=[truth_note(flight) for flight in flights]))
    path = (options.out or Path()) / "comparison.html"
    print(write_page(comparison_page(flights, names, _typed()), path))
    return 0


def _layouts(options: Options) -> int:
    from quad_flight_log.report.layouts import layout_files

    directory: Path = options.out or Path()
    directory.mkdir(parents=True, exist_ok=True)
    for name, content in layout_files(options.namespace).items():
        (directory / name).write_text(content, encoding="utf-8")
        print(directory / name)
    return 0


def _view(options: Options) -> int:
    (flight,) = _opened(options)
    options.namespace = flight.namespace
    _layouts(options)
    if truth_note(flight):
        print(truth_note(flight))
    where = options.out or Path()
    print(f"Foxglove: open {flight.path} with the layout {where / 'flight.json'}")
    print(f"RViz: rviz2 -d {where / 'flight.rviz'} and, in another shell, ros2 bag play {flight.path.parent}")
    return 0


_JSON = {"--json": {"action": "store_true", "help": "print JSON"}}
_LIMITS = {"action": "append", "metavar": "FILE|METRIC=VALUE"}
_MANY = {"action": "append", "default": []}

COMMANDS = {
    "info": Command(
        _info,
        "Print what is in a bag: where it comes from, its topics, bytes per topic, what was dropped.",
        "log info flights/case1-1-1\nlog info flights/a/a_0.mcap --json",
        _JSON,
    ),
    "metrics": Command(
        _metrics,
        "Print the metrics of one or more flights; of a cut bag they are those of its readable part, which is said.",
        "log metrics flights/case1-1-1\nlog metrics flights/a flights/b --csv > both.csv",
        {**_JSON, "--csv": {"action": "store_true", "help": "print CSV"}},
    ),
    "check": Command(
        _check,
        "Compare every flight with limits; 1 if one is not met, a bag is truncated or a flight check fails.",
        "log check flights/a --limits position_rmse=0.02\n"
        "log check flights/a flights/b --limits limits.yaml --limits settling_time=5",
        {
            "--limits": {
                **_LIMITS,
                "required": True,
                "help": "YAML file of metric: largest value, or one METRIC=VALUE; may be repeated, later ones win",
            }
        },
    ),
    "verify": Command(
        _verify,
        "Decode everything; 1 if a bag is truncated or its metadata.yaml tells something else than its content.",
        "log verify flights/case1-1-1\nlog verify flights/*",
    ),
    "hash": Command(
        _hash,
        "Print the payload hash of each flight; 1 if several were given and differ, or if a bag is cut.",
        "log hash flights/a flights/b\nlog hash flights/a --topics",
        {"--topics": {"action": "store_true", "help": "print the hash of every step topic too"}},
    ),
    "recover": Command(
        _recover,
        "Write the verified beginning of a cut or damaged bag as a new, complete bag; the old one stays unchanged.",
        "log recover flights/killed\nlog recover flights/killed/killed_0.mcap.part --out flights/saved",
        bags="1",
        own_out=True,
    ),
    "export": Command(
        _export,
        "Write topics as CSV or Parquet files; 1 if a topic cannot be read: it is named, the others written.",
        "log export flights/case1-1-1 --out tables\n"
        "log export flights/case1-1-1 --format parquet --topic truth --topic reference --out tables",
        {
            "--format": {"choices": FORMATS, "default": "csv", "help": "default: csv"},
            "--topic": {**_MANY, "metavar": "TOPIC", "help": "only this; may be repeated"},
        },
        bags="1",
        own_out=True,
    ),
    "replay": Command(
        _replay,
        "Feed recorded inputs to the controllers again and compare their answers with the recorded ones.\n\n"
        "With the recorded law and parameters every bit must be the same (exit 1 if not). With --set or another law\n"
        "the difference is shown. --out writes every replayed number with the recorded one.",
        "log replay flights/case1-1-1\n"
        "log replay flights/case1-1-1 --set position_controller.aibs.x.position_gain=3.5\n"
        "log replay flights/case1-1-1 --attitude itsm --out replayed",
        {
            "--position": {"metavar": "LAW", "help": "another position law"},
            "--attitude": {"metavar": "LAW", "help": "another attitude law"},
            "--only": {"choices": sorted(STAGE), "help": "replay only this controller"},
            "--set": {**_MANY, "dest": "settings", "metavar": "NODE.PARAM=VALUE", "help": "may be repeated"},
            **_JSON,
        },
        bags="1",
        own_out=True,
    ),
    "plot": Command(
        _plot,
        "Draw the paper's figures and the insides of flights as PNG, PDF or SVG files.",
        "log plot flights/case1-1-1 --only figure-05 --format svg\nlog plot flights/a flights/b --out results",
        {
            "--format": {**_MANY, "choices": ("png", "pdf", "svg"), "help": "may be repeated (default: png and pdf)"},
            "--only": {"default": "", "metavar": "TEXT", "help": "only figures whose file name begins with this"},
        },
        own_out=True,
    ),
    "report": Command(
        _report,
        "Write one flight as a self-contained, interactive HTML page: figures, metrics, parameters, events.",
        "log report flights/case1-1-1                  writes flights/case1-1-1/report.html\n"
        "log report flights/case1-1-1 --out results    writes results/case1-1-1.html",
        {"--limits": {**_LIMITS, "help": "as for `log check` (default: those that the flight was held to when flown)"}},
        own_out=True,
    ),
    "compare": Command(
        _compare,
        "Write several flights into one interactive HTML page, all in the same figures, and print their metrics.",
        "log compare flights/a flights/b --out results\nlog compare flights/a flights/b --names proposed,pid",
        {"--names": {"default": "", "metavar": "A,B,...", "help": "names of the flights (default: their folders)"}},
        own_out=True,
    ),
    "view": Command(
        _view,
        "Write the layouts for a bag and print how Foxglove and RViz show it in three dimensions.",
        "log view flights/case1-1-1\nlog view flights/case1-1-1 --out layouts",
        bags="1",
        own_out=True,
    ),
    "layouts": Command(
        _layouts,
        "Write a layout for Foxglove and a configuration for RViz that show every quantity of a flight, live or a bag.",
        "log layouts --out layouts                       writes layouts/flight.json (Foxglove), layouts/flight.rviz\n"
        "log layouts --namespace second --out layouts    for the vehicle in the namespace /second",
        bags="",
        own_out=True,
    ),
}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (--help explains)\n")


def _parser() -> argparse.ArgumentParser:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = _Parser(prog="log", description=__doc__, epilog=_EXAMPLES, formatter_class=formatter)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, command in COMMANDS.items():
        examples = "examples:\n" + "\n".join(f"  {line}" for line in command.examples.splitlines())
        summary = command.about.splitlines()[0]
        own = commands.add_parser(
            name, help=summary, description=command.about, epilog=examples, formatter_class=formatter
        )
        own.add_argument("--out", type=Path, metavar="DIR", help="write into this directory (default: only print)")
        own.add_argument("--namespace", default="", help="namespace of the vehicle")
        if command.bags:
            count: Any = int(command.bags) if command.bags.isdigit() else command.bags
            own.add_argument("bags", nargs=count, metavar="BAG", type=Path, help="bag directory or one of its files")
            own.add_argument("--salvage", action="store_true", help="read a damaged bag up to the damage")
        for flag, settings in command.arguments.items():
            own.add_argument(flag, **settings)
    return parser


def _opened(options: Options) -> list[Flight]:
    """Open all bags of ``options``, with a progress bar for long ones; raises FlightLogError."""
    flights = []
    for bag in options.bags:
        large = sum(file.path.stat().st_size for file in files_of(bag).files) >= _SHOW_FROM
        advance = _progress(f"read {bag.name}") if large else None
        flights.append(open_flight(bag, namespace=options.namespace, salvage=options.salvage, progress=advance))
    return flights


def _progress(label: str, unit: str = "B") -> Callable[[int, int], None] | None:
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


def _typed() -> str:
    """Return what was typed, for a page to say how it was made."""
    return shlex.join(["log", *sys.argv[1:]])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    options = _parser().parse_args(arguments)
    command = COMMANDS[options.command]
    try:
        with contextlib.redirect_stdout(cast("TextIO", _Printable(sys.stdout))):
            if options.out is None or command.own_out:
                return command.run(options)
            return _run_and_keep(command, options)
    except FlightLogError as error:
        return _complain(options.command, str(error))
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            return 0
        return _complain(options.command, f"{error.filename or ''}: {error.strerror or error}")
    except (MemoryError, RecursionError) as error:
        return _complain(options.command, f"the bag asks for more than this machine gives ({type(error).__name__})")


def _complain(command: str, problem: str) -> int:
    line = printable(" ".join(problem.split()))
    print(f"log {command}: {line if len(line) <= _LONGEST_LINE else line[:_LONGEST_LINE] + ' ...'}", file=sys.stderr)
    return 2


class _Printable:
    """Standard output for what bags hold: no text reaches a terminal as a command, or in letters that it lacks."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._encoding = stream, stream.encoding or "utf-8"

    def write(self, text: str) -> int:
        return self._stream.write(printable(text).encode(self._encoding, "backslashreplace").decode(self._encoding))

    def flush(self) -> None:
        self._stream.flush()


def _run_and_keep(command: Command, options: Options) -> int:
    suffix = next((name for name in ("json", "csv") if getattr(options, name, False)), "txt")
    options.out.mkdir(parents=True, exist_ok=True)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        code = command.run(options)
    print(printed.getvalue(), end="")
    (options.out / f"{options.command}.{suffix}").write_text(printed.getvalue(), encoding="utf-8")
    return code


def console() -> None:
    """Run the command line and leave; a defect of ours is one line too, its traceback with QUAD_LOG_TRACEBACK=1."""
    try:
        sys.exit(main())
    except Exception as error:
        if os.environ.get("QUAD_LOG_TRACEBACK"):
            raise
        about = f"{type(error).__name__}: {error}"
        sys.exit(_complain(sys.argv[1], f"defect: {about} (QUAD_LOG_TRACEBACK=1 shows where; please report it)"))


if __name__ == "__main__":
    console()
