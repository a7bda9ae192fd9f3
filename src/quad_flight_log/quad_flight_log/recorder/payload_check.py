"""Whether bytes are a message of their topic's type: what no reader could decode never enters a bag.

Stricter than rclpy: little endian alone, texts in UTF-8 with their zero byte, as readers of others demand.
"""

from collections.abc import Callable, Hashable
from operator import itemgetter

from quad_flight_log.recorder.message_fields import SIZES, Field, fields_of, message_class, type_name

_HEADER = 4  # bytes of encapsulation before the data; alignment counts from behind them
_PLAIN = b"\x00\x01"
_MOST_ITEMS = 10_000  # messages and texts in the sequences of one message; reading them takes time and memory
_MOST_PLACES = 16  # of length words, texts and booleans, up to which looking them up is quicker than reading
_MOST_KNOWN = 64  # contents of those places that are remembered
_MOST_PADDING = 3  # bytes behind the last field


class _MalformedError(Exception):
    """What is wrong with a payload."""


class PayloadCheck:
    """Tells what is wrong with payloads of one type.

    Messages of a topic mostly have lengths, texts and booleans that were read before: those are looked up before
    anything is read field by field.
    """

    def __init__(self, kind: type) -> None:
        """Expect messages of the class ``kind``."""
        self._kind = kind
        self._size = -1
        self._places: list[tuple[int, int]] = []
        self._pick: Callable[[bytes], Hashable] = len
        self._known: set[Hashable] = set()

    def __call__(self, payload: bytes) -> str:
        """Return what is wrong with ``payload`` (CDR with its encapsulation header), empty if nothing is."""
        if len(payload) == self._size and self._pick(payload) in self._known:
            return ""
        return self._read(payload)

    def _read(self, payload: bytes) -> str:
        walk = _Walk(payload)
        try:
            walk.through(self._kind)
        except _MalformedError as error:
            return f"{error} in {len(payload)} bytes of {type_name(self._kind)}"
        places = walk.fixed + walk.flags
        if len(places) > _MOST_PLACES:
            self._size = -1
            return ""
        if (len(payload), places) != (self._size, self._places) or len(self._known) >= _MOST_KNOWN:
            self._size, self._places, self._known = len(payload), places, set()
            self._pick = itemgetter(*(slice(start, end) for start, end in places))
        self._known.add(self._pick(payload))
        return ""


class _Walk:
    """One payload, field by field; ``fixed`` and ``flags`` say where what was checked stands."""

    def __init__(self, payload: bytes) -> None:
        self.payload, self.at, self.items = payload, _HEADER, 0
        self.fixed: list[tuple[int, int]] = [(0, 2)]
        self.flags: list[tuple[int, int]] = []

    def through(self, kind: type) -> None:
        if len(self.payload) < _HEADER or self.payload[:2] != _PLAIN:
            raise _MalformedError(f"found {self.payload[:2].hex() or 'nothing'}, expected 0001 (little-endian CDR)")
        self.structure(kind)
        left = len(self.payload) - self.at
        if left > _MOST_PADDING:
            raise _MalformedError(f"found {left} bytes behind the last field")

    def structure(self, kind: type) -> None:
        fields = fields_of(kind)
        if not fields:
            self.take(1, 1, "nothing")
        for field in fields:
            self.field(field)

    def field(self, field: Field) -> None:
        count = self.length(field.name) if field.length < 0 else field.length or 1
        if field.base in SIZES:
            start = self.take(SIZES[field.base], count, field.name)
            if field.base == "boolean" and count:
                if max(self.payload[start : self.at]) > 1:
                    raise _MalformedError(f"{field.name}: found a boolean that is neither 0 nor 1")
                self.note(self.flags, start)
            return
        if field.length:
            self.items += count
            if self.items > _MOST_ITEMS:
                raise _MalformedError(f"{field.name}: found more than {_MOST_ITEMS} items")
        for _ in range(count):
            if field.base == "string":
                self.text(field.name)
            else:
                self.structure(message_class(field.base))

    def length(self, name: str) -> int:
        start = self.take(4, 1, name)
        word = self.payload[start : self.at]
        self.note(self.fixed, start)
        return int.from_bytes(word, "little")

    def text(self, name: str) -> None:
        size = self.length(name)
        start = self.take(1, size, name)
        found = self.payload[start : self.at]
        if found[-1:] != b"\0":
            raise _MalformedError(f"{name}: found a text without its zero byte")
        try:
            found.decode("utf-8")
        except UnicodeDecodeError:
            raise _MalformedError(f"{name}: found a text that is not UTF-8") from None
        self.note(self.fixed, start)

    def note(self, places: list[tuple[int, int]], start: int) -> None:
        """Remember that what stands from ``start`` to here was checked, in one with what stands right before it."""
        if places and places[-1][1] == start:
            start = places.pop()[0]
        places.append((start, self.at))

    def take(self, size: int, count: int, name: str) -> int:
        """Pass ``count`` aligned numbers of ``size`` bytes; returns where the first stands."""
        if count:
            self.at += -(self.at - _HEADER) % size
        start = self.at
        self.at += size * count
        if self.at > len(self.payload):
            raise _MalformedError(f"{name}: it ends early")
        return start
