"""Parameters of a vehicle from logs of its flights: a vehicle file, each parameter with interval and verdict, a page.

Examples:
  scripts/identify flight.ulg --mass 1.5 --arms 0.17,0.17 --out my_vehicle.yaml
  scripts/identify log10 log15 --mass 0.031 --arms 0.046 --json identified.json --page identified.html
  scripts/identify lap.csv --map nanobench
  scripts/identify --set-points manoeuvre.csv

A LOG is a bag that `log import` wrote, or any file that it reads. Exit codes: 0 all that a vehicle file needs is told,
1 it is not (what to fly is said), 2 bad usage or no readable log.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from quad_core.cascade import SIMULATOR
from quad_core.command_line import Parser
from quad_core.geometry import ZERO
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_core.parameters import ParameterError, Value, build
from quad_core.types import Quat, Vec3, fresh
from quad_core.vehicle import ARRANGEMENTS, Layout, Vehicle
from quad_dynamics.rotors import DIAGONAL, yaw_arm
from quad_flight_log.errors import FlightLogError, printable
from quad_identify.identify import Result, identify
from quad_identify.logs import places, read_log
from quad_identify.record import RecordError
from quad_identify.vehicle_file import GRAVITY, bridge_sections, vehicle_text, vehicle_values
from quad_trajectory import identify as manoeuvre

SET_POINT_PERIOD = 0.02  # s
LIMITS = (("mass", 0.001, 1000.0, " kg"), ("curve", 0.0, 1.0, ""), ("delay", 0.0, 0.25, " s"))


def _parser() -> argparse.ArgumentParser:
    about, _, examples = (__doc__ or "").partition("\n\n")
    formatter = argparse.RawDescriptionHelpFormatter
    parser = Parser(prog="identify", description=about, epilog=examples, formatter_class=formatter)
    parser.add_argument("logs", nargs="*", type=Path, metavar="LOG")
    for name, kind, shown, words in (
        ("--set-points", Path, "FILE", "write the manoeuvre as CSV, for an autopilot's own controllers"),
        ("--mass", float, "KG", "from a scale: no flight tells it"),
        ("--arms", str, "M|X,Y", "centre to rotor in m, or its distances along x and y"),
        ("--map", str, "NAME|FILE", "map of columns, as for log import"),
        ("--curve", float, "K", "known share of the square term in 0..1 (PX4's THR_MDL_FAC)"),
        ("--delay", float, "S", "known delay from command to motor; else identified"),
        ("--prior", Path, "FILE", "a vehicle file: compared with, and used where nothing is told"),
        ("--out", Path, "FILE", "vehicle file to write"),
        ("--json", Path, "FILE", "value, low, high, told, why of each parameter; errors"),
        ("--page", Path, "FILE", "the same as one HTML page"),
    ):
        parser.add_argument(name, type=kind, metavar=shown, help=words, default="" if kind is str else None)
    layouts = "where motors 1 to 4 stand (default: the map's)"
    parser.add_argument("--layout", choices=sorted(ARRANGEMENTS), default="", help=layouts)
    held_out = "measure errors on the last log instead of the last fifth"
    parser.add_argument("--held-out", action="store_true", help=held_out)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    options = _parser().parse_args(arguments)
    try:
        return _run(options)
    except (RecordError, FlightLogError, ParameterError) as error:
        return _complain(str(error))
    except OSError as error:
        return _complain(f"{error.filename or ''}: {error.strerror or error}")
    except MemoryError:
        return _complain("the log asks for more memory than this machine has")


def _complain(problem: str) -> int:
    print(printable(f"identify: {' '.join(problem.split())}"), file=sys.stderr)
    return 2


def _run(options: argparse.Namespace) -> int:
    if options.set_points:
        write_set_points(options.set_points)
        print(options.set_points)
        return 0
    if not options.logs:
        raise RecordError("LOG: found none, expected at least one log, or --set-points FILE")
    given, prior = _arms(options), _prior(options.prior) if options.prior else {}
    for name, least, most, unit in LIMITS:
        found = getattr(options, name)
        if found is not None and not least <= found <= most:
            raise RecordError(f"--{name}: found {found:g}, expected {least:g} to {most:g}{unit}")
    flights = []
    for path in options.logs:
        _progress(f"reading {path}")
        flights.append(read_log(path, options.map, options.layout))
    layout = next((name for name, rotors in ARRANGEMENTS.items() if rotors == flights[0].rotors), "x")
    arms = places(given, layout) if given else None
    result = identify(
        flights,
        options.mass,
        arms,
        curve=options.curve,
        delay=options.delay,
        prior=_model_of(build(Vehicle, prior)) if prior else None,
        last_held_out=options.held_out,
        report=_progress,
    )
    print(printable(result.text()))
    if options.json:
        options.json.write_text(result.as_json() + "\n", encoding="utf-8")
    if options.page:
        _page(result, options.page)
    return _vehicle(options, result, arms, layout, prior)


def write_set_points(path: Path) -> None:
    """Write the manoeuvre as rows of 0.02 s, as trajectory ``file`` reads them: from rest at its centre, SI, ENU."""
    parameters = build(manoeuvre.Parameters, {})
    plan = manoeuvre.plan(parameters, Vehicle(), fresh(Vec3(*parameters.centre), ZERO, Quat(), ZERO))
    rows = ["t,x,y,z,vx,vy,vz,ax,ay,az,yaw"]
    for step in range(int(manoeuvre.duration(parameters, plan) / SET_POINT_PERIOD)):
        at = manoeuvre.sample(parameters, plan, step * SET_POINT_PERIOD)
        numbers = (step * SET_POINT_PERIOD, *at.p_w, *at.v_w, *at.a_w, at.yaw)
        rows.append(",".join(f"{number:.6g}" for number in numbers))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def _vehicle(
    options: argparse.Namespace, result: Result, arms: tuple[float, float] | None, layout: str, prior: dict[str, Value]
) -> int:
    try:
        if arms is None:
            raise RecordError("no vehicle file: it needs --arms, which no flight tells")
        values = vehicle_values(result, arms, layout, prior)
        names = ", ".join(path.name for path in options.logs)
        text = vehicle_text(values, result.told("command_delay"), f"Identified from {names} by scripts/identify.")
        text += bridge_sections(result, values, arms)
    except RecordError as error:
        print(printable(f"identify: {error}"), file=sys.stderr)
        return 1
    if options.out:
        options.out.write_text(text, encoding="utf-8")
        print(options.out)
    return 0


def _progress(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\x1b[K{printable(text)[:100]}", end="", file=sys.stderr, flush=True)


def _arms(options: argparse.Namespace) -> list[float]:
    try:
        arms = [float(part) for part in options.arms.split(",")] if options.arms else []
    except ValueError:
        arms = [0.0]
    if len(arms) > 2 or any(not 0.001 <= arm <= 10.0 for arm in arms):
        raise RecordError(f"--arms: found {options.arms!r}, expected one or two lengths of 0.001 to 10 m")
    return arms


def _prior(path: Path) -> dict[str, Value]:
    values = overrides_for([read_parameter_file(path)], SIMULATOR)
    prior = {name.removeprefix("vehicle."): value for name, value in values.items() if name.startswith("vehicle.")}
    if not prior:
        raise RecordError(f"{path}: found no vehicle.*, expected a vehicle file")
    build(Vehicle, prior)
    return prior


def _model_of(vehicle: Vehicle) -> dict[str, float]:
    """Return the parameters of the fit that a vehicle means, its thrust being the square of the command."""
    mass, arm = vehicle.mass, vehicle.arm_length * (DIAGONAL if vehicle.layout == Layout.X else 1.0)
    return {
        "roll_torque_per_inertia": mass * arm / vehicle.inertia_xx,
        "pitch_torque_per_inertia": mass * arm / vehicle.inertia_yy,
        "yaw_torque_per_inertia": mass * yaw_arm(vehicle) / vehicle.inertia_zz,
        "thrust_square": vehicle.thrust_to_weight * GRAVITY,
        "rotor_time_constant": max(vehicle.rotor_time_constant, 1e-4),
        "linear_drag": vehicle.drag_coefficient / mass,
        "vertical_drag": vehicle.drag_coefficient / mass,
    }


def _page(result: Result, path: Path) -> None:
    from quad_report.page import Page, heading, table, write_page

    rows = []
    for name, found in result.parameters.items():
        cells = ["-" if part is None else _number(part) for part in (found.value, found.low, found.high)]
        rows.append([name, *cells, found.unit, "told" if found.told else "not told", found.why, found.fly])
    head = ["parameter", "value", "low", "high", "unit", "verdict", "why", "what to fly"]
    body = [heading("Parameters", "95 % intervals"), table(head, rows)]
    if result.held_out:
        names = list(dict.fromkeys(name for errors in result.held_out.values() for name in errors))
        errors = [
            [quantity, *(f"{of[name]:.3g}" if name in of else "-" for name in names)]
            for quantity, of in result.held_out.items()
        ]
        body += [heading("Held out", "RMS errors on what the fit has not seen"), table(["quantity", *names], errors)]
    told = sum(found.told for found in result.parameters.values())
    verdict = (
        "good" if told == len(result.parameters) else "unknown",
        f"{told} of {len(result.parameters)} parameters are told by these logs",
    )
    notes = [("note", note) for note in result.notes]
    write_page(Page("What these logs tell", "scripts/identify", notes, body, verdict), path)
    print(path)


def _number(value: float | list[float]) -> str:
    return ", ".join(f"{part:.4g}" for part in value) if isinstance(value, list) else f"{value:.4g}"


def console() -> None:
    """Run the command line and leave."""
    sys.exit(main())


if __name__ == "__main__":
    console()
