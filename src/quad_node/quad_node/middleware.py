"""Who can see and reach a node: closed unless asked, whatever started it."""

import os
from collections.abc import MutableMapping
from pathlib import Path

TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
OUR_PROFILES = str(Path(__file__).resolve().with_name("fastdds.xml"))
RMW = "RMW_IMPLEMENTATION"
FAST_DDS = "rmw_fastrtps_cpp"
# Whoever has set one of these has chosen how the nodes find each other.
_CHOICES = (
    TRANSPORTS, RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER",
    PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE",
)  # fmt: skip
_LOCAL = ("LOCALHOST", "OFF", "1")
OPEN = "OPEN TO OTHER HOSTS OR USERS"


def close_unless_asked(environment: MutableMapping[str, str] = os.environ) -> str:
    """Choose shared memory alone where nothing is chosen, before rclpy starts; returns who can see the node.

    The line begins with ``OPEN`` where others than this user's processes on this machine may join.
    """
    rmw = environment.get(RMW) or FAST_DDS
    if rmw != FAST_DDS:
        return f"{OPEN}: {rmw} has its own settings"
    chosen = [name for name in _CHOICES if environment.get(name) not in (None, "", OUR_PROFILES)]
    if not chosen:
        environment[TRANSPORTS] = "SHM"
        chosen = [TRANSPORTS]
    domain = f"ROS_DOMAIN_ID={environment.get('ROS_DOMAIN_ID') or 0}"
    if chosen == [TRANSPORTS] and environment[TRANSPORTS] == "SHM":
        return f"seen only by shells of this user with: export {TRANSPORTS}=SHM {domain}; unset {RANGE}"
    if set(chosen) <= {RANGE, "ROS_LOCALHOST_ONLY"} and all(environment[name] in _LOCAL for name in chosen):
        return f"open to this machine: seen by shells with: export {RANGE}=LOCALHOST {domain}; unset {TRANSPORTS}"
    return f"{OPEN}: {', '.join(f'{name}={environment[name]}' for name in chosen)}"
