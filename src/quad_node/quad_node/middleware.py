"""Who can see and reach a node: closed unless asked, whatever started it."""

import os
from collections.abc import Mapping, MutableMapping
from pathlib import Path

TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
THEIR_PROFILES = "FASTDDS_DEFAULT_PROFILES_FILE"
# Settings of Fast DDS for what FASTDDS_BUILTIN_TRANSPORTS chooses; any other choice has those of fastdds.xml.
_PROFILES = {"": "fastdds_shm_udp.xml", "DEFAULT": "fastdds_shm_udp.xml"}
_ANY_PROFILE = "fastdds.xml"
# Where SHM is chosen, by us or by the user; who flies in real time has the second one (decision 109).
_CLOSED = {False: "fastdds_local.xml", True: "fastdds_loopback.xml"}
RMW = "RMW_IMPLEMENTATION"
FAST_DDS = "rmw_fastrtps_cpp"
# Whoever has set one of these has chosen how the nodes find each other.
_CHOICES = (
    TRANSPORTS, RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER",
    PROFILES, THEIR_PROFILES,
)  # fmt: skip
_LOCAL = ("LOCALHOST", "OFF", "1")
OPEN = "OPEN TO OTHER HOSTS OR USERS"


def profiles(environment: Mapping[str, str], is_realtime: bool = False) -> str:
    """Return the path of our settings of Fast DDS that fit what ``environment`` chooses."""
    transports = environment.get(TRANSPORTS, "")
    both = transports and environment.get(RANGE)  # the range brings back transports that were not chosen
    name = _ANY_PROFILE if both else {**_PROFILES, "SHM": _CLOSED[is_realtime]}.get(transports, _ANY_PROFILE)
    return str(Path(__file__).resolve().with_name(name))


def _is_ours(path: str) -> bool:
    """Return whether ``path`` names settings of ours, of this checkout or another."""
    ours = {*_CLOSED.values(), *_PROFILES.values(), _ANY_PROFILE}
    return Path(path).parent.name == "quad_node" and Path(path).name in ours


def close_unless_asked(environment: MutableMapping[str, str] = os.environ, is_realtime: bool = False) -> str:
    """Choose this machine alone where nothing is chosen, before rclpy starts; returns who can see the node.

    Settings of Fast DDS are ours unless the user names some; ``is_realtime``: those of who flies in real time.
    The line begins with ``OPEN`` where others than processes of this machine may join.
    """
    rmw = environment.get(RMW) or FAST_DDS
    if rmw != FAST_DDS:
        return f"{OPEN}: {rmw} has its own settings"
    if _is_ours(environment.get(PROFILES, "")):
        del environment[PROFILES]
    chosen = [name for name in _CHOICES if environment.get(name)]
    if not chosen:
        environment[TRANSPORTS] = "SHM"
        chosen = [TRANSPORTS]
    if not {PROFILES, THEIR_PROFILES} & set(chosen):
        environment[PROFILES] = profiles(environment, is_realtime)
    domain = f"ROS_DOMAIN_ID={environment.get('ROS_DOMAIN_ID') or 0}"
    if chosen == [TRANSPORTS] and environment[TRANSPORTS] == "SHM":
        settings = f"{TRANSPORTS}=SHM {PROFILES}={profiles(environment)}"
        return f"seen only on this machine: export {settings} {domain}; unset {RANGE}"
    if set(chosen) <= {RANGE, "ROS_LOCALHOST_ONLY"} and all(environment[name] in _LOCAL for name in chosen):
        return f"open to this machine: seen by shells with: export {RANGE}=LOCALHOST {domain}; unset {TRANSPORTS}"
    return f"{OPEN}: {', '.join(f'{name}={environment[name]}' for name in chosen)}"
