"""A newcomer does not take the place of a process that died, and nobody comes while another comes or leaves.

Fast DDS numbers the queues of its readers in shared memory, and gives a newcomer the first number whose lock is free:
in flight, that of a node which was killed. The newcomer opens a new queue under the old name, but whoever has written
to the old one goes on writing there, so nobody would ever reach it (decision 103).

The last who leaves a queue removes it and the mutex beside it, for which a newcomer may be waiting just then. He and
the next each hold a mutex of their own then, and one removes the queue that the other has made (decision 104).
"""

import fcntl
import os
import re
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import rclpy
from rcl_interfaces.srv import DescribeParameters
from rclpy.context import Context
from rclpy.node import Node
from rclpy.type_support import check_for_type_support

from quad_node import ports

_SHARED_MEMORY = Path("/dev/shm")
_NAMES = range(7000, 7400)
"""Where each participant of the machine, of whatever domain, has a queue for the names of the nodes of others."""

_MOST_NAMES = 200
"""Of these that are avoided, the latest: Fast DDS has no other numbers for these queues."""

_OWN = 10
"""Number of the first queue of a domain that belongs to one process; those before are of multicast."""

_YOUNG = 1.0
"""s: who is just starting, and no Member, may have made its lock file and not locked it yet."""

_PATIENCE = 2.0
"""s that a participant waits for others to have come or left; each takes some 10 ms."""


class Member(Node):
    """A node that comes into a domain apart from the dead, and comes and leaves while nobody else does."""

    def __init__(self, name: str, *, at_the_end: bool = False, **options: Any) -> None:
        """Join; ``at_the_end``: see apart_from_the_dead; ``options``: as for rclpy's Node."""
        # loading what every node offers takes ten times as long as joining, and the others may wait
        check_for_type_support(DescribeParameters)
        context: Context = options.get("context") or rclpy.get_default_context()
        with apart_from_the_dead(context.get_domain_id(), at_the_end):
            super().__init__(name, **options)

    def destroy_node(self) -> None:
        """Leave."""
        with alone():
            super().destroy_node()


@contextmanager
def apart_from_the_dead(domain: int, at_the_end: bool = False) -> Iterator[None]:
    """Let a participant that is made inside take no queue of a dead process in ``domain``.

    Where nobody lives the queues are removed. Else it holds the locks of the dead, so that Fast DDS takes them for
    somebody's and goes on to the next number. ``at_the_end``: behind the highest number that was given, for a number
    that is missing may be that of a dead process whose place a stranger has taken and left; Fast DDS says on stderr
    that it could not have it.
    """
    own = ports.of_domain(domain)
    with alone() as is_alone, ExitStack() as held:
        for numbers in (own, _NAMES) if is_alone else ():
            if all(map(_is_dead, _queues(numbers, "_[es]l"))):
                _remove(_queues(numbers, ""))
        names = sorted(_queues(_NAMES, "_el"), key=_age)
        for lock in [*_places(own), *names[:_MOST_NAMES]]:
            # the lock of who lives is refused, that of another user may not be opened: neither is taken anyway
            with suppress(OSError):
                if lock.exists():
                    _lock(lock, held)
                elif at_the_end:
                    _make(lock, held)
        yield


@contextmanager
def alone() -> Iterator[bool]:
    """Hold the lock of the folder, so that nobody comes or leaves meanwhile; gives whether it was to be had."""
    opened = os.open(_SHARED_MEMORY, os.O_RDONLY | os.O_CLOEXEC)
    until = time.monotonic() + _PATIENCE
    try:
        while not (is_alone := _is_locked(opened)) and time.monotonic() < until:
            time.sleep(0.002)
        yield is_alone
    finally:
        os.close(opened)


def _is_locked(opened: int) -> bool:
    """Return whether the lock of an open file is ours now."""
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _queues(numbers: range, suffix: str) -> list[Path]:
    """Return the files of the queues in ``numbers`` with ``suffix``, a regular expression."""
    found = []
    for path in _SHARED_MEMORY.glob("fastrtps_port*"):
        port = re.fullmatch(rf"fastrtps_port(\d+){suffix}", path.name)
        if port and int(port[1]) in numbers:
            found.append(path)
    return found


def _places(numbers: range) -> list[Path]:
    """Return the locks, there or not, of the queues of a domain's processes up to the highest that was given."""
    given = [int(path.name.removeprefix("fastrtps_port")) for path in _queues(numbers, "")]
    given += [int(path.name.removeprefix("fastrtps_port").removesuffix("_el")) for path in _queues(numbers, "_el")]
    return [_SHARED_MEMORY / f"fastrtps_port{port}_el" for port in range(numbers[_OWN], max(given, default=0) + 1)]


def _is_dead(lock: Path) -> bool:
    """Return whether nobody holds a lock, and nobody may be about to."""
    try:
        with ExitStack() as held:
            _lock(lock, held)
            return _age(lock) > _YOUNG
    except FileNotFoundError:  # its holder has just left
        return True
    except OSError:
        return False


def _remove(queues: list[Path]) -> None:
    for path in queues:
        with suppress(OSError):
            if _age(path) > _YOUNG:
                for name in (path.name, f"{path.name}_el", f"{path.name}_sl", f"sem.{path.name}_mutex"):
                    path.with_name(name).unlink(missing_ok=True)


def _age(path: Path) -> float:
    """Return how old a file is in s, 0 of one that is gone."""
    try:
        return time.time() - path.stat().st_mtime
    except FileNotFoundError:
        return 0.0


def _lock(path: Path, held: ExitStack) -> None:
    opened = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    held.callback(os.close, opened)
    fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _make(lock: Path, held: ExitStack) -> None:
    opened = os.open(lock, os.O_RDONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
    held.callback(os.close, opened)
    held.callback(lock.unlink, missing_ok=True)
    fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
