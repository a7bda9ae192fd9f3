"""Disturbance ``timeline``: wind, payload and failures as events (``timeline_events``), all drawn before take-off.

The table of a flight: row 0 holds the number of events, then a row per event (code, start, end, first row and number of
rows of what was drawn for it, its values), then what was drawn.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.parameters import Text
from quad_core.types import CALM, Conditions, LinkFault, Payload, Rotors, SensorFault, Vec3
from quad_core.vehicle import Vehicle
from quad_dynamics import dryden, held_gaussian
from quad_dynamics.timeline_events import (
    BATTERY,
    DRYDEN,
    FREEZE,
    GAUSSIAN,
    GUST,
    KINDS,
    LINK,
    PAYLOAD,
    PUSH,
    ROTOR,
    Event,
    parsed,
)

STREAM_FAMILY = 3
WIDTH = 16
VALUES = 5
TURBULENCE_PERIOD = 0.01
LINK_PERIOD = 0.002
EDGE = 1e-9


class Parameters(NamedTuple):
    """The events of a flight."""

    events: Annotated[
        str, Text("events, one a line: KIND start=S end=S NAME=VALUE ...; see docs/reference/scenarios.md")
    ] = ""


def check(parameters: Parameters) -> None:
    """Raise ParameterError naming the first line that is not an event."""
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
    """Return all that acts at ``time`` s since take-off; an event acts over [start, end)."""
    found = CALM
    for row in range(1, int(table[0, 0]) + 1):
        since = time - float(table[row, 1]) + EDGE
        if since >= 0.0 and time + EDGE < float(table[row, 2]):
            found = with_event(found, table, row, since)
    return found


def with_event(c: Conditions, table: NDArray[np.float64], row: int, since: float) -> Conditions:
    """Return conditions ``c`` with the event of ``row`` added, ``since`` s after its start."""
    code = float(table[row, 0])
    if code <= DRYDEN:
        return blown(c, air(table, row, since))
    if code == PUSH:
        return pushed(c, vector(table, row, VALUES), vector(table, row, VALUES + 3))
    if code == GAUSSIAN:
        drawn = drawn_row(table, row, since, float(table[row, VALUES + 4]))
        return pushed(c, vector(table, drawn, 0), vector(table, drawn, 3))
    if code == PAYLOAD:
        return carrying(c, float(table[row, VALUES]), vector(table, row, VALUES + 1), vector(table, row, VALUES + 4))
    if ROTOR <= code <= BATTERY:
        return weakened(c, table, row, since)
    if code == LINK:
        return late(c, table, row, since)
    return misread(c, code == FREEZE, table, row)


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


def plus(a: Vec3, b: Vec3) -> Vec3:
    """Return the sum of two vectors."""
    return Vec3(a.x + b.x, a.y + b.y, a.z + b.z)


def blown(c: Conditions, wind_w: Vec3) -> Conditions:
    """Return ``c`` with more wind in m/s."""
    wind = plus(c.wind_w, wind_w)
    return Conditions(c.force_w, c.torque_b, wind, c.payload, c.rotor_effectiveness, c.thrust_limit, c.sensor, c.link)


def pushed(c: Conditions, force_w: Vec3, torque_b: Vec3) -> Conditions:
    """Return ``c`` with more force N (world) and torque N m (body)."""
    force, torque = plus(c.force_w, force_w), plus(c.torque_b, torque_b)
    return Conditions(force, torque, c.wind_w, c.payload, c.rotor_effectiveness, c.thrust_limit, c.sensor, c.link)


def carrying(c: Conditions, mass: float, offset: Vec3, inertia: Vec3) -> Conditions:
    """Return ``c`` with one more payload: kg, m from the centre (body), kg m^2 about its own centre."""
    x, y, z = offset.x, offset.y, offset.z
    p = c.payload
    payload = Payload(
        p.mass + mass,
        plus(p.moment_b, Vec3(mass * x, mass * y, mass * z)),
        plus(
            p.inertia_b,
            Vec3(
                inertia.x + mass * (y * y + z * z),
                inertia.y + mass * (x * x + z * z),
                inertia.z + mass * (x * x + y * y),
            ),
        ),
        plus(p.products_b, Vec3(mass * y * z, mass * x * z, mass * x * y)),
    )
    return Conditions(c.force_w, c.torque_b, c.wind_w, payload, c.rotor_effectiveness, c.thrust_limit, c.sensor, c.link)


def weakened(c: Conditions, table: NDArray[np.float64], row: int, since: float) -> Conditions:
    """Return ``c`` with a rotor that works worse, or a battery that allows less."""
    e, limit = c.rotor_effectiveness, c.thrust_limit
    if float(table[row, 0]) == ROTOR:
        number, factor = float(table[row, VALUES]), float(table[row, VALUES + 1])
        e = Rotors(
            e.r1 * factor if number == 1.0 else e.r1,
            e.r2 * factor if number == 2.0 else e.r2,
            e.r3 * factor if number == 3.0 else e.r3,
            e.r4 * factor if number == 4.0 else e.r4,
        )
    else:
        end, sag = float(table[row, VALUES]), float(table[row, VALUES + 1])
        limit *= 1.0 - (1.0 - end) * since / sag if since < sag else end
    return Conditions(c.force_w, c.torque_b, c.wind_w, c.payload, e, limit, c.sensor, c.link)


def late(c: Conditions, table: NDArray[np.float64], row: int, since: float) -> Conditions:
    """Return ``c`` with a worse command link."""
    drawn = drawn_row(table, row, since, LINK_PERIOD)
    delay = float(table[row, VALUES]) + float(table[row, VALUES + 1]) * float(table[drawn, 0])
    lost = float(table[drawn, 1]) < float(table[row, VALUES + 2])
    link = LinkFault(c.link.delay + delay, c.link.lost or lost)
    return Conditions(c.force_w, c.torque_b, c.wind_w, c.payload, c.rotor_effectiveness, c.thrust_limit, c.sensor, link)


def misread(c: Conditions, frozen: bool, table: NDArray[np.float64], row: int) -> Conditions:
    """Return ``c`` with sensors frozen or jumped."""
    offset, yaw = c.sensor.offset_w, c.sensor.yaw_offset
    if not frozen:
        offset = plus(offset, vector(table, row, VALUES))
        yaw += float(table[row, VALUES + 3])
    sensor = SensorFault(c.sensor.frozen or frozen, offset, yaw)
    return Conditions(c.force_w, c.torque_b, c.wind_w, c.payload, c.rotor_effectiveness, c.thrust_limit, sensor, c.link)
