"""A ROS domain of its own for each flight, so that flights at the same time do not meet."""

import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from quad_core.ownership import check_file, private_folder
from quad_core.parameters import ParameterError

# Above 101 the ports of the default transport may collide with ephemeral ones; 0 is where everybody else is.
DOMAINS = range(1, 102)
LAST_DOMAIN = 232  # the middleware crashes beyond
_FIRST_PORT, _PORTS_EACH = 7400, 250
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
            os.close(lock)
        return
    asked = f"domain {requested}" if requested is not None else f"every domain of {DOMAINS.start} to {DOMAINS.stop - 1}"
    raise ParameterError(f"--domain: {asked} is reserved by another flight")


def _candidates() -> list[int]:
    # In random order: the graph of a domain shows a killed node for some 20 s. Domains that others use come last.
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
    """Return the domains in which a process of this machine has a UDP port, by the numbers of DDSI-RTPS 2.2, 9.6.1.1.

    Shared memory is not looked at: nodes of a flight do not use it.
    """
    try:
        lines = _UDP_SOCKETS.read_text().splitlines()[1:]
    except OSError:  # a system without it
        return set()
    found = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
    return {(port - _FIRST_PORT) // _PORTS_EACH for port in found if port >= _FIRST_PORT}


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
