"""The nodes of a flight: whether they fit together, and which one a flight in lockstep waits for. No ROS calls."""

import hashlib
import json
import platform
import zlib
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ament_index_python.packages import get_package_share_directory

from quad_core.cascade import ALL_ROLES, COMMAND, COMMANDER, COMMANDING, RELAY, SHADOWS, SIGNALS, STAGES, TRAJECTORY
from quad_core.enumerations import NodeState
from quad_core.flight_parameters import FlightParameters
from quad_msgs.msg import NodeStatus

_MOST_OTHERS = 5  # nodes of others that a reason names
LONGEST_FLIGHT = 200_000  # s, twice what a trajectory's duration may be
_TAKEN = (
    *((stage.role, taken.topic) for stage in STAGES for taken in stage.inputs),
    (TRAJECTORY, "flight/mode"),
    (COMMANDER, "mission/reference"),
)


def run_number(run_id: str) -> int:
    """Return what stands for a run in the field ``run`` of messages: CRC-32 of its id, 0 without one."""
    return zlib.crc32(run_id.encode())


def is_foreign(run: int, ours: int) -> bool:
    """Return whether a message with the number ``run`` is not of the run ``ours``: 0 belongs to no run.

    A flight without a run id, as of nodes started by hand, cannot tell and takes every one.
    """
    return ours not in (0, run)


def plan_refusal(end_step: int, planned: int, plant_period: int) -> str:
    """Return why a plan that ends at ``end_step`` is refused, empty if it is not.

    ``planned`` is the end of the plan that is flown, 0 before the first; ``plant_period`` in ns.
    """
    longest = LONGEST_FLIGHT * 1_000_000_000 // plant_period
    if not 0 < end_step <= longest:
        return f"end_step {end_step}, expected 1 to {longest}"
    if planned and end_step != planned:
        return f"a second plan with end_step {end_step}, expected the first one's, {planned}"
    return ""


class Handshake:
    """Collects the status of every expected role: ``known`` has the last one of each that was received."""

    def __init__(self, flight: FlightParameters, interface_hash: str, expected: list[str]) -> None:
        self._flight, self._hash, self._expected = flight, interface_hash, expected
        self._run = run_number(flight.run_id)
        self.known: dict[str, NodeStatus] = {}
        self._others: dict[str, str] = {}  # what else was heard on flight/nodes, by node

    def on_status(self, status: NodeStatus) -> str:
        """Take in a status; returns what makes a flight with that node impossible, empty if nothing."""
        if is_foreign(run_number(status.run_id), self._run):
            self._note_other(status, f"run_id {status.run_id!r}, expected {self._flight.run_id!r}")
            return ""
        if status.role not in self._expected:
            if status.role not in ALL_ROLES:
                self._note_other(status, f"role {status.role!r}, expected one of {', '.join(self._expected)}")
            return ""
        if status.period_steps < 1:
            return f"flight/nodes: {status.role} has period_steps {status.period_steps}, expected at least 1"
        self.known[status.role] = status
        if status.interface_hash != self._hash:
            return (
                f"flight/nodes: {status.role} was built with other quad_msgs: "
                f"found {status.interface_hash[:12]}, expected {self._hash[:12]}"
            )
        if status.plant_period != self._flight.plant_period:
            return (
                f"flight/nodes: {status.role} has flight.plant_period {status.plant_period} ns, "
                f"expected {self._flight.plant_period} ns"
            )
        if status.state == NodeState.FAULT and status.role not in SHADOWS:
            return f"{status.role} failed: {status.detail}"
        return self._misfit()

    def _note_other(self, status: NodeStatus, what: str) -> None:
        if len(self._others) < _MOST_OTHERS:
            self._others[status.node] = what

    def _misfit(self) -> str:
        """Return which stage would wait for ever, because its period and that of its input do not divide."""
        for role, topic in _TAKEN:
            commanded = topic == "reference" and COMMANDER in self.known
            publisher = COMMANDER if commanded else SIGNALS[topic].publisher
            if role in self.known and publisher in self.known:
                given, taken = self.known[publisher].period_steps, self.known[role].period_steps
                if given % taken and taken % given:
                    return (
                        f"flight/nodes: {role} answers every {taken} plant steps and takes {topic}, which "
                        f"{publisher} gives every {given}; expected one to be a multiple of the other"
                    )
        return ""

    def missing(self) -> list[str]:
        """Return the expected roles that are not ready, and what those wait for that said so."""
        said = {role: self.known[role].detail for role in self._expected if role in self.known}
        late = [role for role in self._expected if role not in said or self.known[role].state != NodeState.READY]
        return [f"{role} ({said[role]})" if said.get(role) else role for role in late]

    def foreign_nodes(self) -> str:
        """Return what nodes of other flights have published, a clause for the reason why this one did not begin."""
        return "".join(f"; flight/nodes of {node} has {what}" for node, what in sorted(self._others.items()))

    def period(self, role: str) -> int:
        """Return the period of ``role`` in plant steps, 1 if it takes no part."""
        return self.known[role].period_steps if role in self.known else 1

    def behind(self, step: int) -> str:
        """Return which node has not answered what is due at ``step``, the first in the order of the cascade.

        The plant stands at ``step``, and each node that lives has published its last step since.
        """
        commanded = COMMANDER in self.known
        for role in (COMMANDER if commanded else TRAJECTORY, *(stage.role for stage in STAGES)):
            status = self.known.get(role)
            if status is not None and status.step < step // status.period_steps * status.period_steps:
                return f"{role} does not answer step {step}"
        return ""

    def blame(self, step: int, acked: int, answered: bool, planned: bool) -> str:
        """Return which topic step ``step`` waits for, and whose it is.

        ``answered``: the plant has the command of that step; ``planned``: it has the plan, or the commander's mode.
        """
        if not planned:
            commanded = COMMANDER in self._expected
            role, topic = (COMMANDER, "flight/mode") if commanded else (TRAJECTORY, "flight/plan")
            return f"{role} does not answer step {step}: no {topic}"
        if not answered:
            through = f"; its states come through {RELAY}" if RELAY in self._expected else ""
            return f"{COMMANDING} does not answer step {step}: no {COMMAND}{through}"
        return f"recorder does not answer: flight/recorded is at step {acked}, the plant at {step}"


@cache
def interface_hash() -> str:
    """Return SHA-256 (hex) over name and RIHS01 hash of every message of quad_msgs, sorted by name."""
    digest = hashlib.sha256()
    for path in sorted(Path(get_package_share_directory("quad_msgs"), "msg").glob("*.json")):
        for entry in json.loads(path.read_text(encoding="utf-8"))["type_hashes"]:
            digest.update(f"{entry['type_name']} {entry['hash_string']}\n".encode())
    return digest.hexdigest()


def versions() -> dict[str, str]:
    """Return the versions that decide the bits of a flight."""
    found = {"python": platform.python_version(), "machine": platform.machine(), "libc": " ".join(platform.libc_ver())}
    for name, package in (
        ("quad_stack", "quad_node"),
        ("rclpy", "ros-rclpy"),
        ("rclpy", "rclpy"),
        ("numpy", "numpy"),
        ("mcap", "mcap"),
    ):
        with suppress(PackageNotFoundError):  # rclpy has its own name where it is no wheel
            found.setdefault(name, version(package))
    return found
