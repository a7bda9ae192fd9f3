"""``scripts/fly``: fly the cascade as ROS 2 processes, record it, and judge it by its bag."""

import argparse
import os
import secrets
import shlex
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from quad_analysis.flight_checks import read_limits
from quad_bringup import steps, surroundings, vehicle_interface
from quad_bringup.ros_flight import BAD_SETUP, FAILED, Planned, fly, viewed
from quad_bringup.supervisor import Interrupted, Interrupts, interrupts
from quad_bringup.surroundings import reserved_domain
from quad_bringup.terminal import complain, say
from quad_commander.missions import read_mission
from quad_core import plugins
from quad_core.cascade import RECORDER, ROLES, SIMULATOR
from quad_core.command_line import Parser, open_streams
from quad_core.parameters import ParameterError
from quad_core.plugins import PluginError
from quad_core.resolution import Resolved
from quad_flight import set_up
from quad_flight.set_up import Request, left_out, resolve_flight, summary, unfelt_wind, vehicle_text
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import COMMAND
from quad_node.middleware import OPEN, close, close_unless_asked

PAPER_CASES = ("case1", "case2")

_EXAMPLES = """examples:
  scripts/fly                                   the paper: Case 1, then Case 2
  scripts/fly case2 --seed 7                    another disturbance
  scripts/fly hover --duration 5 --realtime
  scripts/fly case1 --start printed --set vehicle.thrust_to_weight=4
  scripts/fly --mission takeoff,case2,hold:5,land         take-off, modes and landing: a commander is the sixth node
  scripts/fly hover --vehicle my_quadrotor.yaml --limits position_rmse=0.05 --out flights/mine
  scripts/fly --step hop --vehicle my_quadrotor.yaml      a first flight within narrow limits, after --step bench
  scripts/fly hover --own trajectory="python3 examples/own_nodes/trajectory.py"

NODE: a role (docs/reference/parameters lists them), or flight or vehicle for all nodes.
Parameters: docs/reference/parameters. Exit codes: 0 ended on time and within the limits, 1 not, 2 usage or set-up."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what the command line asks for; returns the exit code."""
    open_streams()
    options = _parser().parse_args(arguments)
    os.environ[COMMAND] = shlex.join(["scripts/fly", *(sys.argv[1:] if arguments is None else arguments)])
    made: list[Path] = []
    try:
        with interrupts() as interrupted:
            return _fly(options, made, interrupted)
    except (ParameterError, PluginError, FlightLogError) as error:
        complain(str(error))
        return BAD_SETUP
    except Interrupted as name:
        complain(f"interrupted by {name} before the flight")
        return FAILED
    except OSError as error:
        complain(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        return BAD_SETUP
    finally:
        for directory in reversed(made):
            if directory.is_dir() and not any(directory.iterdir()):
                directory.rmdir()


def _cases(options: argparse.Namespace) -> list[str]:
    options.trajectory = None
    if options.step is not None:
        options.mission = steps.mission_of(options.step, options.mission)
    if options.mission is not None:
        options.mission, options.trajectory, of_mission = read_mission(options.mission)
        options.settings = [*of_mission, *options.settings]
        options.case = options.case or options.trajectory or "hover"
    return [options.case] if options.case else list(PAPER_CASES)


def _fly(options: argparse.Namespace, made: list[Path], interrupted: Interrupts) -> int:
    """Fly each case, note its directory in ``made``, and return the worst exit code."""
    cases, codes = _cases(options), list[int]()
    _check_namespace(options.namespace)
    if options.visible:
        close()
    seen_by = close_unless_asked()
    directories = _directories(options, cases, made)
    least = surroundings.LEAST_DISK if options.mission is None else surroundings.MISSION_DISK
    surroundings.check_disk(directories[0], least)
    flights = [_planned(options, case, where) for case, where in zip(cases, directories, strict=True)]
    with reserved_domain(options.domain) as domain:
        if seen_by.startswith(OPEN):
            surroundings.check_discovery(domain, seen_by.removeprefix(f"{OPEN}: "))
            complain(f"WARNING: {seen_by}")
        else:
            surroundings.check_loopback()
        surroundings.check_domain(domain, options.namespace.strip("/"))
        say(f"fly: {surroundings.how_to_look_on(domain)}")
        interrupted.flying = True
        for flight in flights:
            if remark := unfelt_wind(flight.nodes):
                complain(f"WARNING: {flight.name}: {remark}")
            with viewed(flight.directory, wanted=options.view):
                codes.append(fly(flight, domain, interrupted))
            if interrupted.name:
                break
        if len(codes) < len(flights):
            complain(f"interrupted by {interrupted.name}: {flights[len(codes)].name} was not flown")
            codes.append(FAILED)
    return max(codes)


def _check_namespace(name: str) -> None:
    from rclpy.exceptions import InvalidNamespaceException
    from rclpy.validate_namespace import validate_namespace

    try:
        validate_namespace(f"/{name.strip('/')}")
    except InvalidNamespaceException as error:
        why = str(error).splitlines()[0].removeprefix("Invalid namespace: ").rstrip(":")
        raise ParameterError(f"--namespace: found {name!r}, expected a ROS name: {why}") from error


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="fly", description=__doc__, epilog=_EXAMPLES)
    kinds = (set_up.CONTROLLERS, set_up.VEHICLES, set_up.SCENARIOS)
    gains, vehicles, scenarios = (", ".join(set_up.shipped_names(kind)) for kind in kinds)
    cases = sorted({*set_up.shipped_names(set_up.SCENARIOS), *plugins.names(plugins.TRAJECTORY)})
    several: dict[str, Any] = {"action": "append", "default": []}
    both = "position=LAW or attitude=LAW if both have it"
    parser.add_argument("case", nargs="?", metavar="CASE", help=f"{', '.join(cases)}; without it: case1, then case2")
    rows: tuple[tuple[str, str, str, dict[str, Any]], ...] = (
        ("--plant", "NAME", _names(plugins.PLANT, "rigid_body"), {}),
        ("--start", "MODE", "approach: onto the curve (default); printed: the paper's step", {}),
        ("--position", "LAW", _names(plugins.POSITION_LAW, "aibs"), {}),
        ("--attitude", "LAW", _names(plugins.ATTITUDE_LAW, "abfnitsm"), {}),
        ("--preset", "NAME|FILE", f"gains: {gains}, or a file of them (default: tuned)", {"default": "tuned"}),
        ("--vehicle", "NAME|FILE", f"{vehicles}, or a parameter file (default: paper)", {"default": "paper"}),
        ("--scenario", "NAME|FILE", f"wind, load, failures: {scenarios}, or a parameter file", {}),
        ("--seed", "N", "seed of the disturbance (default: 1)", {"type": int}),
        ("--duration", "S", "flight time from t = 0 of the curve, after the approach", {"type": float}),
        ("--mission", "ITEMS", "takeoff[:height], a trajectory, hold:seconds, land, with commas; or a YAML file", {}),
        ("--step", "STEP", f"first flights, each after the last: {', '.join(steps.STEPS)}", {"choices": steps.STEPS}),
        ("--shadow", "LAW", f"it computes and is recorded, not used; {both}", {**several, "dest": "shadows"}),
        ("--own", "NODE=COMMAND", "start COMMAND in place of a node, with the flight's --ros-args", several),
        (
            "--vehicle-interface",
            "NAME=FILE",
            "px4, joined, mavlink, crazyflie: its bridge flies; needs --realtime and --mission",
            {},
        ),
        ("--out", "DIR", "the bag's directory (default: flights/CASE-SEED-N)", {"type": Path}),
        ("--set", "NODE.PARAM=VALUE", "repeatable, as --limits, --own and --shadow", {**several, "dest": "settings"}),
        ("--limits", "FILE|METRIC=VALUE", "limits of the verdict (default: by the start)", {"action": "append"}),
        ("--namespace", "NAME", "namespace of the vehicle", {"default": ""}),
        ("--domain", "N", "ROS domain (default: one that no other flight uses)", {"type": int}),
    )
    for option, metavar, text, more in rows:
        parser.add_argument(option, metavar=metavar, help=text, **more)
    for flag, text in (
        ("--realtime", "fly at the speed of the clock instead of in lockstep"),
        ("--one-process", "the five nodes in one process: the same bits, about twice as fast"),
        ("--relay", "odometry_relay makes state from an estimator's topic"),
        ("--view", "in the browser too, on this machine alone; it reads the growing bag, so no node notices"),
        ("--visible", "let every ROS 2 shell on this machine see the nodes, whatever this shell has chosen"),
    ):
        parser.add_argument(flag, action="store_true", help=text)
    return parser


def _names(group: str, default: str) -> str:
    return f"plug-in of {group}: {', '.join(plugins.names(group))} (default: {default})"


def _directories(options: argparse.Namespace, cases: list[str], made: list[Path]) -> list[Path]:
    """Make and return the bag directory of each case; what was made is noted in ``made``."""
    top = options.out
    if top is None:
        name = options.step or options.case or "paper"
        top = _numbered(f"{name}-{1 if options.seed is None else options.seed}", made)
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
    number, parent = 1, Path("flights")
    if parent.is_symlink() and not parent.exists():
        raise ParameterError(f"{parent}: found a link to nothing, expected a directory")
    while True:
        directory = parent / f"{stem}-{number}"
        try:
            _make(directory, made)
            return directory
        except FileExistsError:
            number += 1


def _make(directory: Path, made: list[Path]) -> None:
    missing = [parent for parent in directory.parents if not parent.exists()]
    directory.mkdir(parents=True)
    made += [*reversed(missing), directory]


def _own(options: argparse.Namespace) -> dict[str, list[str]]:
    """Return {node: the command that is started in its place}; raises ParameterError for what cannot be."""
    found = vehicle_interface.commands(options)
    for given in options.own:
        role, _, command = given.partition("=")
        if role not in ROLES or not command.strip():
            raise ParameterError(f"--own: found {given!r}, expected NODE=COMMAND, NODE one of {', '.join(ROLES)}")
        try:
            found[role] = shlex.split(command)
        except ValueError as error:
            raise ParameterError(f"--own: {role}: found {command!r}, expected words as in a shell: {error}") from error
        if shutil.which(program := found[role][0]) is None:
            what = "a file that is not executable" if Path(program).is_file() else "neither on PATH nor a file"
            raise ParameterError(f"--own: {role}: found {program!r}, {what}, expected a program")
    if found and options.one_process:
        name = "--own" if options.own else "--vehicle-interface"
        raise ParameterError(f"{name}: found --one-process too, expected one of them: such a node is a process")
    return found


def _planned(options: argparse.Namespace, case: str, directory: Path) -> Planned:
    own, run_id = _own(options), f"{case}-{secrets.token_hex(4)}"
    asked = {name: value for name, value in vars(options).items() if name in Request._fields}
    settings = [*vehicle_interface.settings(options), *options.settings]
    if options.step is not None:
        fixed = [f"{SIMULATOR}.{name}={value!r}" for name, value in steps.limit_values(options.step).items()]
        simulated = SIMULATOR not in own and options.scenario is None
        settings = [*steps.settings(options.step, simulated), *settings, *fixed]
    request = Request(**{**asked, "case": case, "settings": settings})
    identity = {"/**": {"flight.run_id": run_id}, RECORDER: {"directory": str(directory.resolve())}}
    nodes = resolve_flight(request, identity)
    if remark := left_out(request):
        complain(f"WARNING: {case}: {remark}")
    step = _opened_step(options, nodes, directory) if options.step is not None else ""
    usual = vehicle_interface.AUTOPILOT if options.vehicle_interface else summary(nodes)["start"]
    if usual not in set_up.shipped_names(set_up.LIMITS):  # the trajectory has another kind of start
        usual = "approach"
    limits = options.limits or [str(set_up.shipped_file(set_up.LIMITS, usual))]
    if options.mission is not None and options.trajectory is None:
        limits = options.limits or []  # the usual ones are those of a curve that is flown
    return Planned(
        name=case,
        vehicle=vehicle_text(request, nodes[SIMULATOR].vehicle),
        preset=options.preset,
        directory=directory,
        run_id=run_id,
        namespace=options.namespace.strip("/"),
        nodes=nodes,
        limits=read_limits(limits),
        one_process=options.one_process,
        own=own,
        step=step,
    )


def _opened_step(options: argparse.Namespace, nodes: dict[str, Resolved], directory: Path) -> str:
    """Return what the bag notes of the step that is flown, say what opened it; raises ParameterError if nothing did."""
    found = steps.prints(nodes, options.vehicle_interface or "")
    bag = steps.opening_bag(options.step, found, dict.fromkeys((directory.parent, Path("flights"))))
    opened = f", opened by {bag}" if bag is not None else ""
    say(f"step {options.step}: {steps.described(options.step)}{opened}")
    return " ".join((options.step, *found))
