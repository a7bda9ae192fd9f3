"""``scripts/fly``: fly the cascade as five ROS 2 processes, record it, and judge it by its bag."""

import argparse
import os
import secrets
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from quad_bringup import configuration, preparation
from quad_bringup.domains import reserved_domain
from quad_bringup.flight import BAD_SETUP, FAILED, Planned, fly
from quad_bringup.flight_setup import Request, resolve_flight, summary
from quad_bringup.supervisor import interrupts
from quad_core import plugins
from quad_core.parameters import ParameterError
from quad_core.plugins import PluginError
from quad_flight_log.presentation import LimitsError, read_limits
from quad_flight_log.provenance import COMMAND

PAPER_CASES = ("case1", "case2")

_EXAMPLES = """examples:
  scripts/fly                                   the paper: Case 1, then Case 2
  scripts/fly case2 --seed 7                    another disturbance
  scripts/fly case1 --preset minimal --plant paper
  scripts/fly hover --duration 5 --realtime
  scripts/fly case2 --one-process
  scripts/fly hover --set flight.machine_code=false       laws and plant run by CPython: to debug them
  scripts/fly case1 --start printed --set vehicle.thrust_to_weight=4
  scripts/fly case2 --set position_controller.aibs.x.position_gain=3.5 --set simulator.held_gaussian.acceleration_sd=1.5
  scripts/fly flight --vehicle x500 --preset x500
  scripts/fly case1 --scenario my_weather.yaml
  scripts/fly hover --vehicle my_quadrotor.yaml --limits position_rmse=0.05 --out flights/mine

NODE is simulator, trajectory, position_controller, attitude_controller or recorder; flight and vehicle go to all nodes.
All parameters: docs/parameters. Exit codes: 0 ended on time and within the limits, 1 not, 2 bad usage or set-up."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(BAD_SETUP, f"fly: {message} (--help explains)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what the command line asks for; returns the exit code."""
    options = _parser().parse_args(arguments)
    os.environ[COMMAND] = shlex.join(["scripts/fly", *(sys.argv[1:] if arguments is None else arguments)])
    cases = [options.case] if options.case else list(PAPER_CASES)
    made: list[Path] = []
    try:
        directories = _directories(options, cases, made)
        flights = [_planned(options, case, where) for case, where in zip(cases, directories, strict=True)]
        preparation.prepare(node for flight in flights for node in flight.nodes.values())
        with reserved_domain(options.domain) as domain, interrupts() as interrupted:
            codes = []
            for flight in flights:
                codes.append(fly(flight, domain, interrupted))
                if interrupted.name:
                    break
        return max(codes)
    except (ParameterError, PluginError, LimitsError) as error:
        print(f"fly: {error}", file=sys.stderr)
        return BAD_SETUP
    except KeyboardInterrupt:
        print("fly: interrupted by SIGINT before the flight", file=sys.stderr)
        return FAILED
    except OSError as error:
        print(f"fly: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)
        return BAD_SETUP
    finally:
        for directory in reversed(made):
            if directory.is_dir() and not any(directory.iterdir()):
                directory.rmdir()


def _parser() -> argparse.ArgumentParser:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = _Parser(prog="fly", description=__doc__, epilog=_EXAMPLES, formatter_class=formatter)
    cases = sorted({*configuration.names(configuration.SCENARIOS), *plugins.names(plugins.TRAJECTORY)})
    parser.add_argument("case", nargs="?", metavar="CASE", help=f"{', '.join(cases)}; without it: case1, then case2")
    parser.add_argument("--plant", metavar="NAME", help=_names(plugins.PLANT))
    parser.add_argument("--start", metavar="MODE", help="approach: smoothly onto the curve; printed: the paper's step")
    parser.add_argument("--position", metavar="LAW", help=_names(plugins.POSITION_LAW))
    parser.add_argument("--attitude", metavar="LAW", help=_names(plugins.ATTITUDE_LAW))
    parser.add_argument(
        "--preset",
        default="tuned",
        metavar="NAME|FILE",
        help=f"controllers: {', '.join(configuration.names(configuration.CONTROLLERS))}, or a parameter file",
    )
    parser.add_argument(
        "--vehicle",
        default="paper",
        metavar="NAME|FILE",
        help=f"{', '.join(configuration.names(configuration.VEHICLES))}, or a parameter file",
    )
    parser.add_argument(
        "--scenario",
        metavar="NAME|FILE",
        help=f"weather and trouble: {', '.join(configuration.names(configuration.SCENARIOS))}, or a parameter file",
    )
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the disturbance (default: 1)")
    parser.add_argument(
        "--duration", type=float, metavar="S", help="flight time from t = 0 of the curve, after the approach"
    )
    parser.add_argument("--realtime", action="store_true", help="fly at the speed of the clock instead of in lockstep")
    parser.add_argument(
        "--shadow",
        action="append",
        default=[],
        metavar="LAW",
        help="a second controller, recorded and not obeyed; position=LAW or attitude=LAW where both have the name",
    )
    parser.add_argument(
        "--one-process", action="store_true", help="the five nodes in one process: the same bits, several times faster"
    )
    parser.add_argument("--relay", action="store_true", help="controllers see odom through odometry_relay")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the bag's directory (default: flights/CASE-SEED-N)")
    parser.add_argument(
        "--set", action="append", default=[], dest="settings", metavar="NODE.PARAM=VALUE", help="may be repeated"
    )
    parser.add_argument(
        "--limits", action="append", metavar="FILE|METRIC=VALUE", help="errors to be held to (default: by --start)"
    )
    parser.add_argument("--namespace", default="", metavar="NAME", help="namespace of the vehicle")
    parser.add_argument("--domain", type=int, metavar="N", help="ROS domain (default: one that no other flight uses)")
    return parser


def _names(group: str) -> str:
    return f"plug-in of {group}: {', '.join(plugins.names(group))}"


def _directories(options: argparse.Namespace, cases: list[str], made: list[Path]) -> list[Path]:
    """Make and return the bag directory of each case; what was made is noted in ``made``."""
    top = options.out
    if top is None:
        top = _numbered(f"{options.case or 'paper'}-{1 if options.seed is None else options.seed}", made)
    directories = [top] if options.case else [top / case for case in cases]
    for directory in directories:
        if directory.is_dir() and not any(directory.iterdir()):
            continue
        if directory.exists():
            raise ParameterError(f"--out: {directory} exists; a flight is never overwritten")
        _make(directory, made)
    return directories


def _numbered(stem: str, made: list[Path]) -> Path:
    """Make and return flights/STEM-N with the first free N, also when others do the same at the same time."""
    number = 1
    while True:
        directory = Path("flights", f"{stem}-{number}")
        try:
            _make(directory, made)
            return directory
        except FileExistsError:
            number += 1


def _make(directory: Path, made: list[Path]) -> None:
    missing = [parent for parent in directory.parents if not parent.exists()]
    directory.mkdir(parents=True)
    made += [*reversed(missing), directory]


def _planned(options: argparse.Namespace, case: str, directory: Path) -> Planned:
    run_id = f"{case}-{secrets.token_hex(4)}"
    request = Request(
        case,
        options.preset,
        options.vehicle,
        options.plant,
        options.start,
        options.position,
        options.attitude,
        options.seed,
        options.duration,
        options.realtime,
        options.settings,
        options.relay,
        options.shadow,
        options.scenario,
    )
    identity = {"/**": {"flight.run_id": run_id}, "recorder": {"directory": str(directory.resolve())}}
    nodes = resolve_flight(request, identity)
    limits = options.limits or [str(configuration.find(configuration.LIMITS, summary(nodes)["start"]))]
    return Planned(
        case, directory, run_id, options.namespace.strip("/"), nodes, read_limits(limits), options.one_process
    )
