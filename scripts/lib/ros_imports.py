"""Which of our sources need a ROS 2: the tests that need one take turns, the API pages leave such modules out."""

import re

_IMPORT = re.compile(
    r"^\s*(?:import|from) (?:rclpy|quad_node|quad_[\w.]+\.node|\w+_msgs|\w+_interfaces)\b", re.MULTILINE
)


def imports_ros(source: str) -> bool:
    """Return whether a module's text imports ROS."""
    return _IMPORT.search(source) is not None
