"""One flight as scripts/fly flies it, in the domain of the shell: fly starts the nodes and judges their bag.

ros2 launch quad_bringup flight.launch.py case:=case2 directory:=flights/mine namespace:=uav1

Exit code as of scripts/fly: 0 the flight was good, 1 it failed, 2 an argument or a node was refused.
"""

import os
import shlex
import sys
from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

from quad_bringup.processes import installed
from quad_bringup.terminal import complain
from quad_core.parameters import ParameterError, nearest

ARGUMENTS = {
    "case": ("", "a scenario or trajectory (docs/reference/laws.md); empty: case1 and case2, or the mission's"),
    "mission": ("", "items such as takeoff,case2,hold:5,land for a commander to fly, or a YAML file of them"),
    "vehicle": ("paper", "a vehicle (docs/reference/laws.md), or a parameter file"),
    "preset": ("tuned", "a preset (docs/reference/laws.md), or a parameter file"),
    "params_file": ("", "parameter file that is read last and wins"),
    "directory": ("", "directory of the bag; must not exist; empty: flights/<case>-<seed>-<n>"),
    "limits": ("", "errors that the flight is held to: a file, or metric=value; empty: those of fly"),
    "namespace": ("", "namespace of the vehicle"),
    "realtime": ("false", "true: at the speed of the clock instead of in lockstep"),
    "visible": ("false", "true: this machine alone, whatever transports and ranges the shell has chosen"),
    "options": ("", "further options of scripts/fly, such as '--seed 7 --set vehicle.mass=0.7'"),
}
FLAGS = ("realtime", "visible")
OPTIONS = {"params_file": "--scenario", "directory": "--out"}
"""The options of fly that have another name than the argument."""
DAY = "86400"


def words(context: LaunchContext) -> list[str]:
    """Return what fly is started with; raises ParameterError for an argument that is not understood."""
    typed = [word.partition(":=")[0] for word in context.argv if ":=" in word] if is_named_by_the_user() else []
    for name in typed:
        if name not in ARGUMENTS:
            hint = nearest(name, list(ARGUMENTS))
            raise ParameterError(f"found argument {name!r}{hint}, expected one of {', '.join(ARGUMENTS)}")
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    options = given.pop("options")
    try:
        found = ["--domain", os.environ.get("ROS_DOMAIN_ID") or "0", *shlex.split(options)]
    except ValueError as error:
        raise ParameterError(f"options: found {options!r}, expected words as in a shell: {error}") from error
    for name in FLAGS:
        if (value := given.pop(name)).lower() not in ("true", "false"):
            raise ParameterError(f"{name}: found {value!r}, expected true or false")
        found += [f"--{name}"] * (value.lower() == "true")
    case = given.pop("case")
    for name, value in given.items():
        found += [OPTIONS.get(name, f"--{name}"), value] if value else []
    return [*found, *([case] if case else [])]


def is_named_by_the_user() -> bool:
    """Return whether the command line names this file: a file that includes it has arguments of its own."""
    return any(Path(word).name == "flight.launch.py" for word in sys.argv)


def end(event: Any, _context: LaunchContext) -> None:
    """End launch with the exit code of fly, unless another file has included this one."""
    if is_named_by_the_user():
        raise SystemExit(event.returncode)


def flight(context: LaunchContext) -> list[ExecuteProcess]:
    """Return the process of fly, or end with exit code 2 and one line for an argument that is not understood."""
    try:
        command = [str(installed("quad_bringup", "fly")), *words(context)]
    except ParameterError as error:
        complain(f"flight.launch.py: {error}")
        raise SystemExit(2) from error
    # launch sends SIGTERM 5 s after Ctrl-C, which stops the motors of a vehicle that is still landing
    patience = {"sigterm_timeout": DAY, "sigkill_timeout": DAY}
    return [ExecuteProcess(cmd=command, name="fly", output="screen", on_exit=end, **patience)]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, once they are known, the process."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=flight)])
