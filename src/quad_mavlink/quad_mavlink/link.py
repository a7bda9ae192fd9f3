"""MAVLink messages by pymavlink, which is the user's: over UDP to an autopilot, over TCP as its simulator.

pymavlink is under the LGPL-3: shipping both together brings that licence's duties; this package only
imports it. Its own connections answer every sender and drop what a full TCP buffer does not take, so sockets are ours.
"""

import importlib
import re
import select
import socket
from types import ModuleType
from typing import Any

from quad_core.parameters import ParameterError

AUTOPILOT, COMPANION, SIMULATOR = 1, 191, 51  # MAV_COMP_ID
_LARGEST = 65_536
_BATCH = 1000
_STUCK = 5.0  # s in which an autopilot that reads nothing counts as gone


def load() -> ModuleType:
    """Return pymavlink's messages; raises ParameterError if it is not there."""
    try:
        return importlib.import_module("pymavlink.dialects.v20.common")
    except ImportError as error:
        raise ParameterError(
            f"pymavlink: not found ({error}); install it in addition: "
            "pip install --no-deps --require-hashes -r requirements/vehicles/lock.txt (LGPL-3)"
        ) from error


def address(text: str, key: str) -> tuple[str, int]:
    """Return IPv4 address and port of ``host:port``; raises ParameterError with the parameter ``key``."""
    found = re.fullmatch("(.+):([0-9]{1,5})", text)
    if not found or int(found[2]) > 65535:
        raise ParameterError(f"{key}: found {text!r}, expected host:port")
    try:
        return socket.gethostbyname(found[1]), int(found[2])
    except (OSError, ValueError, TypeError) as error:  # unknown, or no name at all
        raise ParameterError(f"{key}: found {text!r}, expected a host that is known: {error}") from error


def _opened(kind: socket.SocketKind, listen: str) -> socket.socket:
    """Return a socket bound to parameter ``listen``; raises ParameterError for a bad address or a taken port."""
    found = socket.socket(socket.AF_INET, kind)
    found.setblocking(False)
    try:
        if kind == socket.SOCK_STREAM:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind(address(listen, "listen"))
    except OSError as error:
        found.close()
        raise ParameterError(f"listen: found {listen}, cannot be opened: {error.strerror or error}") from error
    return found


def _codec(mavlink: ModuleType, system: int, component: int) -> Any:
    found = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    found.robust_parsing = True
    return found


class Link:
    """One autopilot over UDP."""

    def __init__(self, mavlink: ModuleType, listen: str, connect: str, source_system: int, target_system: int) -> None:
        """Open the port; raises ParameterError for bad addresses and a port that is taken."""
        self.mavlink, self.target_system = mavlink, target_system
        self.peer = address(connect, "connect") if connect else None
        self.strangers = self.lost = 0
        self._locked = False
        self._codec = _codec(mavlink, source_system, COMPANION)
        self._socket = _opened(socket.SOCK_DGRAM, listen)

    def messages(self) -> list[Any]:
        """Return what the autopilot has sent; the first address that sends its HEARTBEAT is the autopilot's."""
        found = []
        for _ in range(_BATCH):
            try:
                data, sender = self._socket.recvfrom(_LARGEST)
            except BlockingIOError:
                break
            except OSError:
                continue  # nothing listens at the peer's port yet
            if self._locked and sender != self.peer:  # parsed, a piece of a message would swallow the autopilot's next
                self.strangers += 1
                continue
            for message in self._codec.parse_buffer(data) or ():
                if message.get_type() == "BAD_DATA":
                    self.lost += 1
                elif (message.get_srcSystem(), message.get_srcComponent()) != (self.target_system, AUTOPILOT):
                    continue
                elif self._locked or message.get_type() == "HEARTBEAT":
                    self.peer, self._locked = sender, True
                    found.append(message)
        return found

    def send(self, message: Any) -> None:
        """Send a message to the autopilot, if its address is known; what cannot be sent is lost, as on any link."""
        if self.peer is not None:
            try:
                self._socket.sendto(message.pack(self._codec), self.peer)
            except OSError:
                self.lost += 1

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


class Server:
    """Waits over TCP for one autopilot, as its simulator; once it is there no other client can connect."""

    def __init__(self, mavlink: ModuleType, listen: str) -> None:
        """Open the port; raises ParameterError for a bad address or a port that is taken."""
        self.is_closed = False
        self._codec = _codec(mavlink, 1, SIMULATOR)
        self._peer: socket.socket | None = None
        self._waiting: list[Any] = []
        self._socket = _opened(socket.SOCK_STREAM, listen)
        self._socket.listen(1)

    def accept(self) -> bool:
        """Return whether an autopilot is connected; after the first one the port is closed."""
        if self._peer is None:
            try:
                self._peer, _ = self._socket.accept()
            except BlockingIOError:
                return False
            self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._peer.settimeout(_STUCK)
            self._socket.close()
        return True

    def send(self, messages: list[Any]) -> None:
        """Send messages in one piece."""
        assert self._peer is not None
        try:
            self._peer.sendall(b"".join(message.pack(self._codec) for message in messages))
        except OSError:
            self.is_closed = True

    def next(self, kind: str, patience: float) -> Any | None:
        """Return the next message of ``kind``; None after ``patience`` s, or when the autopilot has left."""
        while True:
            while self._waiting:
                message = self._waiting.pop(0)
                if message.get_type() == kind:
                    return message
            if self.is_closed or not self._read(patience):
                return None

    def _read(self, patience: float) -> bool:
        assert self._peer is not None
        try:
            if not select.select([self._peer], [], [], patience)[0]:
                return False
            data = self._peer.recv(_LARGEST)
        except OSError:
            data = b""
        self.is_closed = not data
        self._waiting += self._codec.parse_buffer(data) or () if data else ()
        return not self.is_closed

    def close(self) -> None:
        """Close the connection and the port."""
        self._socket.close()
        if self._peer is not None:
            self._peer.close()
