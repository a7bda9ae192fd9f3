"""One flight of five nodes; launch returns when all have left.

ros2 launch quad_bringup flight.launch.py case:=case2 directory:=flights/mine namespace:=uav1
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from quad_bringup import configuration
from quad_bringup.processes import PACKAGES
from quad_core.node_parameters import ROLES

ARGUMENTS = {
    "case": ("case1", "scenario: case1, case2, hover, or a parameter file"),
    "vehicle": ("paper", "vehicle: paper, or a parameter file"),
    "preset": ("tuned", "controllers: tuned, minimal, printed, or a parameter file"),
    "params_file": ("", "parameter file that is read last and wins"),
    "directory": ("", "directory of the bag; must not exist; empty: flights/<time>"),
    "namespace": ("", "namespace of the vehicle"),
    "use_sim_time": ("false", "passed to every node; no control decision depends on it"),
    "simulate": ("true", "false: something else owns the vehicle, the simulator is not started"),
}


def nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes that the launch arguments ask for; raises ParameterError for an unknown name."""
    told = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    parameters = [
        str(configuration.find(configuration.VEHICLES, told["vehicle"])),
        str(configuration.find(configuration.CONTROLLERS, told["preset"])),
        str(configuration.find(configuration.SCENARIOS, told["case"])),
        *([told["params_file"]] if told["params_file"] else []),
        {"use_sim_time": told["use_sim_time"].lower() == "true"},
    ]
    roles = [role for role in ROLES if role != "simulator" or told["simulate"].lower() == "true"]
    return [
        Node(
            package=PACKAGES[role],
            executable=role,
            name=role,
            namespace=told["namespace"],
            parameters=[*parameters, *([{"directory": told["directory"]}] if role == "recorder" else [])],
            output="screen",
        )
        for role in roles
    ]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, once they are known, the nodes."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
