"""A ROS domain of its own for each flight, so that flights at the same time do not meet."""

import fcntl
import os
import random
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from quad_core.ownership import check_file, private_folder
from quad_core.parameters import ParameterError
from quad_node import ports

# Above 101 the ports of the default transport may collide with ephemeral ones; 0 is where everybody else is.
DOMAINS = range(1, 102)
LAST_DOMAIN = 232  # the middleware crashes beyond
_SHARED_MEMORY = Path("/dev/shm")
_UDP_SOCKETS = Path("/proc/net/udp")
_RUNTIME = Path("/run/user")  # also of shells where XDG_RUNTIME_DIR is not set: all must find the same locks


@contextmanager
def reserved_domain(requested: int | None) -> Iterator[int]:
    """Hold a domain for the time of a flight.

    ``requested``: exactly this one, shared with other flights that want it too (namespaces tell them apart). None: one
    that no other flight holds, ROS_DOMAIN_ID if that is set and free. Raises ParameterError if there is none.
    """
    if requested is not None and not 0 <= requested <= LAST_DOMAIN:
        raise ParameterError(f"--domain: found {requested}, expected 0 to {LAST_DOMAIN}")
    folder = _lock_folder()
    for domain in [requested] if requested is not None else _candidates():
        lock = _open(folder / f"domain-{domain}.lock")
        try:
            fcntl.flock(lock, (fcntl.LOCK_EX if requested is None else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            continue
        try:
            yield domain
        finally:
            if requested is None:
                remove_abandoned_ports(domain)
            os.close(lock)
        return
    asked = f"domain {requested}" if requested is not None else f"every domain of {DOMAINS.start} to {DOMAINS.stop - 1}"
    raise ParameterError(f"--domain: {asked} is reserved by another flight")


def _candidates() -> list[int]:
    # In random order: nodes that were killed haunt their domain for some 20 s. Domains that others use come last.
    in_use = occupied()
    order = random.SystemRandom().sample(DOMAINS, len(DOMAINS))
    order.sort(key=in_use.__contains__)
    preset = os.environ.get("ROS_DOMAIN_ID", "")
    if not preset:
        return order
    if not preset.isdecimal() or int(preset) > LAST_DOMAIN:
        raise ParameterError(f"ROS_DOMAIN_ID: found {preset!r}, expected 0 to {LAST_DOMAIN}")
    return [int(preset), *order]


def occupied() -> set[int]:
    """Return the domains in which Fast DDS has (or left) ports in shared memory, or somebody has those of UDP."""
    named = (re.match(r"fast(?:rtps|dds)_port(\d+)", path.name) for path in _SHARED_MEMORY.glob("fast*_port*"))
    found = [int(port[1]) for port in named if port]
    with suppress(OSError):  # a system without it
        found += [int(line.split()[1].rpartition(":")[2], 16) for line in _UDP_SOCKETS.read_text().splitlines()[1:]]
    return {domain for port in found if (domain := ports.domain_of(port)) is not None}


def remove_abandoned_ports(domain: int) -> None:
    """Remove from shared memory what participants that are gone left of a domain that nobody else holds.

    Fast DDS leaves a port behind when a participant leaves while another sends to it, and all that a killed process
    had: its ports, and the segment of 0.5 MB that it sent through. Who lives holds the lock file beside each.
    """
    for path in _SHARED_MEMORY.glob("fastrtps_*"):
        port = re.fullmatch(r"fastrtps_port(\d+)", path.name)
        locks = [path.with_name(path.name + suffix) for suffix in ("_el", "_sl")]
        if port:
            abandoned = ports.domain_of(int(port[1])) == domain and not any(map(_is_held, locks))
        else:
            # a segment appears after its lock was taken, so a free lock beside one is that of a dead process
            abandoned = bool(re.fullmatch(r"fastrtps_[0-9a-f]+", path.name)) and _is_free(locks[0])
        if abandoned:
            for left in (path, *locks, path.with_name(f"sem.{path.name}_mutex")):
                with suppress(OSError):
                    left.unlink()


def _is_held(lock: Path) -> bool:
    """Return whether a lock file is there and somebody holds it; one that we may not open counts as held."""
    return lock.exists() and not _is_free(lock)


def _is_free(lock: Path) -> bool:
    """Return whether a lock file is there and nobody holds it."""
    try:
        opened = os.open(lock, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(opened)
    return True


def _lock_folder() -> Path:
    """Return a folder of this user alone. Flights of another user avoid the domains in which ours have ports."""
    runtime = _RUNTIME / str(os.geteuid())
    return private_folder(runtime / "quad" if runtime.is_dir() else Path(tempfile.gettempdir(), f"quad-{os.geteuid()}"))


def _open(path: Path) -> int:
    lock = os.open(path, os.O_RDONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        check_file(path)
    except OSError:
        os.close(lock)
        raise
    return lock
