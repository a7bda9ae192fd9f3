"""Which processes can see and reach a node: those of this machine, unless the user has chosen otherwise.

Every node uses UDP on the loopback interface (``fastdds.xml``, explained in ``docs/explanation/fast_dds.md``).
"""

import os
from collections.abc import Mapping, MutableMapping
from pathlib import Path

from quad_core.parameters import ParameterError

TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
SETTINGS = str(Path(__file__).resolve().with_name("fastdds.xml"))
SKIP = "SKIP_DEFAULT_XML_FILE"  # set: DEFAULT_FASTRTPS_PROFILES.xml in the working folder is not loaded
RMW = "RMW_IMPLEMENTATION"
FAST_DDS = "rmw_fastrtps_cpp"
OPEN = "OPEN TO OTHER HOSTS OR USERS"
CLOSED = "seen only on this machine"
DOMAIN = "ROS_DOMAIN_ID"
LAST_DOMAIN = 232  # Fast DDS ends the process beyond, with exit code 1

# Values that ask for no more than this machine. rmw_fastrtps reads each as a wish for its own transports, shared memory
# among them, and then ignores those of the profile; so they are removed.
_THIS_MACHINE = {TRANSPORTS: ("SHM",), RANGE: ("LOCALHOST", "OFF"), "ROS_LOCALHOST_ONLY": ("1",)}
_CHOICES = (*_THIS_MACHINE, "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE")


def choices(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables by which the user has chosen how nodes find each other, beyond this machine."""
    found = {name: environment[name] for name in _CHOICES if environment.get(name)}
    ours = Path(found.get(PROFILES, "")).parts[-2:] == ("quad_node", Path(SETTINGS).name)  # of any checkout
    return {
        name: value
        for name, value in found.items()
        if value not in _THIS_MACHINE.get(name, ()) and not (name == PROFILES and ours)
    }


def checked_domain(name: str, domain: str | int) -> int:
    """Return ``domain``, given as ``name``, as a number; raises ParameterError if it is no domain."""
    if not str(domain).isdecimal() or int(domain) > LAST_DOMAIN:
        raise ParameterError(f"{name}: found {domain}, expected 0 to {LAST_DOMAIN}")
    return int(domain)


def close(environment: MutableMapping[str, str] = os.environ) -> str:
    """Choose this machine, whatever the user has chosen; returns the line that says which shells see the nodes."""
    for name in _CHOICES:
        environment.pop(name, None)
    environment.update({PROFILES: SETTINGS, SKIP: "1"})
    return f"{CLOSED}: export {DOMAIN}={environment.get(DOMAIN) or 0}; unset {TRANSPORTS}"


def close_unless_asked(environment: MutableMapping[str, str] = os.environ) -> str:
    """Choose this machine if the user has chosen nothing else; called before rclpy starts.

    Returns a line that says who can see the nodes. It begins with ``OPEN`` if other hosts or users may join.
    Raises ParameterError for a ROS_DOMAIN_ID that is no domain.
    """
    checked_domain(DOMAIN, environment.get(DOMAIN) or 0)
    rmw = environment.get(RMW) or FAST_DDS
    if rmw != FAST_DDS:
        return f"{OPEN}: {rmw} has its own settings"
    chosen = choices(environment)
    if chosen:
        if PROFILES not in chosen:
            environment.pop(PROFILES, None)  # ours, of scripts/env.sh
            environment.pop(SKIP, None)
        return f"{OPEN}: {', '.join(f'{name}={value}' for name, value in chosen.items())}"
    return close(environment)
