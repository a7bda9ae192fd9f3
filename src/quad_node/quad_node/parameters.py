"""A node's ROS parameters from its declared parameter sets: declaration, refusal, live change."""

import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from rcl_interfaces import msg
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.utilities import remove_ros_args

from quad_core.parameter_files import is_of_ros, place_of, read_parameter_file
from quad_core.parameters import Choice, Field, ParameterError, Real, Value, Whole
from quad_core.plugins import PluginError
from quad_core.resolution import Resolved, resolve

BAD_SETUP = 2  # exit code


def check_arguments(args: list[str]) -> None:
    """Refuse what rclpy would pass over: words that are no ROS arguments, and parameter files with mistakes.

    ``args``: the command line, the program first. Raises ParameterError naming the word, or the file and its mistake.
    """
    try:
        stray = remove_ros_args(args)[1:]
    except Exception as error:  # rclpy's own RCLError and UnknownROSArgsError
        text = " ".join(str(error).split())
        raise ParameterError(f"found {text}, expected ROS arguments after --ros-args") from error
    if stray:
        raise ParameterError(f"found {stray[0]!r}, expected --ros-args before it, or nothing (--help explains)")
    for path in _files(args):
        read_parameter_file(path)


def placed(problem: str, args: list[str], role: str = "") -> str:
    """Return ``problem`` with the parameter file of ``args`` that holds the value it complains of, if one does."""
    return place_of(problem, _files(args), role) + problem


def _files(args: list[str]) -> list[Path]:
    return [Path(value) for flag, value in pairwise(args) if flag == "--params-file"]


def resolve_overrides(node: Node, role: str) -> Resolved:
    """Return the resolved parameters of ``node``; ``node`` was made with automatically declared parameters.

    The automatic declarations are taken back, so that ``declare`` can put descriptors and ranges in their place.
    """
    given = current_values(node)
    for name in given:
        node.undeclare_parameter(name)
    return resolve(role, given)


def declare(node: Node, resolved: Resolved) -> None:
    """Declare every parameter of ``resolved`` with description, range and, where not live-settable, read-only."""
    for field in resolved.all_fields():
        # the resolved value already holds what the command line and the files gave, 90deg as 1.5708
        node.declare_parameter(field.name, field.default, descriptor(field), ignore_override=True)


def descriptor(field: Field) -> msg.ParameterDescriptor:
    """Return the ROS descriptor of one parameter; a fresh object, because rclpy keeps and changes it."""
    spec = field.spec
    unit = f" [{spec.unit}]" if isinstance(spec, Real | Whole) and spec.unit else ""
    source = f" ({spec.source})" if spec.source else ""
    found = msg.ParameterDescriptor(description=spec.meaning + unit + source, read_only=not field.live)
    if isinstance(spec, Real):
        found.floating_point_range = [msg.FloatingPointRange(from_value=spec.low, to_value=spec.high, step=0.0)]
    elif isinstance(spec, Whole):
        found.integer_range = [msg.IntegerRange(from_value=spec.low, to_value=spec.high, step=0)]
    elif isinstance(spec, Choice):
        found.additional_constraints = "one of " + ", ".join(spec.options)
    return found


def on_change(node: Node, role: str, commit: Callable[[Resolved, dict[str, Value]], None]) -> None:
    """Check every later change as a whole; once it is in force, ``commit`` gets the new parameter sets and the changes.

    What ``commit`` publishes therefore is what the node runs with.
    """

    def check(parameters: list[Parameter]) -> msg.SetParametersResult:
        changes = {item.name: item.value for item in parameters if not is_of_ros(item.name)}
        if any(item.type_ == msg.ParameterType.PARAMETER_NOT_SET for item in parameters):
            return msg.SetParametersResult(successful=False, reason="a parameter cannot be removed")
        try:
            resolve(role, {**current_values(node), **changes})
        except (ParameterError, PluginError) as error:
            return msg.SetParametersResult(successful=False, reason=str(error))
        return msg.SetParametersResult(successful=True)

    def accept(parameters: list[Parameter]) -> None:
        changes = {item.name: item.value for item in parameters if not is_of_ros(item.name)}
        if changes:
            commit(resolve(role, current_values(node)), changes)

    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(accept)


def current_values(node: Node) -> dict[str, Value]:
    """Return {name: value} of all declared parameters of ours."""
    return {name: found.value for name, found in node.get_parameters_by_prefix("").items() if not is_of_ros(name)}


def fail(role: str, message: str) -> int:
    """Print one line of what was wrong with the set-up and return exit code 2."""
    print(f"{role}: {message}", file=sys.stderr)
    return BAD_SETUP
