"""What a flight checks before it starts: other nodes in its domain, free disk, discovery."""

import os
import random
import shlex
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from domain_coordinator import domain_id

from quad_core.parameters import ParameterError
from quad_node.middleware import DOMAIN, RANGE, TRANSPORTS, checked_domain, choices
from quad_node.watch import node_of_its_own

# Above 101 the ports of the default transport may collide with ephemeral ones; 0 is the default of all other nodes.
DOMAINS = range(1, 102)
_FIRST_PORT, _PORTS_EACH = 7400, 250
_UDP_SOCKETS = Path("/proc/net/udp")


@contextmanager
def reserved_domain(requested: int | None) -> Iterator[int]:
    """Hold a domain for the time of a flight; flights of every user of this machine avoid it.

    ``requested``, else ROS_DOMAIN_ID where it is set: exactly this one, which other flights may want too (namespaces
    tell them apart). Raises ParameterError if no domain is free.
    """
    for name, chosen in (("--domain", requested), (DOMAIN, os.environ.get(DOMAIN) or None)):
        if chosen is not None:
            yield checked_domain(name, chosen)
            return
    reservation = domain_id(iter(_candidates()).__next__)
    try:
        domain = reservation.__enter__()
    except RuntimeError as error:
        raise ParameterError("--domain: found every domain reserved by another flight, expected a free one") from error
    try:
        yield domain
    finally:  # it would take an OSError of the flight for a domain that is not free
        reservation.__exit__(None, None, None)


def _candidates() -> list[int]:
    # In random order: the graph of a domain shows a killed node for some 20 s. Domains that others use come last.
    order = random.SystemRandom().sample(DOMAINS, len(DOMAINS))
    return sorted(order, key=occupied().__contains__)


def occupied() -> set[int]:
    """Return the domains in which a process of this machine has a UDP port, by the numbers of DDSI-RTPS 2.2, 9.6.1.1.

    Shared memory is not looked at: nodes of a flight do not use it.
    """
    try:
        lines = _UDP_SOCKETS.read_text().splitlines()[1:]
    except OSError:  # a system without it
        return set()
    found = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
    return {(port - _FIRST_PORT) // _PORTS_EACH for port in found if port >= _FIRST_PORT}


PROBE = "flight_probe"
MEETING = 5.0  # s in which two nodes find each other, where a server tells them
DISCOVERY = 1.0  # s; twelve nodes find each other in 0.5 s
LEAST_DISK, MISSION_DISK = 8_000_000, 1_000_000_000  # bytes; 20 s of flight; what a mission may take
OF_OTHERS = ("clock", "battery_state", "flight/request")
FULL_DISK = 65_536  # bytes; less than two chunks of a bag


def how_to_look_on(domain: int) -> str:
    """Return the line that makes a flight's nodes visible to ``ros2`` in another shell."""
    root = os.environ.get("QUAD_ROOT", "")
    chosen = "".join(f" {name}={value}" for name, value in choices(os.environ).items())
    if root and not chosen:
        source = shlex.quote(f"{root}/scripts/env.sh")
        return f"to look on from another shell: source {source}; export ROS_DOMAIN_ID={domain}"
    unset = " ".join(name for name in (TRANSPORTS, RANGE) if name not in chosen)
    return f"to look on from another shell: unset {unset}; export ROS_DOMAIN_ID={domain}{chosen}"


def check_loopback() -> None:
    """Raise ParameterError if this machine cannot send itself a datagram: all nodes of a flight do."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.settimeout(1.0)
            probe.bind(("127.0.0.1", 0))
            probe.sendto(b"", probe.getsockname())
            probe.recv(1)
    except OSError as error:
        why = f"127.0.0.1 cannot be used ({error.strerror or error})"
        raise ParameterError(f"{why}: is the interface lo down? expected it up: ip link set lo up") from error


def refusal_of_ros(domain: int, error: Exception) -> ParameterError:
    """Return why ROS 2 does not start in ``domain``, with what this shell asks of it: rcl itself does not say it."""
    asked = {name: value for name, value in os.environ.items() if name.startswith("ROS_SECURITY_")}
    named = "".join(f"; {name}={value}" for name, value in {**asked, **choices(os.environ)}.items())
    hint = "; without its keys, or with wheels, which lack DDS-Security, unset ROS_SECURITY_ENABLE" if asked else ""
    return ParameterError(f"ROS 2 cannot start in domain {domain}: {' '.join(str(error).split())}{named}{hint}")


def check_disk(directory: Path, least: int = LEAST_DISK) -> None:
    """Raise ParameterError if ``directory``, which exists, has less than ``least`` bytes for a flight's record."""
    free = shutil.disk_usage(directory).free
    if free < least:
        raise ParameterError(f"{directory}: found {free / 1e6:.1f} MB free, expected at least {least / 1e6:.0f} MB")


def is_full(directory: Path) -> bool:
    """Return whether nothing more can be written in ``directory``."""
    return directory.is_dir() and shutil.disk_usage(directory).free < FULL_DISK


@contextmanager
def _probe(domain: int, namespace: str = "") -> Iterator[Any]:
    """Give a node that looks around in ``domain``, a participant of its own."""
    node = node_of_its_own(PROBE, domain, namespace)
    try:
        yield node
    finally:
        node.destroy_node()
        node.context.try_shutdown()


def check_discovery(domain: int, chosen: str) -> None:
    """Raise ParameterError if two nodes of this shell do not find each other; ``chosen``: its settings of discovery."""
    if os.environ.get(RANGE) == "OFF":
        chosen += f", {RANGE}=OFF"
    with _probe(domain) as one, _probe(domain):
        deadline = time.monotonic() + MEETING
        while one.get_node_names().count(PROBE) < 2:
            if time.monotonic() > deadline:
                missed = f"two nodes of this shell did not find each other within {MEETING:g} s"
                raise ParameterError(f"{chosen}: {missed}: unset it, or start what it names")
            time.sleep(0.05)


def check_domain(domain: int, namespace: str) -> None:
    """Raise ParameterError if another node in ``domain`` publishes a topic of this flight."""
    # a closed flight meets only processes that have a port here: else a search is not worth its time
    others = publishers(domain, namespace) if choices(os.environ) or domain in occupied() else {}
    if others:
        listed = "; ".join(
            f"{node} publishes {names[0]}" + (f" and {len(names) - 1} more" if len(names) > 1 else "")
            for node, names in sorted(others.items())
        )
        found = f"--domain: domain {domain} is not empty: {listed}"
        raise ParameterError(f"{found}. End them, or choose another --domain or --namespace")


def publishers(domain: int, namespace: str, patience: float = DISCOVERY) -> dict[str, list[str]]:
    """Return {node: topics} of all that publish a topic of a flight in ``namespace``, looking for ``patience`` s.

    Left out is what others may publish before a flight: a battery's driver, an operator's panel, and a clock, which no
    node of a flight reads.
    """
    from quad_node.topics import TOPICS

    topics, found = [name for name in TOPICS if name not in OF_OTHERS], dict[str, list[str]]()
    deadline = time.monotonic() + patience
    with _probe(domain, namespace) as probe:
        # A publisher may be known a moment before the name of its node is.
        while (not found or any("UNKNOWN" in node for node in found)) and time.monotonic() < deadline:
            time.sleep(0.1)
            found = {}
            for topic in topics:
                for info in probe.get_publishers_info_by_topic(probe.resolve_topic_name(topic)):
                    found.setdefault(f"{info.node_namespace.rstrip('/')}/{info.node_name}", []).append(topic)
    return found
