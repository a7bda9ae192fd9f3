"""Disturbance ``timeline``: wind, payload and failures as events, all drawn before take-off.

One event per line: ``KIND NAME=VALUE ...``; vectors are written ``x,y,z``; ``#`` begins a comment. Times are flight
times in s, which count from step 0; an event without an end lasts to the end of the flight.

The table of a flight: row 0 holds the number of events, then a row per event (code, start, end, first row and number of
rows of what was drawn for it, its values), then what was drawn.
"""

import math
from collections.abc import Mapping
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.geometry import add
from quad_core.parameters import ParameterError, Text
from quad_core.types import CALM, Conditions, LinkFault, Rotors, SensorFault, Vec3
from quad_core.vehicle import Vehicle
from quad_dynamics import dryden, held_gaussian

STREAM_FAMILY = 3
WIDTH = 16
VALUES = 5
TURBULENCE_PERIOD = 0.01
LINK_PERIOD = 0.002
EDGE = 1e-9
LATEST = 7200.0
FOR_EVER = 1e18
WIND, GUST, DRYDEN, GAUSSIAN, PUSH, PAYLOAD, ROTOR, BATTERY, FREEZE, JUMP, LINK = (float(i) for i in range(11))
"""Codes of the kinds; those of moving air come first, ROTOR and BATTERY stand together."""


class Number(NamedTuple):
    """A number of an event, or the three of a vector (``size``); ``default`` None: it must be given."""

    unit: str
    low: float
    high: float
    default: float | None = None
    size: int = 1


def three(unit: str, largest: float, default: float | None = None) -> Number:
    """Return a vector whose components are at most ``largest``."""
    return Number(unit, -largest, largest, default, 3)


class Kind(NamedTuple):
    """One kind of event: code in the table, its numbers in the order of the table's columns."""

    code: float
    fields: Mapping[str, Number]


class Event(NamedTuple):
    """One checked event. ``values``: the numbers of its fields, flat."""

    text: str
    kind: str
    start: float
    end: float
    values: tuple[float, ...]


LATE = Number("s", 0.0, 10.0, 0.0)
TIMES = {"start": Number("s", 0.0, LATEST, 0.0), "end": Number("s", 0.0, LATEST, FOR_EVER)}
KINDS = {
    "wind": Kind(WIND, {"velocity": three("m/s", 100.0)}),
    "gust": Kind(GUST, {"velocity": three("m/s", 100.0)}),
    "dryden": Kind(
        DRYDEN,
        {
            "wind": Number("m/s", 0.1, 50.0),
            "altitude": Number("m", 1.0, 300.0, 10.0),
            "airspeed": Number("m/s", 0.1, 100.0),
            "direction": Number("rad", -7.0, 7.0, 0.0),
        },
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
    ),
    "push": Kind(PUSH, {"force": three("N", 1e4, 0.0), "torque": three("N m", 1e3, 0.0)}),
    "payload": Kind(PAYLOAD, {"mass": Number("kg", 0.0, 100.0)}),
    "rotor": Kind(ROTOR, {"number": Number("", 1.0, 4.0), "effectiveness": Number("", 0.0, 2.0)}),
    "battery": Kind(BATTERY, {"limit": Number("", 0.05, 1.0), "sag": Number("s", 0.0, 7200.0, 0.0)}),
    "freeze": Kind(FREEZE, {}),
    "jump": Kind(JUMP, {"offset": three("m", 1000.0, 0.0), "yaw": Number("rad", -3.2, 3.2, 0.0)}),
    "link": Kind(LINK, {"delay": LATE, "jitter": LATE, "drop": Number("", 0.0, 1.0, 0.0)}),
}
"""What each kind does: docs/reference/scenarios.md."""


class EventError(ParameterError):
    """A line is no event; ``text`` is that line, by which a reader of files finds its place."""

    def __init__(self, line: str, problem: object) -> None:
        super().__init__(f"events: {line!r}: {problem}")
        self.text = line


class Parameters(NamedTuple):
    """The events of a flight."""

    events: Annotated[str, Text("one per line: KIND start=S end=S NAME=VALUE ...; docs/reference/scenarios.md")] = ""


def check(parameters: Parameters) -> None:
    """Raise EventError naming the first line that is not an event."""
    parsed(parameters.events)


def announcements(parameters: Parameters) -> list[tuple[float, str, str]]:
    """Return (time s, kind, text) of what is to be reported when it acts and when it ends, in order of time."""
    found = []
    for event in parsed(parameters.events):
        found.append((event.start, event.kind, f"begins: {event.text}"))
        if event.end < 1e9:
            found.append((event.end, event.kind, f"ends: {event.text}"))
    return sorted(found)


def draw(parameters: Parameters, vehicle: Vehicle, seed: int, duration: float) -> NDArray[np.float64]:
    """Return the table of a flight of ``duration`` s, shape (n, 16); each event has streams of (seed, its place)."""
    events = parsed(parameters.events)
    head = np.zeros((1 + len(events), WIDTH))
    head[0, 0] = len(events)
    blocks = [head]
    row = len(head)
    for i, event in enumerate(events):
        block = _drawn(event, vehicle, seed, i, duration)
        head[1 + i, :VALUES] = KINDS[event.kind].code, event.start, event.end, row, len(block)
        head[1 + i, VALUES : VALUES + len(event.values)] = event.values
        wide = np.zeros((len(block), WIDTH))
        wide[:, : block.shape[1]] = block
        blocks.append(wide)
        row += len(block)
    return np.concatenate(blocks)


def _drawn(event: Event, vehicle: Vehicle, seed: int, place: int, duration: float) -> NDArray[np.float64]:
    def stream(channel: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM_FAMILY, place, channel)))

    length = max(min(event.end, duration) - event.start, 0.0)
    if event.kind == "dryden":
        wind, altitude, air_speed, _ = event.values
        turbulence = dryden.low_altitude(altitude, wind, air_speed)
        count = math.floor(length / TURBULENCE_PERIOD) + 2
        return dryden.realisation(turbulence, [stream(axis) for axis in range(3)], count, TURBULENCE_PERIOD)
    if event.kind == "held_gaussian":
        salt = int(stream(0).integers(2**31))
        return held_gaussian.draw(held_gaussian.Parameters(*event.values), vehicle, salt, length)
    if event.kind == "link":
        count = math.floor(length / LINK_PERIOD) + 2
        return np.column_stack([stream(0).random(count), stream(1).random(count)])
    return np.zeros((0, 1))


def sample(parameters: Parameters, table: NDArray[np.float64], time: float) -> Conditions:  # noqa: ARG001
    """Return all that acts at the flight time ``time`` in s; an event acts over [start, end)."""
    found = CALM
    for row in range(1, int(table[0, 0]) + 1):
        since = time - float(table[row, 1]) + EDGE
        if since >= 0.0 and time + EDGE < float(table[row, 2]):
            found = with_event(found, table, row, since)
    return found


def with_event(c: Conditions, table: NDArray[np.float64], row: int, since: float) -> Conditions:
    """Return conditions ``c`` with the event of ``row`` added, ``since`` s after its start."""
    force, torque, wind, payload_mass, rotors, limit, sensor, link = c
    code, first, second = float(table[row, 0]), float(table[row, VALUES]), float(table[row, VALUES + 1])
    if code <= DRYDEN:
        wind = add(wind, air(table, row, since))
    elif code == PUSH:
        force, torque = add(force, vector(table, row, VALUES)), add(torque, vector(table, row, VALUES + 3))
    elif code == GAUSSIAN:
        drawn = drawn_row(table, row, since, float(table[row, VALUES + 4]))
        force, torque = add(force, vector(table, drawn, 0)), add(torque, vector(table, drawn, 3))
    elif code == PAYLOAD:
        payload_mass += first
    elif code == ROTOR:
        rotors = Rotors(
            rotors.r1 * second if first == 1.0 else rotors.r1,
            rotors.r2 * second if first == 2.0 else rotors.r2,
            rotors.r3 * second if first == 3.0 else rotors.r3,
            rotors.r4 * second if first == 4.0 else rotors.r4,
        )
    elif code == BATTERY:
        limit *= 1.0 - (1.0 - first) * since / second if since < second else first
    elif code == LINK:
        drawn = drawn_row(table, row, since, LINK_PERIOD)
        lost = float(table[drawn, 1]) < float(table[row, VALUES + 2])
        link = LinkFault(link.delay + (first + second * float(table[drawn, 0])), link.lost or lost)
    elif code == FREEZE:
        sensor = SensorFault(True, sensor.offset_w, sensor.yaw_offset)
    elif code == JUMP:
        offset = add(sensor.offset_w, vector(table, row, VALUES))
        sensor = SensorFault(sensor.frozen, offset, sensor.yaw_offset + float(table[row, VALUES + 3]))
    return Conditions(force, torque, wind, payload_mass, rotors, limit, sensor, link)


def vector(table: NDArray[np.float64], row: int, first: int) -> Vec3:
    """Return three numbers of a row from column ``first``."""
    return Vec3(float(table[row, first]), float(table[row, first + 1]), float(table[row, first + 2]))


def drawn_row(table: NDArray[np.float64], row: int, since: float, period: float) -> int:
    """Return the row of what was drawn for the event of ``row`` and holds ``since`` s after its start."""
    index = math.floor(since / period)
    last = int(table[row, 4]) - 1
    return int(table[row, 3]) + (index if index < last else last)


def air(table: NDArray[np.float64], row: int, since: float) -> Vec3:
    """Return the velocity of the air in m/s, world frame, of a wind, gust or turbulence."""
    code = float(table[row, 0])
    if code == DRYDEN:
        at = drawn_row(table, row, since, TURBULENCE_PERIOD)
        after = drawn_row(table, row, since + TURBULENCE_PERIOD, TURBULENCE_PERIOD)
        part = since / TURBULENCE_PERIOD - math.floor(since / TURBULENCE_PERIOD)
        now, then = vector(table, at, 0), vector(table, after, 0)
        u, v = now.x + part * (then.x - now.x), now.y + part * (then.y - now.y)
        heading = float(table[row, VALUES + 3])
        c, s = math.cos(heading), math.sin(heading)
        return Vec3(c * u - s * v, s * u + c * v, now.z + part * (then.z - now.z))
    peak = vector(table, row, VALUES)
    if code == GUST:
        length = float(table[row, 2]) - float(table[row, 1])
        share = 0.5 * (1.0 - math.cos(2.0 * math.pi * since / length))
        return Vec3(share * peak.x, share * peak.y, share * peak.z)
    return peak


def parsed(text: str) -> list[Event]:
    """Return the events of ``text``; raises EventError naming the line, what was found and what was expected."""
    events = []
    for raw in text.splitlines():
        line = raw.partition("#")[0].strip()
        try:
            events += [_event(line)] if line else []
        except ParameterError as error:
            raise EventError(line, error) from error
    return events


def _event(line: str) -> Event:
    name, *words = line.split()
    if name not in KINDS:
        raise ParameterError(f"unknown kind {name!r}; expected one of {', '.join(KINDS)}")
    fields = {**TIMES, **KINDS[name].fields}
    given: dict[str, str] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or key not in fields:
            raise ParameterError(f"found {word!r}, expected some of {', '.join(f'{item}=' for item in fields)}")
        if key in given:
            raise ParameterError(f"{key} stands twice")
        given[key] = value
    start, end, *values = (part for key, field in fields.items() for part in _values(key, field, given.get(key)))
    if end <= start:
        raise ParameterError(f"end: found {end:g}, expected more than start, {start:g}")
    if name == "gust" and end == FOR_EVER:
        raise ParameterError("a gust needs end=")
    if name == "rotor" and values[0] != math.floor(values[0]):
        raise ParameterError(f"number: found {values[0]:g}, expected 1, 2, 3 or 4")
    return Event(line, name, start, end, tuple(values))


def _values(key: str, field: Number, text: str | None) -> list[float]:
    if text is None:
        if field.default is None:
            raise ParameterError(f"{key}= is missing")
        return [field.default] * field.size
    parts = text.split(",") if field.size > 1 else [text]
    if len(parts) != field.size:
        raise ParameterError(f"{key}: found {text!r}, expected x,y,z in {field.unit}")
    return [_number(key, field, part) for part in parts]


def _number(key: str, field: Number, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not field.low <= value <= field.high:
        expected = f"a number in [{field.low:g}, {field.high:g}] {field.unit}".rstrip()
        raise ParameterError(f"{key}: found {text!r}, expected {expected}")
    return value
