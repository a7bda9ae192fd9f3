"""MAVLink over TCP: one autopilot connects, as PX4's software in the loop does to its simulator."""

import select
import socket
from types import ModuleType
from typing import Any

from quad_core.parameters import ParameterError
from quad_mavlink.link import address

_LARGEST = 65_536
_STUCK = 5.0  # s in which an autopilot that reads nothing counts as gone


class Server:
    """Waits for one autopilot; once it is there no other client can connect."""

    def __init__(self, mavlink: ModuleType, listen: str) -> None:
        """Open the port; raises ParameterError for a bad address or a port that is taken."""
        self.listen, self.lost = listen, 0
        self.is_closed = False
        self._codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=51)
        self._codec.robust_parsing = True
        self._peer: socket.socket | None = None
        self._waiting: list[Any] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.setblocking(False)
        try:
            self._socket.bind(address(listen, "listen"))
            self._socket.listen(1)
        except OSError as error:
            self._socket.close()
            raise ParameterError(f"listen: found {listen}, cannot be opened: {error.strerror or error}") from error

    @property
    def peer(self) -> socket.socket | None:
        """The connection to the autopilot, None before it is there."""
        return self._peer

    def accept(self) -> bool:
        """Return whether an autopilot is connected; the first one closes the door behind it."""
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
                self.lost += message.get_type() == "BAD_DATA"
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
