"""One flight of five nodes, judged by its bag when all of them have exited.

ros2 launch quad_bringup flight.launch.py case:=case2 directory:=flights/mine namespace:=uav1

Exit code as of scripts/fly: 0 the flight was good, 1 it failed, 2 an argument or a node was refused.
"""

import os
import sys
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from quad_bringup import results
from quad_bringup.commanded import launched, trajectory_of
from quad_bringup.terminal import complain, say
from quad_core.cascade import ALL_ROLES, ROLES
from quad_core.parameters import ParameterError, nearest
from quad_flight import configuration
from quad_flight_log.recorder.provenance import LIMITS
from quad_flight_log.report.text import LimitsError, read_limits
from quad_node.middleware import OPEN, close, close_unless_asked

ARGUMENTS = {
    "case": (
        "",
        "a scenario or trajectory (docs/reference/laws.md), or a parameter file; empty: case1, or the mission's",
    ),
    "vehicle": ("paper", "a vehicle (docs/reference/laws.md), or a parameter file"),
    "preset": ("tuned", "a preset (docs/reference/laws.md), or a parameter file"),
    "params_file": ("", "parameter file that is read last and wins"),
    "directory": ("", "directory of the bag; must not exist; empty: flights/<case>-launch-<n>"),
    "limits": (
        "approach",
        "errors that the flight is held to: approach, printed, a file, or metric=value; empty: none",
    ),
    "namespace": ("", "namespace of the vehicle"),
    "use_sim_time": ("false", "true or false, passed to every node; no control decision depends on it"),
    "mission": ("", "items such as takeoff,case2,hold:5,land for a commander to fly; empty: none"),
    "simulate": ("true", "false: something else owns the vehicle, the simulator is not started"),
    "visible": ("false", "true: this machine alone, whatever transports and ranges the shell has chosen"),
}
BAD_SETUP = 2


def arguments(context: LaunchContext) -> dict[str, str]:
    """Return {name: value} of the launch arguments; raises ParameterError for one that is not understood."""
    typed = [word.partition(":=")[0] for word in context.argv if ":=" in word] if is_named_by_the_user() else []
    for name in typed:
        if name not in ARGUMENTS:
            hint = nearest(name, list(ARGUMENTS))
            raise ParameterError(f"found argument {name!r}{hint}, expected one of {', '.join(ARGUMENTS)}")
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    for name in ("use_sim_time", "simulate", "visible"):
        if given[name].lower() not in ("true", "false"):
            raise ParameterError(f"{name}: found {given[name]!r}, expected true or false")
    if given["params_file"] and not Path(given["params_file"]).is_file():
        raise ParameterError(f"params_file: found {given['params_file']!r}, expected a parameter file")
    if given["directory"] and Path(given["directory"]).exists():
        raise ParameterError(f"directory: found {given['directory']}, which exists; a flight is never overwritten")
    given["case"] = given["case"] or (trajectory_of(given["mission"]) or "hover" if given["mission"] else "case1")
    given["directory"] = given["directory"] or free_directory(Path(given["case"]).stem)
    return given


def is_named_by_the_user() -> bool:
    """Return whether the command line names this file: a file that includes it has arguments of its own."""
    return any(word.endswith("flight.launch.py") for word in sys.argv)


def free_directory(case: str) -> str:
    """Return flights/CASE-launch-N with the first free N."""
    return next(str(path) for n in count(1) if not (path := Path("flights", f"{case}-launch-{n}")).exists())


def limits_of(given: dict[str, str]) -> dict[str, float]:
    """Return {metric: largest value} that the flight is held to; raises ParameterError or LimitsError."""
    asked = given["limits"]
    if not asked or (given["mission"] and trajectory_of(given["mission"]) is None):
        return {}
    return read_limits([asked if "=" in asked else str(configuration.find(configuration.LIMITS, asked))])


def nodes(given: dict[str, str], conclude: Callable[..., Any]) -> list[Node]:
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
            on_exit=conclude,
            # launch sends SIGTERM after 5 s; a vehicle that is still landing would drop
            sigterm_timeout="14400",
            sigkill_timeout="14405",
        )
        for role in roles
    ]


def judged_nodes(given: dict[str, str], limits: dict[str, float]) -> list[Node]:
    """Return the nodes; a refused one shuts the others down, the exit of the last one ends launch with the verdict."""
    codes: list[int] = []
    started: list[Node] = []

    def conclude(event: Any, _context: LaunchContext) -> list[Shutdown]:
        codes.append(event.returncode)
        if len(codes) == len(started):
            raise SystemExit(BAD_SETUP if BAD_SETUP in codes else judged(given, limits))
        return [Shutdown(reason=f"{event.action.name} was refused")] if event.returncode == BAD_SETUP else []

    started += nodes(given, conclude)
    return started


def judged(given: dict[str, str], limits: dict[str, float]) -> int:
    """Print what the bag shows as scripts/fly does; return 0 for a good flight, 1 for another."""
    found = results.report(Path(given["directory"]), limits, given["namespace"].strip("/"))
    name = Path(given["case"]).stem
    say(results.text(name, found, f"vehicle {Path(given['vehicle']).stem}"))
    for problem in found.problems:
        say(f"{name}: {problem}")
    say(f"{name}: {'failed' if found.problems else 'good'}; bag {given['directory']}")
    return 1 if found.problems else 0


def middleware(visible: bool) -> LogInfo:
    """Close the flight to other hosts and users unless the user has chosen otherwise; ``visible`` overrides that."""
    said = close() if visible else close_unless_asked()
    return LogInfo(msg=f"WARNING: {said}" if said.startswith(OPEN) else said)


def flight(context: LaunchContext) -> list[Any]:
    """Return the whole flight, or end with exit code 2 and one line for an argument that is not understood."""
    try:
        given = arguments(context)
        limits = limits_of(given)
        started = judged_nodes(given, limits)
    except (ParameterError, LimitsError) as error:
        complain(f"flight.launch.py: {error}")
        raise SystemExit(BAD_SETUP) from error
    os.environ[LIMITS] = ",".join(f"{metric}={limit!r}" for metric, limit in limits.items())
    return [middleware(given["visible"].lower() == "true"), *started]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, once they are known, the nodes."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=flight)])
