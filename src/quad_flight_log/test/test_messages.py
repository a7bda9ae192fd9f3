"""Tables of messages of many types, of equal and varying shape, in both byte orders: the values that were encoded."""

import string
from typing import Any

import flight_samples
import foreign_readers
import numpy as np
import pytest

from quad_flight_log.bag.messages import MessageType, flat_columns, message_type
from quad_flight_log.errors import SchemaError

TYPES = [
    *(f"quad_msgs/msg/{path.stem}" for path in sorted(flight_samples.OUR_MESSAGES.glob("*.msg"))),
    "builtin_interfaces/msg/Time",
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseArray",
    "nav_msgs/msg/Path",
    "rcl_interfaces/msg/ParameterEvent",
    "sensor_msgs/msg/BatteryState",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/Empty",
    "std_msgs/msg/UInt8MultiArray",
    "tf2_msgs/msg/TFMessage",
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    "visualization_msgs/msg/MarkerArray",
]
LETTERS = string.ascii_letters + "äßé"


def drawn(type_name: str, rng: np.random.Generator, size: int) -> Any:
    """Return a message with random content; sequences and strings have ``size`` items, or up to 4 if it is negative."""
    store = flight_samples.typestore()
    return store.types[type_name](
        **{name: _value(form, rng, size) for name, form in store.fielddefs[type_name][1] if not name.isupper()}
    )


def _value(form: Any, rng: np.random.Generator, size: int) -> Any:
    kind, detail = int(form[0]), form[1]
    if kind == 1:
        return _number(detail[0], rng, size)
    if kind == 2:
        return drawn(detail, rng, size)
    item, bound = detail
    count = bound if kind == 3 else _count(rng, size)
    values = [_value(item, rng, size) for _ in range(count)]
    if int(item[0]) == 1 and item[1][0] != "string":
        return np.array(values, np.dtype(_codes(item[1][0])))
    return values


def _codes(name: str) -> str:
    return {"octet": "uint8", "byte": "uint8", "char": "uint8"}.get(name, name)


def _count(rng: np.random.Generator, size: int) -> int:
    return size if size >= 0 else int(rng.integers(0, 5))


def _number(name: str, rng: np.random.Generator, size: int) -> Any:
    if name == "string":
        return "".join(rng.choice(list(LETTERS), _count(rng, size)))
    if name == "bool":
        return bool(rng.integers(2))
    code = np.dtype(_codes(name))
    if code.kind == "f":
        return float(np.array(rng.normal(), code))
    limits = np.iinfo(code)
    return int(rng.integers(limits.min // 4, limits.max // 4))


def type_of(type_name: str) -> MessageType:
    return message_type(type_name, flight_samples.definition(type_name).text)


def table(kind: MessageType, payloads: list[bytes]) -> Any:
    return kind.table(payloads, range(len(payloads)), "test")


def digest(rows: list[Any]) -> Any:
    return foreign_readers.digests(("topic", row) for row in rows)


@pytest.mark.parametrize("size", [0, 3, -1], ids=["empty", "equal", "varying"])
@pytest.mark.parametrize("type_name", TYPES)
def test_values_are_those_that_were_encoded(type_name, size):
    rng = np.random.default_rng(len(type_name))
    store, kind = flight_samples.typestore(), type_of(type_name)
    messages = [drawn(type_name, rng, size) for _ in range(6)]
    for little in (True, False):
        payloads = [bytes(store.serialize_cdr(message, type_name, little_endian=little)) for message in messages]
        found = table(kind, payloads)
        if type_name != "std_msgs/msg/Empty":
            assert digest(list(found[list(kind.fields)])) == digest(messages)
        assert len(found) == len(messages)
        assert all(len(values) == len(messages) for _, values in flat_columns(found))
        assert found.dtype.isnative or found.dtype.hasobject


@pytest.mark.parametrize("type_name", [name for name in TYPES if name != "std_msgs/msg/Empty"])
def test_a_payload_that_is_too_short_is_an_error(type_name):
    payload = flight_samples.encoded(drawn(type_name, np.random.default_rng(1), 2))
    kind = type_of(type_name)
    for length in {4, len(payload) // 2, len(payload) - 4}:
        if length < len(payload) - 3:
            with pytest.raises(SchemaError):
                table(kind, [payload[:length]])


def test_empty_tables_have_the_columns_of_the_type():
    kind = type_of("geometry_msgs/msg/WrenchStamped")
    assert [name for name, _ in flat_columns(table(kind, []))] == [
        "log_ns", "stamp_ns", "header.stamp.sec", "header.stamp.nanosec", "header.frame_id",
        "wrench.force.x", "wrench.force.y", "wrench.force.z",
        "wrench.torque.x", "wrench.torque.y", "wrench.torque.z",
    ]  # fmt: skip


@pytest.mark.parametrize("field", ["float64[0] x", "a/B[0] x"])
def test_an_array_of_nothing_is_refused(field):
    text = f"{field}\nuint8 y\n" + "=" * 80 + "\nMSG: a/B\nuint8 z\n"
    with pytest.raises(SchemaError, match="'x' is an array of 0 items"):
        message_type("a/msg/A", text)


@pytest.mark.parametrize("name", ["quad_msgs/msg/VehicleState", "quad_msgs/msg/AttitudeInternals"])
def test_the_number_of_the_run_is_masked_and_nothing_else(name):
    rng = np.random.default_rng(4)
    kind = type_of(name)
    one, other = drawn(name, rng, 3), drawn(name, rng, 3)
    same = flight_samples.message(name, **{**vars(one), "run": (one.run + 1) % 1000})
    payloads = [flight_samples.encoded(message) for message in (one, same, other)]
    hashed = [kind.hashed(payload) for payload in payloads]
    assert hashed[0] == hashed[1] != hashed[2]
    assert payloads[0] != payloads[1]
    at = 4 + 8 + 8  # encapsulation, stamp, step
    assert hashed[0] == payloads[0][:at] + bytes(4) + payloads[0][at + 4 :]
