"""``log VERB BAG``: look into, measure, check, verify, repair, convert and replay recorded flights."""

import argparse
import contextlib
import importlib
import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn, Protocol, TextIO, cast

from quad_flight_log.errors import FlightLogError, printable

# Verb: module. A module is light to import (what is heavy it imports in ``run``).
VERBS = {
    "info": "quad_flight_log.verbs.info",
    "metrics": "quad_flight_log.verbs.metrics",
    "check": "quad_flight_log.verbs.check",
    "verify": "quad_flight_log.verbs.verify",
    "hash": "quad_flight_log.verbs.hash",
    "recover": "quad_flight_log.verbs.recover",
    "export": "quad_flight_log.verbs.export",
    "replay": "quad_flight_log.verbs.replay",
    "plot": "quad_flight_log.verbs.plot",
    "report": "quad_flight_log.verbs.report",
    "compare": "quad_flight_log.verbs.compare",
    "view": "quad_flight_log.verbs.view",
    "layouts": "quad_flight_log.verbs.layouts",
}

_LONGEST_LINE = 800
_EXAMPLES = """examples:
  log info flights/case1-1-1
  log metrics flights/case1-1-1 flights/case1-2-1
  log VERB --help

A BAG is a bag directory or an MCAP file, closed or not; topics are found in any namespace, or in --namespace.
Exit codes: 0 good, 1 the flight or the bag is not, 2 bad usage or no readable bag."""


class Verb(Protocol):
    """A module with one verb; the first line of its docstring is its summary.

    If ``OWN_OUT`` is there and true, the verb itself handles ``options.out``; else what it prints is also written to
    ``DIR/<verb>.txt`` (.json, .csv with --json, --csv).
    """

    EXAMPLES: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the verb's own arguments; --out is added already."""

    def run(self, options: argparse.Namespace) -> int:
        """Do it and return the exit code; raises FlightLogError for what makes exit code 2."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (--help explains)\n")


def _verb(name: str) -> Verb:
    return cast("Verb", importlib.import_module(VERBS[name]))


def _parser() -> argparse.ArgumentParser:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = _Parser(prog="log", description=__doc__, epilog=_EXAMPLES, formatter_class=formatter)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name in VERBS:
        module = _verb(name)
        about = (module.__doc__ or "").strip()
        verb = verbs.add_parser(
            name,
            help=about.splitlines()[0],
            description=about,
            epilog=module.EXAMPLES,
            formatter_class=formatter,
        )
        verb.add_argument("--out", type=Path, metavar="DIR", help="write into this directory (default: only print)")
        module.add_arguments(verb)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    options = _parser().parse_args(arguments)
    module = _verb(options.verb)
    try:
        with contextlib.redirect_stdout(cast("TextIO", _Printable(sys.stdout))):
            if options.out is None or getattr(module, "OWN_OUT", False):
                return module.run(options)
            return _run_and_keep(module, options)
    except FlightLogError as error:
        return _complain(options.verb, str(error))
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            return 0
        return _complain(options.verb, f"{error.filename or ''}: {error.strerror or error}")
    except (MemoryError, RecursionError) as error:
        return _complain(options.verb, f"the bag asks for more than this machine gives ({type(error).__name__})")


def _complain(verb: str, problem: str) -> int:
    line = printable(" ".join(problem.split()))
    print(f"log {verb}: {line if len(line) <= _LONGEST_LINE else line[:_LONGEST_LINE] + ' ...'}", file=sys.stderr)
    return 2


class _Printable:
    """Standard output for what bags hold: no text of a bag reaches a terminal as a command."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(printable(text))

    def flush(self) -> None:
        self._stream.flush()


def _run_and_keep(module: Verb, options: argparse.Namespace) -> int:
    suffix = next((name for name in ("json", "csv") if getattr(options, name, False)), "txt")
    options.out.mkdir(parents=True, exist_ok=True)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        code = module.run(options)
    print(printed.getvalue(), end="")
    (options.out / f"{options.verb}.{suffix}").write_text(printed.getvalue(), encoding="utf-8")
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
