"""Where the UDP sockets of a process listen, and a port that is free."""

import socket
from contextlib import suppress
from pathlib import Path

LOOPBACK, GROUP = "127.0.0.1", "239.255.0.1"  # the group of DDS's discovery


def free_port():
    """Return a UDP port of the loopback interface that no process has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((LOOPBACK, 0))
        return probe.getsockname()[1]


def udp_addresses(pid):
    """Return the addresses, with ports, to which the UDP sockets of a process are bound; those of IPv6 in hex."""
    opened = set()
    for path in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # the process closed it meanwhile
            opened.add(str(path.readlink()))
    tables = [path for path in (Path(f"/proc/{pid}/net/udp"), Path(f"/proc/{pid}/net/udp6")) if path.exists()]
    rows = [line.split() for table in tables for line in table.read_text().splitlines()[1:]]
    mine = [row[1].split(":") for row in rows if f"socket:[{row[9]}]" in opened]
    return [(_dotted(where) if len(where) == 8 else where, int(port, 16)) for where, port in mine]


def _dotted(address):
    return socket.inet_ntoa(bytes.fromhex(address)[::-1])
