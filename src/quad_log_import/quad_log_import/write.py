"""A recording of others as a bag: each sample at its own time, and a `state` for what reads flights of ours.

| topic | type | what |
|---|---|---|
| imu | sensor_msgs/Imu | specific force, body rates; -1 in a covariance: not in this sample |
| motors | actuator_msgs/Actuators | commands in 0..1 (`normalized`), speeds in rad/s (`velocity`) |
| attitude, attitude_target, position, velocity | QuaternionStamped, PointStamped, Vector3Stamped | as logged |
| thrust_target | geometry_msgs/Vector3Stamped | asked for, share of the largest thrust along body axes |
| battery_state | sensor_msgs/BatteryState | voltage |
| state | quad_msgs/VehicleState | at the times of the attitude, the rest between its samples, or their change |
| reference | quad_msgs/TrajectoryPoint | where the log has set points |
"""

import hashlib
import os
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from quad_core.types import VehicleState
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import CURVE, ROTORS
from quad_flight_log.writer import BagWriter, Definition
from quad_log_import.maps import MOVES, Recording, Series, derivative, has_both_sides, interpolated, span_of, turning

Floats = NDArray[np.float64]
_ACTUATORS = "std_msgs/Header header\nfloat64[] position\nfloat64[] velocity\nfloat64[] normalized\n"
_UNKNOWN = -1.0


@cache
def _store() -> Any:
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(_ACTUATORS, "actuator_msgs/msg/Actuators"))
    prefixes = [Path(prefix) for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    folder = next((each for prefix in prefixes if (each := prefix / "share/quad_msgs/msg").is_dir()), None)
    if folder is None:
        raise FlightLogError("quad_msgs is in no prefix of AMENT_PREFIX_PATH: source scripts/env.sh")
    for name in ("VehicleState", "TrajectoryPoint"):
        store.register(
            get_types_from_msg((folder / f"{name}.msg").read_text(encoding="utf-8"), f"quad_msgs/msg/{name}")
        )
    return store


def _definition(name: str) -> Definition:
    return Definition(name, str(_store().generate_msgdef(name, ros_version=2)[0]), _store().hash_rihs01(name))


def write_recording(recording: Recording, doubts: list[str], source: Path, map_name: str, out: Path) -> Path:
    """Write a bag into the new folder ``out``; returns it. Raises FlightLogError if it cannot be written."""
    facts = {"imported_from": source.name, "map": map_name, ROTORS: recording.rotors, CURVE: f"{recording.curve:g}"}
    if source.is_file():
        facts["sha256_of_source"] = hashlib.sha256(source.read_bytes()).hexdigest()
    facts |= {f"source.{name}": signal.source for name, signal in recording.signals.items()}
    facts |= {f"doubt.{number:02}": text for number, text in enumerate(doubts, 1)}
    facts |= {f"note.{number:02}": text for number, text in enumerate(recording.notes, 1)}
    messages = sorted(_messages(recording), key=lambda each: each[0])
    writer = BagWriter(out, metadata=facts)
    topics: dict[str, int] = {}
    for ns, topic, message in messages:
        if topic not in topics:
            topics[topic] = writer.add_topic(f"/{topic}", _definition(message.__msgtype__))
        while writer.backlog > 16 << 20:
            time.sleep(0.01)
        writer.write(topics[topic], bytes(_store().serialize_cdr(message, message.__msgtype__)), ns)
    writer.close()
    if writer.error:
        raise FlightLogError(f"{out}: {writer.error}")
    return out


def _messages(recording: Recording) -> list[tuple[int, str, Any]]:
    signals, out = recording.signals, list[tuple[int, str, Any]]()
    types = _store().types
    imu = _imu(signals.get("specific_force"), signals.get("body_rates"))
    out += [(ns, "imu", message) for ns, message in imu]
    vector, point, quaternion = (types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Point", "Quaternion"))
    for name, kind, field, inner, frame in (
        ("attitude", "QuaternionStamped", "quaternion", quaternion, "map"),
        ("attitude_target", "QuaternionStamped", "quaternion", quaternion, "map"),
        ("position", "PointStamped", "point", point, "map"),
        ("velocity", "Vector3Stamped", "vector", vector, "map"),
        ("thrust_target", "Vector3Stamped", "vector", vector, "base_link"),
    ):
        for ns, row in _rows(signals.get(name)):
            out.append(
                (ns, name, types[f"geometry_msgs/msg/{kind}"](header=_header(ns, frame), **{field: inner(*row)}))
            )
    none = np.zeros(0)
    for name, field in (("motors", "normalized"), ("speeds", "velocity")):
        if name == "speeds" and "motors" in signals:
            continue  # one topic: what was commanded; speeds too where they come with each command
        for index, (ns, row) in enumerate(_rows(signals.get(name))):
            parts = {"position": none, "velocity": none, "normalized": none, field: np.array(row)}
            beside = signals.get("speeds")
            if name == "motors" and beside is not None and len(beside.t) == len(signals["motors"].t):
                parts["velocity"] = beside.values[index]
            out.append((ns, "motors", types["actuator_msgs/msg/Actuators"](header=_header(ns, "base_link"), **parts)))
    out += [(ns, "battery_state", _battery(ns, row[0])) for ns, row in _rows(signals.get("voltage"))]
    states = _states(recording)
    return out + states + _references(signals, np.array([each[0] for each in states]))


def _rows(signal: Series | None) -> list[tuple[int, list[float]]]:
    return (
        []
        if signal is None
        else list(zip(np.round(signal.t * 1e9).astype(int).tolist(), signal.values.tolist(), strict=True))
    )


def _header(ns: int, frame: str) -> Any:
    return _store().types["std_msgs/msg/Header"](stamp=_time(ns), frame_id=frame)


def _time(ns: int) -> Any:
    return _store().types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)


def _imu(force: Series | None, rates: Series | None) -> list[tuple[int, Any]]:
    types, none = _store().types, np.array([_UNKNOWN, *[0.0] * 8])
    vector, known = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    forces, turns = dict(_rows(force)), dict(_rows(rates))
    return [
        (
            ns,
            types["sensor_msgs/msg/Imu"](
                header=_header(ns, "base_link"),
                orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
                orientation_covariance=none,
                angular_velocity=vector(*turns.get(ns, (0.0, 0.0, 0.0))),
                angular_velocity_covariance=known if ns in turns else none,
                linear_acceleration=vector(*forces.get(ns, (0.0, 0.0, 0.0))),
                linear_acceleration_covariance=known if ns in forces else none,
            ),
        )
        for ns in sorted(forces.keys() | turns.keys())
    ]


def _battery(ns: int, voltage: float) -> Any:
    kind, nan = _store().types["sensor_msgs/msg/BatteryState"], float("nan")
    cells = np.zeros(0, np.float32)
    return kind(
        header=_header(ns, ""), voltage=voltage, temperature=nan, current=nan, charge=nan, capacity=nan,
        design_capacity=nan,
        percentage=nan, power_supply_status=0, power_supply_health=0, power_supply_technology=0, present=True,
        cell_voltage=cells, cell_temperature=cells, location="", serial_number="",
    )  # fmt: skip


def _states(recording: Recording) -> list[tuple[int, str, Any]]:
    if not recording.signals.keys() >= MOVES.keys():
        return []
    attitude, position = (recording.signals[name] for name in ("attitude", "position"))
    made = {
        "velocity": _inner(position._replace(values=derivative(position.t, position.values, 1))),
        "body_rates": _inner(attitude._replace(values=turning(attitude.t, attitude.values))),
    }
    others = [position, *(recording.signals.get(name, found) for name, found in made.items())]
    if not all(len(each.t) for each in others):
        return []
    inside = (attitude.t >= max(each.t[0] for each in others)) & (attitude.t <= min(each.t[-1] for each in others))
    t = attitude.t[inside]
    p, v, w = (interpolated(each.t, each.values, t) for each in others)
    kind, out, rest = _store().types["quad_msgs/msg/VehicleState"], [], VehicleState()._asdict()
    for step, (ns, q) in enumerate(zip(np.round(t * 1e9).astype(int).tolist(), attitude.values[inside], strict=True)):
        known = {"p_w": p[step], "v_w": v[step], "q_wb": q, "omega_b": w[step]}
        message = kind(stamp=_time(ns), step=step, run=0, **(rest | known))
        out.append((ns, "state", message))
    return out


def _inner(signal: Series) -> Series:
    """Return a change without the ends, where there is none."""
    inside = has_both_sides(signal.t, span_of(signal.t))
    return Series(signal.t[inside], signal.values[inside], signal.source)


def _references(signals: Mapping[str, Series], ns: NDArray[np.int64]) -> list[tuple[int, str, Any]]:
    """Return set points at the times ``ns`` of the states, each the last one before; none where that is too old."""
    place = signals.get("reference_position")
    if place is None or not len(ns):
        return []
    t = 1e-9 * ns.astype(np.float64)
    index = _last(place, t)
    kind, zero, out = _store().types["quad_msgs/msg/TrajectoryPoint"], np.zeros(3), []
    oldest = max(1.0, 5.0 * float(np.median(np.diff(place.t, append=place.t[-1]))))
    held = [_held(signals.get(f"reference_{name}"), t) for name in ("velocity", "acceleration", "yaw")]
    for step, (at, row, v, a, yaw) in enumerate(zip(ns.tolist(), index, *held, strict=True)):
        if row < 0 or at * 1e-9 - place.t[row] > oldest or not np.isfinite(place.values[row]).all():
            continue
        message = kind(
            stamp=_time(at), step=step, run=0, next_step=step + 1, trajectory_time=at * 1e-9, p_w=place.values[row],
            v_w=v, a_w=a, jerk_w=zero, snap_w=zero, yaw=float(yaw[0]), yaw_rate=0.0, yaw_acceleration=0.0,
        )  # fmt: skip
        out.append((at, "reference", message))
    return out


def _last(signal: Series, t: Floats) -> Any:
    """Return for each time the row that holds then, -1 before the first."""
    return np.searchsorted(signal.t, t + 1e-9, side="right") - 1


def _held(signal: Series | None, t: Floats) -> Floats:
    """Return the rows of ``signal`` that hold at ``t``, zeros before the first and without a signal."""
    if signal is None:
        return np.zeros((len(t), 3))
    index = _last(signal, t)
    held: Floats = np.where(index[:, None] >= 0, signal.values[index], 0.0)
    return held
