"""One flight of five nodes; launch returns when all have left.

ros2 launch quad_bringup flight.launch.py case:=case2 directory:=flights/mine namespace:=uav1
"""

from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from quad_bringup.commanded import launched
from quad_core.cascade import ALL_ROLES, ROLES
from quad_core.parameters import ParameterError
from quad_flight import configuration
from quad_node.middleware import OPEN, close, close_unless_asked

ARGUMENTS = {
    "case": ("case1", "scenario: case1, case2, hover, or a parameter file"),
    "vehicle": ("paper", "vehicle: paper, or a parameter file"),
    "preset": ("tuned", "controllers: tuned, minimal, printed, or a parameter file"),
    "params_file": ("", "parameter file that is read last and wins"),
    "directory": ("", "directory of the bag; must not exist; empty: flights/<time>"),
    "namespace": ("", "namespace of the vehicle"),
    "use_sim_time": ("false", "true or false, passed to every node; no control decision depends on it"),
    "mission": ("", "items such as takeoff,case2,hold:5,land for a commander to fly; empty: none"),
    "simulate": ("true", "false: something else owns the vehicle, the simulator is not started"),
    "visible": ("false", "true: this machine alone, whatever transports and ranges the shell has chosen"),
}
BAD_SETUP = 2


def arguments(context: LaunchContext) -> dict[str, str]:
    """Return {name: value} of the launch arguments; raises ParameterError for one that is not understood."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    for name in ("use_sim_time", "simulate", "visible"):
        if given[name].lower() not in ("true", "false"):
            raise ParameterError(f"{name}: found {given[name]!r}, expected true or false")
    if given["params_file"] and not Path(given["params_file"]).is_file():
        raise ParameterError(f"params_file: found {given['params_file']!r}, expected a parameter file")
    return given


def nodes(given: dict[str, str]) -> list[Node]:
    """Return the nodes that the launch arguments ask for; raises ParameterError for an unknown name."""
    parameters = [
        str(configuration.find(configuration.VEHICLES, given["vehicle"])),
        str(configuration.find(configuration.CONTROLLERS, given["preset"])),
        str(configuration.find(configuration.SCENARIOS, given["case"])),
        *([given["params_file"]] if given["params_file"] else []),
        {"use_sim_time": given["use_sim_time"].lower() == "true"},
    ]
    overrides = launched(given["mission"]) if given["mission"] else {role: {} for role in ROLES}
    roles = [role for role in overrides if role != "simulator" or given["simulate"].lower() == "true"]
    return [
        Node(
            package=ALL_ROLES[role].package,
            executable=role,
            name=role,
            namespace=given["namespace"],
            remappings=[("/clock", "clock")],  # the time source of use_sim_time follows the namespace, too
            parameters=[
                *parameters,
                *([{"directory": given["directory"]}] if role == "recorder" else []),
                *([{"recordings": given["directory"]}] if role == "commander" else []),
                *([overrides[role]] if overrides[role] else []),
            ],
            output="screen",
            on_exit=end_all_if_refused,
            # A vehicle that is still landing would drop by the SIGTERM that launch sends who does not leave within 5 s.
            sigterm_timeout="300",
            sigkill_timeout="305",
        )
        for role in roles
    ]


def end_all_if_refused(event: Any, _context: LaunchContext) -> list[Shutdown]:
    """Return what ends the others when a node was refused: it will not join. Of a crash the others notice and say."""
    return [Shutdown(reason=f"{event.action.name} was refused")] if event.returncode == BAD_SETUP else []


def middleware(visible: bool) -> LogInfo:
    """Close the flight to other hosts and users unless the user has chosen otherwise; ``visible`` overrides that."""
    said = close() if visible else close_unless_asked()
    return LogInfo(msg=f"WARNING: {said}" if said.startswith(OPEN) else said)


def flight(context: LaunchContext) -> list[Any]:
    """Return the whole flight; raises ParameterError for an argument that is not understood."""
    given = arguments(context)
    return [middleware(given["visible"].lower() == "true"), *nodes(given)]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, once they are known, the nodes."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=flight)])
