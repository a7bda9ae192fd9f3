"""MAVLink messages over UDP by pymavlink, which is the user's: found at start, not shipped.

pymavlink is under the LGPL-3: shipping both together brings that licence's duties; this package only
imports it.
"""

import importlib
import select
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from types import ModuleType
from typing import Any

from quad_core.parameters import ParameterError

AUTOPILOT, COMPANION = 1, 191
"""MAV_COMP_ID."""
_LARGEST = 2048
_BATCH = 1000
_PATIENCE = 0.2


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
    """Return host and port of ``host:port``; raises ParameterError with the parameter ``key``."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 <= int(port) < 65536:
        raise ParameterError(f"{key}: found {text!r}, expected host:port")
    return host, int(port)


class Link:
    """One autopilot over UDP."""

    def __init__(self, mavlink: ModuleType, listen: str, connect: str, source_system: int, target_system: int) -> None:
        """Open the port; raises ParameterError for bad addresses, OSError for a port that is taken."""
        self.mavlink, self.target_system = mavlink, target_system
        self.peer = address(connect, "connect") if connect else None
        self.strangers = self.lost = 0
        self._locked = False
        self._is_closed = False
        self._taken = threading.Event()
        self._codec = mavlink.MAVLink(None, srcSystem=source_system, srcComponent=COMPANION)
        self._codec.robust_parsing = True
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        host, port = address(listen, "listen")
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise ParameterError(f"listen: found {listen}, cannot be opened: {error.strerror or error}") from error

    def start(self, wake: Callable[[], None]) -> None:
        """Call ``wake`` in another thread whenever something has come; ``messages`` must take it."""

        def watch() -> None:
            while not self._is_closed:
                with suppress(OSError, ValueError):  # closed meanwhile
                    if select.select([self._socket], [], [], _PATIENCE)[0]:
                        self._taken.clear()
                        wake()
                        self._taken.wait(_PATIENCE)

        threading.Thread(target=watch, name="mavlink", daemon=True).start()

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
            for message in self._codec.parse_buffer(data) or ():
                if message.get_type() == "BAD_DATA":
                    self.lost += 1
                elif (message.get_srcSystem(), message.get_srcComponent()) != (self.target_system, AUTOPILOT):
                    continue
                elif self._is_peer(sender, message.get_type()):
                    found.append(message)
        self._taken.set()
        return found

    def _is_peer(self, sender: tuple[str, int], kind: str) -> bool:
        if self._locked and sender != self.peer:
            self.strangers += 1
            return False
        if not self._locked:
            if kind != "HEARTBEAT":
                return False
            self.peer, self._locked = sender, True
        return True

    def send(self, message: Any) -> None:
        """Send a message to the autopilot, if its address is known; what cannot be sent is lost, as on any link."""
        if self.peer is None:
            return
        try:
            self._socket.sendto(message.pack(self._codec), self.peer)
        except OSError:
            self.lost += 1

    def close(self) -> None:
        """Close the port; the watching thread ends."""
        self._is_closed = True
        self._socket.close()
