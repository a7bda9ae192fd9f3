"""What a flight checks before it starts: other nodes in its domain, free disk, a folder for ROS's logs."""

import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from quad_bringup.domains import occupied
from quad_core.parameters import ParameterError
from quad_node.middleware import RANGE, TRANSPORTS, choices

MEETING = 5.0  # s in which two nodes find each other, where a server tells them
DISCOVERY = 1.0  # s; twelve nodes find each other in 0.5 s
LEAST_DISK, FULL_DISK = 8_000_000, 65_536  # bytes; 20 s of flight; less than two chunks of a bag


def how_to_look_on(domain: int) -> str:
    """Return the line that makes a flight's nodes visible to ``ros2`` in another shell."""
    root = os.environ.get("QUAD_ROOT", "")
    chosen = "".join(f" {name}={value}" for name, value in choices(os.environ).items())
    if root and not chosen:
        return f"to look on from another shell: source {root}/scripts/env.sh; export ROS_DOMAIN_ID={domain}"
    unset = " ".join(name for name in (TRANSPORTS, RANGE) if name not in chosen)
    return f"to look on from another shell: unset {unset}; export ROS_DOMAIN_ID={domain}{chosen}"


def check_disk(directory: Path) -> None:
    """Raise ParameterError if a flight could not be recorded in ``directory``, which exists."""
    free = shutil.disk_usage(directory).free
    if free < LEAST_DISK:
        raise ParameterError(
            f"{directory}: found {free / 1e6:.1f} MB free, expected at least {LEAST_DISK / 1e6:.0f} MB"
        )


def is_full(directory: Path) -> bool:
    """Return whether nothing more can be written in ``directory``."""
    return directory.is_dir() and shutil.disk_usage(directory).free < FULL_DISK


def find_room_for_logs() -> str:
    """See that ROS has a folder for its logs, without which no node starts; returns what was done about it, if any.

    Raises ParameterError if the user has chosen one that cannot be written.
    """
    chosen = os.environ.get("ROS_LOG_DIR", "")
    home = os.environ.get("ROS_HOME") or Path(os.environ.get("HOME") or "/", ".ros")
    folder = Path(chosen or Path(home, "log")).expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        if chosen:
            found = f"ROS_LOG_DIR: found {chosen!r}, {error.strerror}"
            raise ParameterError(f"{found}, expected a folder that can be written") from error
        other = tempfile.mkdtemp(prefix="quad-ros-log-")
        os.environ["ROS_LOG_DIR"] = other
        return f"{folder}: {error.strerror}; ROS's logs go to {other}"


@contextmanager
def _probe(domain: int, namespace: str = "") -> Iterator[Any]:
    """Give a node that looks around in ``domain``, a participant of its own."""
    import rclpy
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = Node(
        "flight_probe", context=context, namespace=namespace, enable_rosout=False, start_parameter_services=False
    )
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def check_discovery(domain: int, chosen: str) -> None:
    """Raise ParameterError if two nodes of this shell do not find each other; ``chosen``: its settings of discovery."""
    from std_msgs.msg import Empty

    with _probe(domain) as sender, _probe(domain) as receiver:
        publisher = sender.create_publisher(Empty, "flight_probe", 1)
        receiver.create_subscription(Empty, "flight_probe", lambda _: None, 1)
        deadline = time.monotonic() + MEETING
        while not publisher.get_subscription_count():
            if time.monotonic() > deadline:
                missed = f"two nodes of this shell did not find each other within {MEETING:g} s"
                raise ParameterError(f"{chosen}: {missed}: unset it, or start what it names")
            time.sleep(0.05)


def check_domain(domain: int, namespace: str) -> None:
    """Raise ParameterError if another node in ``domain`` publishes a topic of this flight."""
    others = publishers(domain, namespace) if may_hold_others(domain) else {}
    if others:
        listed = "; ".join(f"{node} publishes {shortened(names)}" for node, names in sorted(others.items()))
        raise ParameterError(
            f"--domain: domain {domain} is not empty: {listed}. End them, or choose another --domain or --namespace"
        )


def shortened(names: list[str]) -> str:
    """Return the first of ``names`` and how many more there are."""
    return names[0] + (f" and {len(names) - 1} more" if len(names) > 1 else "")


def may_hold_others(domain: int) -> bool:
    """Return whether a search is worth its time: a closed flight meets only processes that have a port here."""
    return bool(choices(os.environ)) or domain in occupied()


def publishers(domain: int, namespace: str, patience: float = DISCOVERY) -> dict[str, list[str]]:
    """Return {node: topics} of all that publish a topic of a flight in ``namespace``, looking for ``patience`` s.

    No node of a flight reads its clock, so another publisher of one does no harm.
    """
    from quad_node.topics import TOPICS

    names, found = [name for name in TOPICS if name != "clock"], dict[str, list[str]]()
    deadline = time.monotonic() + patience
    with _probe(domain, namespace) as probe:
        # A publisher may be known a moment before the name of its node is.
        while (not found or any("UNKNOWN" in node for node in found)) and time.monotonic() < deadline:
            time.sleep(0.1)
            found = _publishers(probe, names)
    return found


def _publishers(probe: Any, names: list[str]) -> dict[str, list[str]]:
    """Return {node: topics} of those that publish the relative ``names`` in the namespace of ``probe``."""
    found: dict[str, list[str]] = {}
    for name in names:
        for info in probe.get_publishers_info_by_topic(f"{probe.get_namespace().rstrip('/')}/{name}"):
            node = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            if name not in found.setdefault(node, []):
                found[node].append(name)
    return found
