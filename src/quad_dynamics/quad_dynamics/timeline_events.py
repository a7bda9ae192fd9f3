"""The lines of a scenario: what each kind of event needs, how it is written, and what is refused.

One event per line: ``KIND NAME=VALUE ...``; vectors are written ``x,y,z``; ``#`` begins a comment. Times in s since
take-off; an event without an end lasts to the end of the flight.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from quad_core.parameters import ParameterError

LATEST = 7200.0
FOR_EVER = 1e18
WIND, GUST, DRYDEN, GAUSSIAN, PUSH, PAYLOAD, ROTOR, BATTERY, FREEZE, JUMP, LINK = (float(i) for i in range(11))
"""Codes of the kinds; those of moving air come first, ROTOR and BATTERY stand together."""


class Number(NamedTuple):
    """A number of an event; ``default`` None: it must be given."""

    unit: str
    low: float
    high: float
    default: float | None = None


class Vector(NamedTuple):
    """Three numbers of an event; without ``needed`` they are zero where not given."""

    unit: str
    size: float
    needed: bool = True


class Kind(NamedTuple):
    """One kind of event: code in the table, its numbers in the order of the table's columns, meaning."""

    code: float
    fields: Mapping[str, Number | Vector]
    meaning: str


class Event(NamedTuple):
    """One checked event. ``values``: the numbers of its fields, flat. ``line`` counts from 1."""

    line: int
    text: str
    kind: str
    start: float
    end: float
    values: tuple[float, ...]


class EventError(ParameterError):
    """A line of a scenario is refused; ``text`` is that line, so that its place in a file can be found."""

    def __init__(self, line: int, text: str, problem: str) -> None:
        super().__init__(f"events: line {line}: {text!r}: {problem}")
        self.text = text


KINDS = {
    "wind": Kind(WIND, {"velocity": Vector("m/s", 100.0)}, "constant wind"),
    "gust": Kind(GUST, {"velocity": Vector("m/s", 100.0)}, "1-cosine gust of this peak; needs an end"),
    "dryden": Kind(
        DRYDEN,
        {
            "wind": Number("m/s", 0.1, 50.0),
            "altitude": Number("m", 1.0, 300.0, 10.0),
            "airspeed": Number("m/s", 0.1, 100.0),
            "direction": Number("rad", -7.0, 7.0, 0.0),
        },
        "turbulence for a mean wind (at 6 m) blowing towards direction, flown through at airspeed",
    ),
    "held_gaussian": Kind(
        GAUSSIAN,
        {
            "acceleration_sd": Number("m/s^2", 0.0, 100.0, 0.5),
            "acceleration_clip": Number("m/s^2", 0.0, 1000.0, 1.5),
            "angular_sd": Number("rad/s^2", 0.0, 1000.0, 2.0 / 3.0),
            "angular_clip": Number("rad/s^2", 0.0, 1e4, 2.0),
            "hold": Number("s", 0.01, 1000.0, 2.0),
        },
        "the paper's disturbance, section 4",
    ),
    "push": Kind(
        PUSH,
        {"force": Vector("N", 1e4, needed=False), "torque": Vector("N m", 1e3, needed=False)},
        "pulse of force (world) and torque (body)",
    ),
    "payload": Kind(
        PAYLOAD,
        {
            "mass": Number("kg", 0.0, 100.0),
            "offset": Vector("m", 10.0, needed=False),
            "inertia": Vector("kg m^2", 10.0, needed=False),
        },
        "payload picked up at start and dropped at the end; offset of its centre (body), inertia about its own centre",
    ),
    "rotor": Kind(
        ROTOR,
        {"number": Number("", 1.0, 4.0), "effectiveness": Number("", 0.0, 2.0)},
        "true over nominal thrust of one rotor, 0: stopped",
    ),
    "battery": Kind(
        BATTERY,
        {"limit": Number("", 0.05, 1.0), "sag": Number("s", 0.0, 7200.0, 0.0)},
        "largest thrust over nominal, reached evenly over the time sag",
    ),
    "freeze": Kind(FREEZE, {}, "sensors repeat their last reading"),
    "jump": Kind(
        JUMP,
        {"offset": Vector("m", 1000.0, needed=False), "yaw": Number("rad", -3.2, 3.2, 0.0)},
        "sensors jump in position (world) and heading",
    ),
    "link": Kind(
        LINK,
        {
            "delay": Number("s", 0.0, 10.0, 0.0),
            "jitter": Number("s", 0.0, 10.0, 0.0),
            "drop": Number("", 0.0, 1.0, 0.0),
        },
        "commands come late by delay and up to jitter more, and share drop of them never",
    ),
}


def parsed(text: str) -> list[Event]:
    """Return the events of ``text``; raises EventError naming the line, what was found and what was expected."""
    events = []
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("#")[0].strip()
        if line:
            events.append(_event(number, line))
    return events


def _event(number: int, line: str) -> Event:
    name, *words = line.split()
    if name not in KINDS:
        raise EventError(number, line, f"unknown kind {name!r}; expected one of {', '.join(KINDS)}")
    kind, given = KINDS[name], {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or key not in {"start", "end", *kind.fields}:
            expected = ", ".join(f"{item}=" for item in ("start", "end", *kind.fields))
            raise EventError(number, line, f"found {word!r}, expected some of {expected}")
        if key in given:
            raise EventError(number, line, f"{key} stands twice")
        given[key] = value
    start, end = _times(number, line, given)
    if name == "gust" and end == FOR_EVER:
        raise EventError(number, line, "a gust needs end=")
    values: list[float] = []
    for key, field in kind.fields.items():
        values += _values(number, line, key, field, given.get(key))
    if name == "rotor" and values[0] != math.floor(values[0]):
        raise EventError(number, line, f"number: found {values[0]:g}, expected 1, 2, 3 or 4")
    return Event(number, line, name, start, end, tuple(values))


def _times(number: int, line: str, given: Mapping[str, str]) -> tuple[float, float]:
    start = _number(number, line, "start", Number("s", 0.0, LATEST), given.get("start", "0"))
    if "end" not in given:
        return start, FOR_EVER
    end = _number(number, line, "end", Number("s", 0.0, LATEST), given["end"])
    if end <= start:
        raise EventError(number, line, f"end: found {end:g}, expected more than start, {start:g}")
    return start, end


def _values(number: int, line: str, key: str, field: Number | Vector, text: str | None) -> list[float]:
    if isinstance(field, Number):
        if text is None and field.default is None:
            raise EventError(number, line, f"{key}= is missing")
        return [field.default or 0.0] if text is None else [_number(number, line, key, field, text)]
    if text is None:
        if field.needed:
            raise EventError(number, line, f"{key}= is missing")
        return [0.0, 0.0, 0.0]
    parts = text.split(",")
    if len(parts) != 3:
        raise EventError(number, line, f"{key}: found {text!r}, expected x,y,z in {field.unit}")
    return [_number(number, line, key, Number(field.unit, -field.size, field.size), part) for part in parts]


def _number(number: int, line: str, key: str, field: Number, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not field.low <= value <= field.high:
        expected = f"a number in [{field.low:g}, {field.high:g}] {field.unit}".rstrip()
        raise EventError(number, line, f"{key}: found {text!r}, expected {expected}")
    return value
