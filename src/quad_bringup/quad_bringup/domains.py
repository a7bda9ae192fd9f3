"""A ROS domain of its own for each flight, so that flights at the same time do not meet."""

import fcntl
import os
import random
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from quad_core.parameters import ParameterError

# Above 101 the ports of the default transport may collide with ephemeral ones; 0 is where everybody else is.
DOMAINS = range(1, 102)
LAST_DOMAIN = 232  # the middleware crashes beyond
_SHARED_MEMORY = Path("/dev/shm")


@contextmanager
def reserved_domain(wanted: int | None) -> Iterator[int]:
    """Hold a domain for the time of a flight.

    ``wanted``: exactly this one, shared with other flights that want it too (namespaces tell them apart). None: one
    that no other flight holds, ROS_DOMAIN_ID if that is set and free. Raises ParameterError if there is none.
    """
    if wanted is not None and not 0 <= wanted <= LAST_DOMAIN:
        raise ParameterError(f"--domain: found {wanted}, expected 0 to {LAST_DOMAIN}")
    for domain in [wanted] if wanted is not None else _candidates():
        lock = _open(Path(tempfile.gettempdir(), f"quad-domain-{domain}.lock"))
        try:
            fcntl.flock(lock, (fcntl.LOCK_EX if wanted is None else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            continue
        try:
            yield domain
        finally:
            os.close(lock)
        return
    asked = f"domain {wanted}" if wanted is not None else f"every domain of {DOMAINS.start} to {DOMAINS.stop - 1}"
    raise ParameterError(f"--domain: {asked} is held by another flight")


def _candidates() -> list[int]:
    # In random order: nodes that were killed haunt their domain for some 20 s. Domains that others use come last.
    occupied = _occupied()
    order = random.SystemRandom().sample(DOMAINS, len(DOMAINS))
    order.sort(key=occupied.__contains__)
    preset = os.environ.get("ROS_DOMAIN_ID", "")
    if not preset:
        return order
    if not preset.isdecimal() or int(preset) > LAST_DOMAIN:
        raise ParameterError(f"ROS_DOMAIN_ID: found {preset!r}, expected 0 to {LAST_DOMAIN}")
    return [int(preset), *order]


def _occupied() -> set[int]:
    """Return the domains in which Fast DDS has (or left) shared-memory ports: 7400 + 250 per domain."""
    ports = (re.match(r"fast(?:rtps|dds)_port(\d+)", path.name) for path in _SHARED_MEMORY.glob("fast*_port*"))
    return {(int(port[1]) - 7400) // 250 for port in ports if port}


def _open(path: Path) -> int:
    try:
        return os.open(path, os.O_RDONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except PermissionError:
        # Another user's lock in a sticky directory: it can be locked, but not opened with O_CREAT.
        return os.open(path, os.O_RDONLY | os.O_CLOEXEC)
