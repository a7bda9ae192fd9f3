"""``scripts/campaign``: thousands of flights with random parameters, and what came of them."""

import argparse
import hashlib
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from quad_campaign.batch import Parts, flight_of, prepared, run, shipped
from quad_campaign.campaign_report import page, pairs_text, text
from quad_campaign.definition import Definition, command, drawn, read_definition
from quad_campaign.statistics import flights_of, paired, refuse_other_draws
from quad_core.command_line import Parser, open_streams
from quad_core.parameters import ParameterError
from quad_core.plugins import PluginError
from quad_flight.engine import EngineError, source_hash
from quad_flight.score import MEASURES
from quad_flight_log.errors import FlightLogError
from quad_report.page import write_page

GOOD, FAILED, BAD_SETUP, INTERRUPTED = 0, 1, 2, 130
_EXAMPLES = """examples:
  scripts/campaign campaign_case2 --flights 1000 --out campaigns/one
  scripts/campaign campaign_case2 --flights 1000 --out campaigns/one --resume      after it was killed
  scripts/campaign my_campaign.yaml --flights 10000 --out campaigns/two --scheduler tcp://host:8786
  scripts/campaign my_law.yaml --flights 1000 --out campaigns/mine --against campaigns/one      pairs, flight by flight
  scripts/campaign campaign_case2 --refly 17 --out flights/seventeen                flight 17 over ROS, with a bag

Flight n of a campaign is the same flight however many there are and wherever it is flown. DIR holds flights.parquet
(a row per flight), report.html and campaign.json. Compiled code is kept in QUAD_CACHE_DIR
(default: quad_campaign in the user's cache); without a folder that can be written it is compiled each time.
Exit codes: 0 flown, 1 a flight could not be flown, 2 bad usage, 130 interrupted."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly a campaign or one of its flights; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    open_streams()
    options = _parser().parse_args(given)
    if options.resume and options.out is None:
        _parser().error("--resume: found no --out, expected --out DIR, the campaign to go on with")
    try:
        path = shipped().get(options.file, Path(options.file))
        definition = read_definition(path)
        if options.refly is not None:
            return _refly(definition, options)
        return _campaign(path, definition, options, shlex.join(["scripts/campaign", *given]))
    except (ParameterError, PluginError, FlightLogError) as error:
        sys.stderr.write(f"campaign: {error}\n")
        return BAD_SETUP
    except (EngineError, ValueError) as error:
        sys.stderr.write(f"campaign: {error}\n")
        return FAILED
    except OSError as error:
        where = error.filename or options.scheduler
        sys.stderr.write(f"campaign: {f'{where}: {error.strerror or error}' if where else error}\n")
        return BAD_SETUP
    except KeyboardInterrupt:
        sys.stderr.write("campaign: interrupted; --resume goes on with the parts that are stored\n")
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="campaign", description=__doc__, epilog=_EXAMPLES)
    parser.add_argument("file", metavar="FILE", help=f"{', '.join(shipped())}, or the path of a YAML file")
    parser.add_argument("--flights", type=_at_least(1), default=1000, metavar="N", help="how many (default: 1000)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="directory of the results, or of the bag of --refly")
    parser.add_argument("--resume", action="store_true", help="resume the campaign in DIR")
    parser.add_argument(
        "--scheduler", type=_address, default="", metavar="ADDRESS", help="fly on the workers of a Dask scheduler"
    )
    parser.add_argument("--against", type=Path, metavar="DIR", help="compare with a campaign that drew the same values")
    parser.add_argument("--refly", type=_at_least(0), metavar="N", help="fly flight N over ROS, with a bag")
    parser.add_argument("--part", type=_at_least(1), metavar="N", help="flights per part (default: 50, in Python 1)")
    parser.add_argument(
        "--engine", choices=("compiled", "python"), default="compiled", help="python: slow, the same bits"
    )
    return parser


def _at_least(least: int) -> Callable[[str], int]:
    def number(word: str) -> int:
        if int(word) < least:
            raise argparse.ArgumentTypeError(f"found {word}, expected at least {least}")
        return int(word)

    return number


def _address(word: str) -> str:
    if word and not word.rpartition(":")[2].isdigit():
        raise argparse.ArgumentTypeError(f"found {word!r}, expected tcp://HOST:PORT")
    return word


def _refly(definition: Definition, options: argparse.Namespace) -> int:
    from quad_bringup.fly import main as fly

    _, values = flight_of(prepared(definition), options.refly)
    words = command(definition, values) + (["--out", str(options.out)] if options.out else [])
    # what a success is, is said by the campaign, not by the case
    for measure, limit in definition.success.items():
        words += ["--limits", f"{MEASURES[measure].metric}={limit:g}"]
    sys.stdout.write(shlex.join(["scripts/fly", *words]) + "\n")
    sys.stdout.flush()
    return fly(words)


def _campaign(path: Path, definition: Definition, options: argparse.Namespace, said: str) -> int:
    size = options.part or {"compiled": 50, "python": 1}[options.engine]
    out = options.out or Path("campaigns", f"{definition.name}-{datetime.now(timezone.utc):%Y%m%d-%H%M%S}")
    batch = prepared(definition)
    theirs = None if options.against is None else flights_of(options.against)
    if theirs is not None:
        count = min(options.flights, len(theirs))
        refuse_other_draws([drawn(definition, batch.variation, number) for number in range(count)], theirs)
    about: dict[str, Any] = {
        "identity": {
            "file": hashlib.sha256(path.read_bytes()).hexdigest(),
            "flights": options.flights,
            "part": size,
            "code": source_hash(batch.base.modules),
        },
        "definition": path.read_text("utf-8"),
        "command": said,
        "begun": datetime.now(timezone.utc).isoformat(timespec="seconds"),
    }
    parts = Parts(out, options.flights, size)
    parts.open(about, options.resume)
    began = time.monotonic()
    run(definition, parts, scheduler=options.scheduler, compiled=options.engine == "compiled")
    frame = parts.joined()
    took = time.monotonic() - began
    facts = {"command": said, "flights": len(frame), "steps": int(frame["steps"].sum()), "wall time, s": f"{took:.1f}"}
    whole = {**facts, **about["identity"], "file text": about["definition"]}
    against = None
    if theirs is not None:
        against = (options.against.name, paired(frame, theirs))
    write_page(page(definition, batch.variation, frame, whole, against), out / "report.html")
    sys.stdout.write(f"{definition.name}: {text(definition, frame)}\n")
    if against is not None:
        sys.stdout.write(f"{pairs_text(*against)}\n")
    sys.stdout.write(f"{len(frame)} flights, {facts['steps']} steps in {took:.1f} s; {out / 'report.html'}\n")
    return GOOD


if __name__ == "__main__":
    sys.exit(main())
