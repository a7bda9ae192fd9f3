"""MAVLink telemetry: heard from an autopilot into a log (.tlog), and such a log read as tables.

A .tlog, which ground stations write too, is a series of (us since 1970 as big-endian integer, packet). Nothing is ever
sent here: the socket only receives.
"""

import contextlib
import importlib
import re
import socket
import struct
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.errors import FlightLogError

Table = dict[str, NDArray[Any]]
NEEDED = {31: "ATTITUDE_QUATERNION", 32: "LOCAL_POSITION_NED", 85: "POSITION_TARGET_LOCAL_NED"}
MOTORS = {36: "SERVO_OUTPUT_RAW", 375: "ACTUATOR_OUTPUT_STATUS"}
_READ = {*NEEDED, *MOTORS, 0, 1, 83, 105, 245, 253}
_NEXT = re.compile(b"[\xfd\xfe]")
_HEADERS = {0xFD: 10, 0xFE: 6}
_SIGNED, _SIGNATURE, _CHECKSUM = 1, 13, 2
_AUTOPILOT, _NO_AUTOPILOT = 1, 8
_WRAP = 2.0**32 * 1e-6  # s after which a clock of 32 bit in us begins anew
_RESTART = 5.0  # s by which the autopilot's clock goes back if it started anew
_ON_GROUND = 1
_MOST_TEXTS = 100
_SAY_EVERY = 5.0


def _dialect() -> ModuleType:
    try:
        return importlib.import_module("pymavlink.dialects.v20.common")
    except ImportError as error:
        text = "pip install --no-deps --require-hashes -r requirements/vehicles/lock.txt (LGPL-3)"
        raise FlightLogError(f"telemetry needs pymavlink: {text}") from error


def _length(data: bytes, at: int) -> int:
    """Return the length of the packet at ``at``, 0 where none begins; the data may end before it does."""
    if at + 3 > len(data) or data[at] not in _HEADERS:
        return 0
    signature = _SIGNATURE if data[at] == 0xFD and data[at + 2] & _SIGNED else 0
    return _HEADERS[data[at]] + data[at + 1] + _CHECKSUM + signature


def _identity(packet: bytes) -> tuple[int, int, int]:
    """Return (system, component, number of the message)."""
    if packet[0] == 0xFE:
        return packet[3], packet[4], packet[5]
    return packet[5], packet[6], int.from_bytes(packet[7:10], "little")


def packets(datagram: bytes) -> Iterator[bytes]:
    """Return the whole packets of a datagram."""
    at = 0
    while (length := _length(datagram, at)) and at + length <= len(datagram):
        yield datagram[at : at + length]
        at += length


def address(text: str) -> tuple[str, int]:
    """Return host and port of ``host:port``; raises FlightLogError."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise FlightLogError(f"--listen: found {text!r}, expected host:port")
    return host, int(port)


def listen(address: tuple[str, int], out: Path, say: Callable[[str], object]) -> None:
    """Write what comes from the first autopilot at ``address`` into ``out``, until KeyboardInterrupt.

    ``say`` gets a line every _SAY_EVERY s. Raises FlightLogError for an address that cannot be opened, and at once
    where the library that reads ``out`` is missing.
    """
    _dialect()
    with contextlib.ExitStack() as opened:
        heard = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        try:
            heard.bind(address)
        except OSError as error:
            raise FlightLogError(f"--listen: {address[0]}:{address[1]}: {error.strerror or error}") from error
        heard.settimeout(0.2)
        file = opened.enter_context(out.open("xb"))
        peer, counts, begun, told = None, Counter[int](), time.monotonic(), time.monotonic()
        while True:
            data, sender = b"", None
            with contextlib.suppress(TimeoutError):
                data, sender = heard.recvfrom(65536)
            for packet in packets(data) if peer in (None, sender) else ():
                _, component, number = _identity(packet)
                if component == _AUTOPILOT and number == 0:
                    peer = sender
                file.write(struct.pack(">Q", time.time_ns() // 1000) + packet)
                counts[number] += component == _AUTOPILOT
            if (now := time.monotonic()) - told >= _SAY_EVERY:
                file.flush()
                say(_line(counts, now - begun, now - told))
                counts, told = Counter(), now


def _line(counts: Counter[int], elapsed: float, span: float) -> str:
    if not counts:
        return f"{elapsed:.0f} s: no MAVLink heard"
    rates = {name: counts[number] / span for number, name in NEEDED.items()}
    rates["motors"] = max(counts[number] for number in MOTORS) / span
    return f"{elapsed:.0f} s: " + ", ".join(f"{name} {rate:.0f} Hz" for name, rate in rates.items())


def read_tlog(_: Path, data: bytes) -> tuple[dict[str, Table], list[str]]:
    """Return the tables and notes of a .tlog: its first autopilot, in that one's time, the longest of its starts."""
    codec, starts, system, at, lost = _dialect().MAVLink(None), [_Start()], None, 0, 0
    while at + 8 < len(data):
        length = _length(data, at + 8)
        packet = data[at + 8 : at + 8 + length]
        if not length or len(packet) < length:
            found = _NEXT.search(data, at + 9)
            lost, at = lost + 1, found.start() - 8 if found else len(data)
            continue
        at += 8 + length
        sender, component, number = _identity(packet)
        if number not in _READ or component != _AUTOPILOT or system not in (None, sender):
            continue
        try:
            message = codec.decode(bytearray(packet))
        except Exception:  # the library raises many
            lost += 1
            continue
        if system is None and (number or message.autopilot == _NO_AUTOPILOT):
            continue  # before its first HEARTBEAT the sender is unknown
        system = sender
        if not starts[-1].take(message):
            starts.append(_Start())
            starts[-1].take(message)
    best = max(starts, key=lambda each: each.count)
    notes = [f"the autopilot started {len(starts)} times: its longest run is here"] * (len(starts) > 1)
    return best.tables(), [
        *notes,
        *[f"damaged at {lost} places: what could be read is here"] * bool(lost),
        *best.notes(),
    ]


class _Start:
    """What an autopilot said from one start to the next; ``now`` s is its clock."""

    def __init__(self) -> None:
        self.now, self.count = 0.0, 0
        self._on_ground: bool | None = None
        self._rows: dict[str, list[tuple[Any, ...]]] = {}
        self._fields: dict[str, list[str]] = {}
        self._said: list[tuple[float, str]] = []

    def take(self, message: Any) -> bool:
        """Keep a message; False if it is from the next start of the autopilot."""
        kind, fields, at = message.get_type(), message.get_fieldnames(), self.now
        if "time_boot_ms" in fields:
            at = 1e-3 * message.time_boot_ms
        elif "time_usec" in fields:
            at = 1e-6 * message.time_usec
            if kind == "SERVO_OUTPUT_RAW" and self.now:
                at += _WRAP * round((self.now - at) / _WRAP)
        if at < self.now - _RESTART:
            return False
        self.now, self.count = max(self.now, at), self.count + 1
        if kind == "STATUSTEXT" and len(self._said) < _MOST_TEXTS:
            self._said.append((self.now, f"it says {message.text!r}"))
        elif kind == "EXTENDED_SYS_STATE":
            before, self._on_ground = self._on_ground, message.landed_state == _ON_GROUND
            if before is None:
                self._said.append((self.now, "on the ground" if self._on_ground else "in the air already"))
            elif before != self._on_ground:
                self._said.append((self.now, "landed" if self._on_ground else "took off"))
        elif kind not in ("STATUSTEXT", "HEARTBEAT"):
            self._fields[kind] = fields
            self._rows.setdefault(kind, []).append((at, *(getattr(message, name) for name in fields)))
        return True

    def tables(self) -> dict[str, Table]:
        """Return {message: {field: values, t: s of the autopilot}}, arrays as field[0], field[1], ..."""
        out: dict[str, Table] = {}
        for kind, rows in self._rows.items():
            table: Table = {}
            for name, column in zip(["t", *self._fields[kind]], zip(*rows, strict=True), strict=True):
                values = np.array(column, float)
                table |= {name: values} if values.ndim == 1 else {f"{name}[{i}]": v for i, v in enumerate(values.T)}
            out[kind] = table
        return out

    def notes(self) -> list[str]:
        """Return what was said and when the vehicle took off and landed, by the time of the first message."""
        first = min((rows[0][0] for rows in self._rows.values()), default=0.0)
        return [f"at {at - first:.1f} s: {text}" for at, text in self._said]
