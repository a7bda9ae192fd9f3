"""A node's ROS parameters from its declared parameter sets: declaration, refusal, live change."""

import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from quad_core.node_parameters import Resolved, resolve
from quad_core.parameter_files import read_parameter_file
from quad_core.parameters import Choice, Field, ParameterError, Real, Value, Whole
from quad_core.plugins import PluginError

_ROS_OWN = ("use_sim_time", "start_type_description_service")


def check_files(args: list[str]) -> None:
    """Read every ``--params-file`` of ``args`` strictly; raises ParameterError for what rcl would swallow."""
    for flag, value in pairwise(args):
        if flag == "--params-file":
            read_parameter_file(Path(value))


def resolve_overrides(node: Node, role: str) -> Resolved:
    """Return what ``node`` was told; ``node`` was made with automatically declared parameters.

    The automatic declarations are taken back, so that ``declare`` can put descriptors and ranges in their place.
    """
    given = {
        name: parameter.value
        for name, parameter in node.get_parameters_by_prefix("").items()
        if name not in _ROS_OWN and not name.startswith("qos_overrides.")
    }
    for name in given:
        node.undeclare_parameter(name)
    return resolve(role, given)


def declare(node: Node, resolved: Resolved) -> None:
    """Declare every parameter of ``resolved`` with description, range and, where not live-settable, read-only."""
    for field in resolved.all_fields():
        node.declare_parameter(field.name, field.default, descriptor(field))


def descriptor(field: Field) -> ParameterDescriptor:
    """Return the ROS descriptor of one parameter; a fresh object, because rclpy keeps and changes it."""
    spec = field.spec
    unit = f" [{spec.unit}]" if isinstance(spec, Real | Whole) and spec.unit else ""
    source = f" ({spec.source})" if spec.source else ""
    found = ParameterDescriptor(description=spec.meaning + unit + source, read_only=not spec.live)
    if isinstance(spec, Real):
        found.floating_point_range = [FloatingPointRange(from_value=spec.low, to_value=spec.high, step=0.0)]
    elif isinstance(spec, Whole):
        found.integer_range = [IntegerRange(from_value=spec.low, to_value=spec.high, step=0)]
    elif isinstance(spec, Choice):
        found.additional_constraints = "one of " + ", ".join(spec.options)
    return found


def on_change(node: Node, role: str, accept: Callable[[Resolved, dict[str, Value]], None]) -> None:
    """Check every later change as a whole; ``accept`` gets the new parameter sets only when all are good."""

    def check(parameters: list[Parameter]) -> SetParametersResult:
        changes = {item.name: item.value for item in parameters if item.name not in _ROS_OWN}
        if any(item.type_ == ParameterType.PARAMETER_NOT_SET for item in parameters):
            return SetParametersResult(successful=False, reason="a parameter cannot be removed")
        if not changes:
            return SetParametersResult(successful=True)
        try:
            accept(resolve(role, {**current_values(node), **changes}), changes)
        except (ParameterError, PluginError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)


def current_values(node: Node) -> dict[str, Value]:
    """Return {name: value} of all declared parameters of ours."""
    return {
        name: parameter.value
        for name, parameter in node.get_parameters_by_prefix("").items()
        if name not in _ROS_OWN and not name.startswith("qos_overrides.")
    }


def fail(role: str, message: str) -> int:
    """Print one line of what was wrong with the set-up and return exit code 2."""
    print(f"{role}: {message}", file=sys.stderr)
    return 2
