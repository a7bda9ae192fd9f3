"""A newcomer does not take the place of a process that died.

Fast DDS numbers the queues of its readers in shared memory, and gives a newcomer the first number whose lock is free:
in flight, that of a node which was killed. The newcomer opens a new queue under the old name, but whoever has written
to the old one goes on writing there, so nobody would ever reach it (decision 103).
"""

import fcntl
import os
import re
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import rclpy

_SHARED_MEMORY = Path("/dev/shm")
_FIRST_PORT, _PORTS = 7400, 250
"""Of domain 0, and how many each domain has."""

_YOUNG = 1.0
"""s: who is just starting may have made its lock file and not locked it yet."""


@contextmanager
def apart_from_the_dead(domain: int | None = None) -> Iterator[None]:
    """Let a participant that is made inside take no queue of a dead process in ``domain``, by default rclpy's.

    It holds their locks, so that Fast DDS takes them for somebody's and goes on to the next number.
    """
    number = rclpy.get_default_context().get_domain_id() if domain is None else domain
    first = _FIRST_PORT + _PORTS * number
    with ExitStack() as held:
        for path in _SHARED_MEMORY.glob("fastrtps_port*_el"):
            port = re.fullmatch(r"fastrtps_port(\d+)_el", path.name)
            if port and first <= int(port[1]) < first + _PORTS:
                # the lock of who lives is refused, that of another user may not be opened: neither is taken anyway
                with suppress(OSError):
                    _lock(path, held)
        yield


def _lock(path: Path, held: ExitStack) -> None:
    opened = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    held.callback(os.close, opened)
    if time.time() - os.fstat(opened).st_mtime > _YOUNG:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
