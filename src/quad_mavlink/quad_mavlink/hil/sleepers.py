"""Whether the processes that the plant waits for all sleep, as Linux says it of each of their threads in /proc.

An autopilot in the loop, its agent and our own middleware say nothing when they have nothing to say. A wait of fixed
length for that is too long on an idle machine and too short on a busy one; a thread that wants the processor is seen.
"""

import contextlib
import os
import socket
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

PROC = Path("/proc")
_LARGEST = 512
_QUIET_LOOKS = 200  # between two looks for new threads: not by time, in which a busy machine may run none of them
_ASLEEP = frozenset((b"S", b"I"))
_NOBODY = 0


class Row(NamedTuple):
    """One socket of /proc/net: both ends as ``(address, port)`` in the table's hexadecimal, and its inode."""

    local: tuple[str, str]
    remote: tuple[str, str]
    inode: int


def rows(text: str) -> Iterator[Row]:
    """Yield the sockets of a table of /proc/net."""
    for line in text.splitlines()[1:]:
        words = line.split()
        (local, local_port), (remote, remote_port) = (end.split(":") for end in words[1:3])
        yield Row((local, local_port), (remote, remote_port), int(words[9]))


def table(kind: str) -> list[Row]:
    """Return the sockets of a kind, tcp or udp (IPv4); none where /proc has no such table."""
    try:
        return list(rows((PROC / "net" / kind).read_text("ascii")))
    except OSError:
        return []


def inodes(process: int) -> set[int]:
    """Return the sockets that a process has open, as far as we may see them."""
    found: set[int] = set()
    with contextlib.suppress(OSError):
        for path in (PROC / str(process) / "fd").iterdir():
            with contextlib.suppress(OSError):
                target = str(path.readlink())
                if target.startswith("socket:["):
                    found.add(int(target[8:-1]))
    return found


def owners(wanted: Iterable[int]) -> set[int]:
    """Return the processes that have one of the sockets ``wanted`` open."""
    given = set(wanted)
    if not given:
        return set()
    return {int(path.name) for path in PROC.iterdir() if path.name.isdigit() and inodes(int(path.name)) & given}


def across(connection: socket.socket) -> Row | None:
    """Return the other end of a TCP connection; None if it is not on this machine."""
    try:
        ours = connection.getsockname()[1], connection.getpeername()[1]
    except OSError:
        return None
    wanted = tuple(f"{port:04X}" for port in reversed(ours))
    return next((row for row in table("tcp") if (row.local[1], row.remote[1]) == wanted), None)


def agents(process: int) -> set[int]:
    """Return the processes of this machine to which UDP sockets of ``process`` are connected."""
    all_rows, own = table("udp"), inodes(process)
    ends = {row.remote for row in all_rows if row.inode in own and int(row.remote[1], 16) != _NOBODY}
    reached = {row.inode for row in all_rows if row.inode not in own for end in ends if _takes(row, end)}
    return owners(reached)


def _takes(row: Row, end: tuple[str, str]) -> bool:
    return row.local[1] == end[1] and row.local[0] in (end[0], "00000000")


def parties(connection: socket.socket) -> list[int]:
    """Return the process at the other end of a TCP connection and its agents; none if it is not on this machine."""
    end = across(connection)
    found = owners([end.inode]) if end is not None else set()
    return sorted(found.union(*map(agents, found)) - {os.getpid()})


def name(process: int) -> str:
    """Return what a process is called."""
    try:
        return (PROC / str(process) / "comm").read_text("utf-8").strip()
    except OSError:
        return "unknown"


class Thread(NamedTuple):
    """Open files of a thread: its state, and how often and how long it ran."""

    state: int
    ran: int


class Watch:
    """Knows whether all threads of some processes sleep; our own calling thread does not count."""

    def __init__(self, processes: Iterable[int]) -> None:
        """Watch ``processes``, which must sleep on what they wait for and not look for it by a clock, and our own."""
        self.processes = frozenset(processes) | {os.getpid()}
        self._self = threading.get_native_id()
        self._threads: dict[tuple[int, str], Thread] = {}
        self._active: list[Thread] = []
        self._ran: dict[tuple[int, str], bytes] = {}
        self._until_refresh = 0
        self._busiest: Thread | None = None  # running at the last look

    def is_quiet(self) -> bool:
        """Return whether every thread sleeps, all at one time.

        Each is seen waiting, and between two readings of how often each ran none ran: so no thread woke one that had
        been seen before, to sleep by the time it was itself looked at.
        """
        if self._until_refresh == 0:
            self._refresh()
            self._until_refresh = _QUIET_LOOKS
        if self._busiest is not None and not _is_asleep(self._busiest):
            return False
        before = self._read_ran()
        self._busiest = next((thread for thread in self._active if not _is_asleep(thread)), None)
        is_quiet = self._busiest is None and self._read_ran() == before
        self._until_refresh -= is_quiet
        return is_quiet

    def _read_ran(self) -> list[bytes]:
        return [_read(thread.ran) for thread in self._active]

    def _refresh(self) -> None:
        """Look for threads that are new or gone, and leave alone those that have not run since the last time.

        Of an agent's fifty threads five work while a vehicle flies, and each look costs time.
        """
        known: dict[tuple[int, str], Thread] = {}
        for process in self.processes:
            with contextlib.suppress(OSError):
                for path in (PROC / str(process) / "task").iterdir():
                    if int(path.name) == self._self:
                        continue
                    key = process, path.name
                    with contextlib.suppress(OSError):
                        known[key] = self._threads.pop(key) if key in self._threads else _open(path)
        self.close()
        self._threads, self._busiest = known, None
        ran = {key: _read(thread.ran) for key, thread in known.items()}
        self._active = [thread for key, thread in known.items() if ran[key] != self._ran.get(key)]
        self._ran = ran

    def close(self) -> None:
        """Close what is open."""
        for thread in self._threads.values():
            os.close(thread.state)
            os.close(thread.ran)
        self._threads, self._active = {}, []


def _open(path: Path) -> Thread:
    state = os.open(path / "stat", os.O_RDONLY | os.O_CLOEXEC)
    try:
        return Thread(state, os.open(path / "schedstat", os.O_RDONLY | os.O_CLOEXEC))
    except OSError:
        os.close(state)
        raise


def _is_asleep(thread: Thread) -> bool:
    text = _read(thread.state)
    after = text.rfind(b")") + 2  # a name may have brackets
    return not text or text[after : after + 1] in _ASLEEP


def _read(file: int) -> bytes:
    """Return what stands in a file, nothing for a thread that has ended."""
    try:
        return os.pread(file, _LARGEST, 0)
    except OSError:
        return b""
