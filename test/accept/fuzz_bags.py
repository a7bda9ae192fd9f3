"""Bags drawn by Hypothesis: flights and bags of made-up types, changed at every level, from a field to the file."""

import struct
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from flying import ROOT
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

sys.path.insert(0, str(ROOT / "src" / "quad_flight_log" / "test"))
import drawn_flights
import flight_samples

NUMBERS = [0.0, -0.0, 5e-324, 1e308, -1e300, float("nan"), float("inf"), float("-inf"), 1.0]
TEXTS = st.text(max_size=12) | st.sampled_from(["", "\x1b[31m", "\n", "a" * 5000, "../../x", "NaN", "1e999", "state"])
# without byte, which is unsigned in ROS 2 and which rosbags reads as signed
BASES = ["float64", "float32", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "bool"]
BASES += ["string", "char", "builtin_interfaces/Time", "wstring", "a/B"]
_TIME = "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"


class Bag(NamedTuple):
    """A bag as it is written. ``topics``: {name: [type, definition, payloads]}; ``damage``: edits of the file."""

    topics: dict[str, list]
    notes: dict[str, str]
    parameters: str
    log_times: list[int]
    options: dict
    damage: list[tuple[str, int, bytes]]


@cache
def whole_flight():
    """Return {topic: (type, definition, payloads)} of a short flight."""
    found = {}
    for name, message in drawn_flights.messages(drawn_flights.tables(60)):
        kind = message.__msgtype__
        found.setdefault(name, (kind, flight_samples.definition(kind).text, []))[2].append(
            flight_samples.encoded(message)
        )
    return found


@st.composite
def definitions(draw):
    """Return the definition of a type with a few fields."""
    forms = st.sampled_from(["", "", "", "[]", "[3]", "[<=4]", "[0]", "[1000]"])
    lines = [f"{draw(st.sampled_from(BASES))}{draw(forms)} f{index}" for index in range(draw(st.integers(0, 6)))]
    if draw(st.booleans()):
        lines.insert(0, "builtin_interfaces/Time stamp")
    inner = draw(st.sampled_from(["float64 x\nstring s\n", "uint8 u\nfloat64[2] y\n", ""]))
    return "\n".join(lines) + "\n" + _TIME + "=" * 80 + "\nMSG: a/B\n" + inner


@st.composite
def of_made_up_types(draw):
    """Return topics of made-up types whose payloads are random bytes behind the head of a message."""
    topics = {}
    for index in range(draw(st.integers(1, 3))):
        rng = np.random.default_rng(draw(st.integers(0, 2**32)))
        size = st.integers(0, 80)
        payloads = [b"\0\1\0\0" + rng.bytes(draw(size)) for _ in range(draw(st.integers(0, 12)))]
        name = draw(st.sampled_from([f"/t{index}", "/truth", "/state", "/reference", "/flight/events"]))
        topics[name] = ["a/msg/A", draw(definitions()), payloads]
    return topics


def _poke(draw, topics):
    name = draw(st.sampled_from(sorted(topics)))
    payloads = topics[name][2]
    if not payloads:
        return
    index = draw(st.integers(0, len(payloads) - 1))
    payload = bytearray(payloads[index])
    how = draw(st.integers(0, 6))
    at = draw(st.integers(0, max(0, len(payload) - 1)))
    if how == 0:
        payload[at : at + 1] = draw(st.binary(min_size=1, max_size=4))
    elif how == 1:
        at = 4 + (at - 4) // 8 * 8
        payload[at : at + 8] = struct.pack("<d", draw(st.sampled_from(NUMBERS)))
    elif how == 2:
        payload = payload[:at]
    elif how == 3:
        payload += draw(st.binary(max_size=12))
    elif how == 4:
        payload[:2] = draw(st.sampled_from([b"\0\0", b"\0\7", b"\xff\xff"]))
    elif how == 5:
        payload[at : at + 4] = struct.pack("<I", draw(st.sampled_from([0, 1, 2**31, 2**32 - 1, 999_999_999])))
    else:
        payloads.insert(index, bytes(payload))
    payloads[index] = bytes(payload)


def _retype(draw, topics):
    name = draw(st.sampled_from(sorted(topics)))
    lines = topics[name][1].splitlines()
    at = draw(st.integers(0, max(0, len(lines) - 1)))
    base, form = draw(st.sampled_from(BASES)), draw(st.sampled_from(["", "[]", "[7]"]))
    line = f"{base}{form} {draw(st.sampled_from(['x', 'stamp', 'step', 'p_w']))}"
    instead = [[], [line], [lines[at]] * 2 if lines else [], ["?"]]
    lines[at : at + draw(st.integers(0, 1))] = draw(st.sampled_from(instead))
    topics[name][1] = "\n".join(lines)


def _rename(draw, topics):
    name = draw(st.sampled_from(sorted(topics)))
    new = draw(st.sampled_from(sorted(whole_flight())) | TEXTS.map(lambda text: "/" + text))
    topics.setdefault(new, topics.pop(name))


def _mix(draw, topics):
    first, second = draw(st.sampled_from(sorted(topics))), draw(st.sampled_from(sorted(topics)))
    place = draw(st.integers(0, 2))
    topics[first][place], topics[second][place] = topics[second][place], topics[first][place]


def _thin(draw, topics):
    payloads = topics[draw(st.sampled_from(sorted(topics)))][2]
    how = draw(st.integers(0, 3))
    if how == 0:
        del payloads[draw(st.integers(0, max(0, len(payloads) - 1))) :]
    elif how == 1:
        payloads.reverse()
    elif how == 2:
        del payloads[:: draw(st.integers(1, 3))]
    elif payloads:
        payloads[:] = payloads[:1] * len(payloads)


@st.composite
def bags(draw):
    """Return a bag: a flight or made-up types, with up to six changes."""
    flight = {name: [kind, text, list(payloads)] for name, (kind, text, payloads) in whole_flight().items()}
    topics = flight if draw(st.booleans()) else draw(of_made_up_types())
    for _ in range(draw(st.integers(0, 6))):
        change = draw(st.sampled_from([_poke, _poke, _poke, _retype, _rename, _mix, _thin]))
        if topics:
            change(draw, topics)
    keys = st.sampled_from(["outcome", "seed", "limit.position_rmse", "plant_period_ns", "namespace", "mode", "run_id"])
    notes = draw(st.dictionaries(keys | TEXTS, TEXTS, max_size=4))
    parameters = draw(st.sampled_from(["", "simulator: {ros__parameters: {flight.seed: 7}}\n", "a: [", "- 1"]) | TEXTS)
    times = draw(st.lists(st.sampled_from([0, 1, 10**9, 2**63 - 1, 2**63, 2**64 - 1]), max_size=3))
    options = {
        "chunk_size": draw(st.sampled_from([50, 2000, 1 << 20])),
        "compression": draw(st.sampled_from(list(CompressionType))),
        "use_chunking": draw(st.booleans()),
        "enable_crcs": draw(st.booleans()),
        "enable_data_crcs": draw(st.booleans()),
    }
    edit = st.tuples(
        st.sampled_from(["cut", "flip", "insert"]), st.integers(0, 2**20), st.binary(min_size=1, max_size=9)
    )
    damage = draw(st.one_of(st.just([]), st.just([]), st.lists(edit, max_size=3)))
    return Bag(topics, notes, parameters, times, options, damage)


def write(bag: Bag, path: Path) -> None:
    """Write the bag, damage and all."""
    with path.open("wb") as stream:
        writer = Writer(stream, **bag.options)
        writer.start("ros2", "some tool")
        writer.add_metadata("quad", bag.notes)
        if bag.parameters:
            text = bag.parameters.encode("utf-8", "surrogatepass")
            writer.add_attachment(0, 0, "parameters.yaml", "application/yaml", text)
        for name, (kind, text, payloads) in bag.topics.items():
            schema = writer.register_schema(kind, "ros2msg", text.encode("utf-8", "surrogatepass"))
            channel = writer.register_channel(name, "cdr", schema, {})
            for index, payload in enumerate(payloads):
                when = bag.log_times[index] if index < len(bag.log_times) else index * 1000
                writer.add_message(channel, when, payload, index)
        writer.finish()
    data = bytearray(path.read_bytes())
    for kind, place, bytes_ in bag.damage:
        at = place % (len(data) + 1)
        if kind == "cut":
            del data[at:]
        elif kind == "flip":
            data[at : at + 1] = bytes_[:1]
        else:
            data[at:at] = bytes_
    path.write_bytes(data)
