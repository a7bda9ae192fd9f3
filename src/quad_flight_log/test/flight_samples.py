"""Sample messages and bags for the tests; every payload is encoded by rosbags, which shares no code with us."""

import time
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from quad_flight_log.writer import BagWriter, Definition

OUR_MESSAGES = Path(__file__).parents[2] / "quad_msgs" / "msg"
STEP_NS = 2_000_000


@cache
def typestore() -> Any:
    """Return rosbags' own Jazzy types with ours added."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for path in sorted(OUR_MESSAGES.glob("*.msg")):
        store.register(get_types_from_msg(path.read_text(), f"quad_msgs/msg/{path.stem}"))
    return store


@cache
def definition(type_name: str) -> Definition:
    """Return a definition without installed interfaces, text and hash as rosbags makes them."""
    package, *_, name = type_name.split("/")
    full = f"{package}/msg/{name}"
    text = str(typestore().generate_msgdef(full, ros_version=2)[0])
    if package == "quad_msgs":  # with the comments, which say what is no part of the payload hash
        text = (OUR_MESSAGES / f"{name}.msg").read_text() + text[text.find("=" * 80) :] * ("=" * 80 in text)
    return Definition(full, text, typestore().hash_rihs01(full))


def message(type_name: str, **values: Any) -> Any:
    """Return a rosbags message with ``values``, dicts for the messages in it; the rest is zero, empty or false."""
    forms = typestore().fielddefs[type_name][1]
    given = {
        name: message(form[1], **values[name]) if isinstance(values[name], dict) else values[name]
        for name, form in forms
        if name in values
    }
    assert given.keys() == values.keys(), f"{type_name} has no {values.keys() - given.keys()}"
    return typestore().types[type_name](**{name: given.get(name, _blank(form)) for name, form in forms})


def _blank(form: Any) -> Any:
    kind, detail = int(form[0]), form[1]
    if kind == 1:
        return {"string": "", "bool": False}.get(detail[0], 0.0 if detail[0].startswith("float") else 0)
    if kind == 2:
        return message(detail)
    item, count = detail
    if kind == 3 and int(item[0]) == 1:
        return np.zeros(count, item[1][0])
    return np.zeros(0, item[1][0]) if int(item[0]) == 1 and item[1][0] != "string" else []


def time_of(stamp_ns: int) -> Any:
    """Return a stamp in ns as a message."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return message("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)


def stamp(step: int) -> Any:
    """Return the stamp of a plant step."""
    return time_of(step * STEP_NS)


def encoded(sample: Any) -> bytes:
    """Return the CDR bytes of a rosbags message."""
    return bytes(typestore().serialize_cdr(sample, sample.__msgtype__))


def state(step: int, rng: np.random.Generator) -> Any:
    return message(
        "quad_msgs/msg/VehicleState",
        stamp=stamp(step), step=step, p_w=rng.normal(size=3), v_w=rng.normal(size=3),
        q_wb=rng.normal(size=4), omega_b=rng.normal(size=3),
    )  # fmt: skip


def wrench_of(time: Any, thrust: float, torque: Iterable[float] = (0.0, 0.0, 0.0)) -> Any:
    """Return the vehicle's command in N and N m."""
    both = {"force": {"z": float(thrust)}, "torque": dict(zip("xyz", map(float, torque), strict=True))}
    return message("geometry_msgs/msg/WrenchStamped", header={"stamp": time, "frame_id": "base_link"}, wrench=both)


def wrench(step: int, rng: np.random.Generator) -> Any:
    return wrench_of(stamp(step), rng.normal(), rng.normal(size=3))


TYPES = {
    "state": "quad_msgs/msg/VehicleState",
    "truth": "quad_msgs/msg/VehicleState",
    "disturbance": "quad_msgs/msg/Disturbance",
    "actuation": "quad_msgs/msg/Actuation",
    "reference": "quad_msgs/msg/TrajectoryPoint",
    "attitude_setpoint": "quad_msgs/msg/AttitudeThrust",
    "wrench_setpoint": "geometry_msgs/msg/WrenchStamped",
    "position_controller/internals": "quad_msgs/msg/PositionInternals",
    "attitude_controller/internals": "quad_msgs/msg/AttitudeInternals",
}


def of_row(topic: str, row: np.void) -> Any:
    """Return a row of a topic of TYPES, with ``stamp_ns``, as its message."""
    stamp = time_of(int(row["stamp_ns"]))
    if topic == "wrench_setpoint":
        return wrench_of(stamp, row["thrust"], row["torque_b"])
    fields = {name for name, _ in typestore().fielddefs[TYPES[topic]][1]}
    values = {name: row[name] for name in row.dtype.names if name in fields}
    values = {name: value.item() if value.ndim == 0 else np.array(value) for name, value in values.items()}
    return message(TYPES[topic], **{**values, "stamp": stamp})


def internals(step: int, rng: np.random.Generator) -> Any:
    return message(
        "quad_msgs/msg/AttitudeInternals",
        stamp=stamp(step), step=step, sliding_variable=rng.normal(size=3),
        torque_limited=rng.random(3) < 0.5, extra=rng.normal(size=4),
    )  # fmt: skip


def event(step: int, text: str) -> Any:
    return message("quad_msgs/msg/FlightEvent", stamp=stamp(step), node="/test", severity=1, kind="k", text=text)


def over(step: int, state: int = 2, **values: Any) -> tuple[str, Any]:
    """Return (topic, message) of a flight that ended, or of another ``state``, with the last step ``step``."""
    kind = "quad_msgs/msg/FlightState"
    return "/flight/state", message(kind, stamp=stamp(step), step=step, state=state, **values)


def samples(steps: int, seed: int = 1) -> list[tuple[str, Any]]:
    """Return (topic, message) of a small flight in the order of arrival."""
    rng = np.random.default_rng(seed)
    found: list[tuple[str, Any]] = []
    for step in range(steps):
        found.append(("/state", state(step, rng)))
        found.append(("/wrench_setpoint", wrench(step, rng)))
        if step % 5 == 0:
            found.append(("/attitude_controller/internals", internals(step, rng)))
        if step % 7 == 0:
            found.append(("/flight/events", event(step, "ä" * step)))
    return found


def write_bag(
    directory: Path,
    flown: Iterable[tuple[str, Any]],
    *,
    pause_every: int = 0,
    close: bool = True,
    log_ns: Callable[[int, Any], int] = lambda index, _: index * 1000,
    notes: Mapping[str, str] = MappingProxyType({}),
) -> Path:
    """Write a bag of rosbags messages; ``pause_every`` messages the writer is given time to flush a chunk."""
    bag = BagWriter(directory, metadata={"run_id": "test", "seed": "7", **notes}, flush_period=0.05)
    handles: dict[str, int] = {}
    for index, (topic, sample) in enumerate(flown):
        if topic not in handles:
            handles[topic] = bag.add_topic(topic, definition(sample.__msgtype__))
        time_ns = log_ns(index, sample)
        bag.write(handles[topic], encoded(sample), time_ns, time_ns + 7)
        if pause_every and index % pause_every == pause_every - 1:
            time.sleep(0.12)
    if not close:
        while bag.backlog:
            time.sleep(0.02)
        with bag._lock:
            bag._writer.flush()
        copy = directory.parent / f"{directory.name}_part"
        copy.mkdir()
        target = copy / f"{copy.name}_0.mcap.part"
        target.write_bytes(bag.path.read_bytes())
        bag.close()
        return target
    bag.close({"outcome": "ended", **notes})
    assert bag.error == ""
    return bag.path
