"""From the command line to a running node, and to an exit code that tells the truth."""

import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.task import Future

from quad_core import plugins
from quad_core.cascade import ALL_ROLES
from quad_core.flight_parameters import FlightParameters
from quad_core.parameters import Choice, Field, ParameterError, Real, Whole, fields
from quad_core.vehicle import Vehicle
from quad_node import executor, parameters
from quad_node.flight_node import FlightNode

# How long, in s, a node may take to see that its last messages arrived.
_INTERRUPTED, _ENDED = 0.5, 5.0


def run(role: str, make: Callable[[], FlightNode], summary: str, args: list[str] | None = None) -> int:
    """Run one node until it is done; returns 0 flown to the end, 1 failed or interrupted, 2 bad set-up."""
    given = sys.argv if args is None else args
    if "--help" in given or "-h" in given:
        print(help_text(role, summary))
        return 0
    try:
        parameters.check_arguments(given)
        seen_by = executor.init(given)
    except ParameterError as error:
        return parameters.fail(role, str(error))
    except Exception as error:  # rclpy raises its own RCLError and UnknownROSArgsError here: bad arguments
        return parameters.fail(role, " ".join(str(error).split()))
    try:
        return _spin(role, make, seen_by, given)
    finally:
        rclpy.try_shutdown()


def _spin(role: str, make: Callable[[], FlightNode], seen_by: str, args: Sequence[str] = ()) -> int:
    stop: list[str] = []
    # a node that is half made could not close what it has opened
    executor.on_signals(stop, Future())
    try:
        node = make()
        node.introduce(seen_by)
    except (ValueError, InvalidParameterTypeException, InvalidParameterValueException) as error:
        return parameters.fail(role, parameters.placed(str(error), list(args), role))
    except OSError as error:
        return parameters.fail(role, f"{error.filename or ''}: {error.strerror or error}")
    executor.on_signals(stop, node.done, node.on_signal)
    node.scheduled(executor.settle(node.priority, node.in_background))
    try:
        executor.spin([node.ros], node.done)
        if stop:
            node.on_interrupt(stop[0])
        node.drain(_INTERRUPTED if stop else _ENDED)
        node.close()
        return node.exit_code
    finally:
        executor.destroy(node.ros, node.exit_code)


def help_text(role: str, summary: str) -> str:
    """Return what --help prints: the parameters with unit, range and default, the plug-ins, examples."""
    kind = ALL_ROLES[role]
    lines = [summary, "", f"usage: ros2 run {kind.package} {role} [--ros-args -p NAME:=VALUE --params-file FILE]", ""]
    lines += ["parameters:"] + [_row(field) for field in fields(kind.parameters)]
    for slot, group in kind.slots.items():
        for name in plugins.names(group):
            lines += ["", f"with {slot}:={name}:"]
            lines += [_row(field) for field in fields(plugins.load(group, name).Parameters, f"{name}.", slot == "law")]
    lines += ["", "shared by all nodes of a flight:"]
    lines += [_row(field) for field in (*fields(FlightParameters, "flight."), *fields(Vehicle, "vehicle."))]
    lines += ["", "examples:", f"  ros2 run {kind.package} {role} --ros-args -p flight.seed:=7"]
    lines += [f"  ros2 run {kind.package} {role} --ros-args --params-file flight.yaml -r __ns:=/second"]
    lines += [
        "",
        "-p NODE:NAME:=VALUE sets a parameter of that node alone: several nodes can be given the same words, as in",
    ]
    lines += ["  -p trajectory:hover.duration:=5.0 -p flight.seed:=7"]
    return "\n".join(lines)


def _row(field: Field) -> str:
    spec = field.spec
    bounds = ""
    if isinstance(spec, Real | Whole):
        bounds = f" in [{spec.low:g}, {spec.high:g}] {spec.unit}".rstrip()
    elif isinstance(spec, Choice):
        bounds = " one of " + ", ".join(spec.options)
    source = f" ({spec.source})" if spec.source else ""
    live = "; live" if field.live else ""
    return f"  {field.name} = {field.default!r}{bounds}: {spec.meaning}{source}{live}"
