"""Maps: which columns of a log are which signal, in which unit and frame; and a log read by its map.

A map is YAML::

    rotors: x                              # where motors 1 to 4 stand: x, plus, crazyflie, px4
    curve: 1.0                             # share of the square in thrust over command (PX4's THR_MDL_FAC); the default
    time: {column: t, unit: s}             # of every table that has no time of its own
    signals:
      specific_force: {columns: [ax, ay, az], unit: g, frame: flu}
      attitude: {columns: [qw, qx, qy, qz], order: wxyz, frame: enu}
      motors: {table: motors, columns: [m1, m2, m3, m4], unit: pwm16}

A signal may be a list of such entries: the first whose columns are all there is taken. With ``derivative: 1`` or 2 it
is the first or second derivative of its columns.
"""

from collections.abc import Mapping
from difflib import get_close_matches
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from quad_core.parameter_files import load_yaml
from quad_flight_log.errors import FlightLogError, one_line
from quad_log_import.tables import Tables, read_tables
from quad_log_import.telemetry import Table

Floats = NDArray[np.float64]
LONGEST = 86400.0  # s that a log may span
LARGEST = 1e30  # of a number: messages have 32 bits for it
WIDTHS = {
    "specific_force": 3,
    "body_rates": 3,
    "attitude": 4,
    "position": 3,
    "velocity": 3,
    "motors": 4,
    "speeds": 4,
    "voltage": 1,
    "reference_position": 3,
    "reference_velocity": 3,
    "reference_acceleration": 3,
    "reference_yaw": 1,
    "attitude_target": 4,
    "thrust_target": 3,
}
"""Signals that a map may name, and how many columns each has."""
UNITS = {
    "": 1.0,
    "g": 9.80665,
    "deg": np.pi / 180.0,
    "rpm": np.pi / 30.0,
    "mm": 1e-3,
    "mV": 1e-3,
    "cm": 1e-2,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
    "pwm16": 1.0 / 65535.0,
    "percent": 0.01,
    "pwm_us": 1e-3,
    "dshot": 1.0 / 1999.0,
}
"""Factors to SI or to a command in 0..1; ``pwm_us`` is 1000 to 2000, so 1 is taken off."""
ROTORS = ("x", "plus", "crazyflie", "px4")
SHIPPED = ("px4", "mavlink", "crazyflie", "nanobench", "idsia", "ros", "bag")
DEFAULT = {"ulog": "px4", "tlog": "mavlink", "usd": "crazyflie", "bag": "ros"}
_KEYS = {"table", "columns", "unit", "frame", "order", "signs", "time", "euler", "derivative"}
_SPANS = {1: 0.05, 2: 0.1}  # s to both sides of a derivative
MOVES = {"position": "velocity", "attitude": "body_rates"}
"""{what a log must have for a state: what is made of its change where the log lacks it}."""
_FASTEST = 15.0  # m/s; what goes faster is a step, which has no derivative
_FROM_NED = np.array([0.5**0.5, 0.5**0.5, 0.0, 0.0])  # x y z w: turns north-east-down into east-north-up
_FROM_FRD = np.array([1.0, 0.0, 0.0, 0.0])


class Series(NamedTuple):
    """One signal: times s, shape (n,), values (n, width), and the column from which each came, in words."""

    t: Floats
    values: Floats
    source: str


class Recording(NamedTuple):
    """A log of others in SI units, FLU body, ENU world, quaternions xyzw; ``notes`` are what was said while reading.

    A row of ``reference_position`` that is no number says that there is no set point. ``curve``: see the map.
    """

    signals: dict[str, Series]
    rotors: str
    notes: list[str]
    curve: float = 1.0


def read_recording(path: Path, map_name: str = "") -> tuple[Recording, str]:
    """Return the log at ``path`` in our units and frames, and the name of the map that was used.

    Raises FlightLogError naming file, what was found and what was expected.
    """
    kind, tables, notes = read_tables(path)
    name = map_name or DEFAULT.get(kind, "")
    if not name:
        raise FlightLogError(f"{path}: a table says nothing of its columns; give --map: {', '.join(SHIPPED)} or a file")
    try:
        content = load_map(name)
        if name not in SHIPPED:
            refuse_missing(tables, content, name)
        return mapped(tables, content, notes), name
    except FlightLogError as error:
        raise FlightLogError(f"{path}: {error}") from error


def refuse_missing(tables: Tables, content: Mapping[str, Any], name: str) -> None:
    """Raise FlightLogError if the map ``name``, made for this log, names a column that is not there.

    A signal with several entries takes what it finds.
    """
    for signal, entry in content["signals"].items():
        table = {} if isinstance(entry, list) else tables.get(str(entry.get("table", ""))) or {}
        for column in entry["columns"] if table else ():
            if column not in table:
                near = get_close_matches(str(column), map(str, table)) or sorted(map(str, table))
                raise FlightLogError(f"{name}: {signal}: found no column {column!r}, expected {', '.join(near)[:300]}")


def load_map(name: str) -> Mapping[str, Any]:
    """Return a shipped map or one from a file; raises FlightLogError naming file, key, found and expected."""
    try:
        if name in SHIPPED:
            text = resources.files("quad_log_import").joinpath(f"maps/{name}.yaml").read_text(encoding="utf-8")
        else:
            text = Path(name).read_text(encoding="utf-8")
        content = load_yaml(text)
    except (OSError, ValueError) as error:
        hint = f"; shipped maps: {', '.join(SHIPPED)}" if isinstance(error, FileNotFoundError) else ""
        raise FlightLogError(f"{name}: the map cannot be read: {one_line(error)}{hint}") from error
    if not isinstance(content, dict) or not isinstance(content.get("signals"), dict):
        raise FlightLogError(f"{name}: found no 'signals', expected a map of signal to columns")
    if content.get("rotors", "x") not in ROTORS:
        raise FlightLogError(f"{name}: rotors: found {content['rotors']!r}, expected one of {', '.join(ROTORS)}")
    if not isinstance(content.get("curve", 1.0), float) or not 0.0 <= content.get("curve", 1.0) <= 1.0:
        raise FlightLogError(f"{name}: curve: found {content['curve']!r}, expected 0.0 to 1.0")
    for signal, entries in content["signals"].items():
        if signal not in WIDTHS:
            raise FlightLogError(f"{name}: found signal {signal!r}, expected one of {', '.join(WIDTHS)}")
        for entry in entries if isinstance(entries, list) else [entries]:
            _check_entry(f"{name}: {signal}", signal, entry)
    return content


def _check_entry(where: str, signal: str, entry: object) -> None:
    if not isinstance(entry, dict) or not isinstance(entry.get("columns"), list) or entry.keys() - _KEYS:
        raise FlightLogError(
            f"{where}: found {entry!r}, expected columns and of {', '.join(sorted(_KEYS))} what is needed"
        )
    width = 3 if entry.get("euler") else WIDTHS[signal]
    if len(entry["columns"]) != width:
        raise FlightLogError(f"{where}: found {len(entry['columns'])} columns, expected {width}")
    choices = {
        "unit": UNITS,
        "frame": ("flu", "frd", "enu", "ned", "frd-ned"),
        "order": ("xyzw", "wxyz"),
        "derivative": (1, 2),
    }
    for key, allowed in choices.items():
        if key in entry and entry[key] not in allowed:
            raise FlightLogError(
                f"{where}: {key}: found {entry[key]!r}, expected one of {', '.join(filter(None, map(str, allowed)))}"
            )


def mapped(tables: Tables, content: Mapping[str, Any], notes: list[str]) -> Recording:
    """Return what ``content``, a map, finds in ``tables``; raises FlightLogError if it finds no signal at all."""
    signals, missing, empty = {}, [], {}
    for name, entries in content["signals"].items():
        for entry in entries if isinstance(entries, list) else [entries]:
            table = tables.get(str(entry.get("table", "")))
            if table is not None and all(column in table for column in entry["columns"]):
                found = _signal(name, table, entry, content)
                if len(found.t) > 1:
                    signals[name] = found
                    break
                empty[name] = f"{found.source}: found {len(found.t)} rows of finite numbers whose time goes on"
        else:
            if name not in empty:
                missing.append(name)
    notes = [*notes, *(said for name, said in empty.items() if name not in signals)]
    if not signals and empty:
        raise FlightLogError(f"{next(iter(empty.values()))}, expected two and more")
    if not signals:
        names = ", ".join(sorted(tables)) if "" not in tables else ", ".join(sorted(tables[""]))
        raise FlightLogError(f"the map finds none of its columns; the log has {names[:500]}")
    if missing:
        notes = [*notes, f"not in the log: {', '.join(missing)}"]
    still = [name for name in ("reference_velocity", "reference_acceleration", "reference_yaw") if name not in signals]
    if "reference_position" in signals and still:
        notes = [*notes, f"reference: {', '.join(still)} are not in the log and count as 0, which misleads a shadow"]
    if signals.keys() >= MOVES.keys():
        changes = [f"{name} is the change of {of}" for of, name in MOVES.items() if name not in signals]
        notes += [f"state: {' and '.join(changes)}"] * bool(changes)
    for name, found in signals.items():
        if (span := float(found.t[-1] - found.t[0])) > LONGEST:
            expected = f"at most {LONGEST:g} s: a damaged time, or its unit"
            raise FlightLogError(f"{name}: {found.source}: its times span {span:.4g} s, expected {expected}")
    first = min(float(found.t[0]) for found in signals.values())
    moved = {name: found._replace(t=found.t - first) for name, found in signals.items()}
    return Recording(moved, str(content.get("rotors", "x")), notes, content.get("curve", 1.0))


def _signal(name: str, table: Table, entry: Mapping[str, Any], content: Mapping[str, Any]) -> Series:
    time = {**content.get("time", {}), **entry.get("time", {})}
    t = table["t"] if "column" not in time or time["column"] not in table else table[time["column"]]
    t = np.asarray(t, float) * UNITS[time.get("unit", "") if time.get("unit") != "s" else ""]
    values = np.stack([np.asarray(table[column], float) for column in entry["columns"]], axis=1)
    values = values * UNITS[entry.get("unit", "")] * np.array(entry.get("signs", 1.0))
    if entry.get("unit") == "pwm_us":
        values = np.clip(values - 1.0, 0.0, 1.0)
    frame = entry.get("frame", "")
    if name in ("attitude", "attitude_target"):
        values = _attitude(values, entry)
    elif frame == "frd":
        values = values * np.array([1.0, -1.0, -1.0])
    elif frame == "ned":
        values = (
            np.stack([values[:, 1], values[:, 0], -values[:, 2]], axis=1)
            if values.shape[1] == 3
            else np.pi / 2 - values
        )
    good = np.isfinite(t)
    if name != "reference_position":
        good &= (np.abs(values) < LARGEST).all(axis=1)
    good[1:] &= t[1:] > np.maximum.accumulate(np.where(good, t, -np.inf))[:-1]
    source, t, values = f"{entry.get('table', '')} {', '.join(entry['columns'])}".strip(), t[good], values[good]
    if order := entry.get("derivative"):
        values, source = derivative(t, values, order), f"derivative {order} of {source}"
    return Series(t, values, source)


def derivative(t: Floats, values: Floats, order: int) -> Floats:
    """Return the derivative of ``values`` at ``t`` by differences over _SPANS; 0 next to a step, a gap and the ends."""
    steps = np.diff(t, prepend=t[:1])
    span = span_of(t, order)
    jumped = np.linalg.norm(np.diff(values, axis=0, prepend=values[:1]), axis=1) > _FASTEST * steps
    breaks = np.cumsum(jumped | (steps > 2.0 * span))
    before, after = (interpolated(t, values, t + s * span) for s in (-1.0, 1.0))
    whole = has_both_sides(t, span)
    low, high = (np.interp(t + s * span, t, breaks) for s in (-1.0, 1.0))
    found = (after - before) / (2.0 * span) if order == 1 else (after - 2.0 * values + before) / span**2
    return np.where((whole & (low == high))[:, None], found, 0.0)


def interpolated(t: Floats, values: Floats, at: Floats) -> Floats:
    """Return ``values``, shape (n, width), of the times ``t`` at the times ``at``, on straight lines between them."""
    return np.stack([np.interp(at, t, column) for column in values.T], axis=1)


def span_of(t: Floats, order: int = 1) -> float:
    """Return the s to both sides over which a signal at ``t`` is differentiated."""
    return max(_SPANS[order], 1.01 * float(np.median(np.diff(t))))


def has_both_sides(t: Floats, span: float) -> NDArray[np.bool_]:
    """Return at which times a signal reaches ``span`` s to both sides."""
    inside: NDArray[np.bool_] = (t - span >= t[0]) & (t + span <= t[-1])
    return inside


def turning(t: Floats, attitude: Floats) -> Floats:
    """Return body rates in rad/s of attitudes (quaternions xyzw), by differences over _SPANS; one-sided at the ends."""
    span = span_of(t)
    first, last = (np.searchsorted(t, t + side * span).clip(0, len(t) - 1) for side in (-1.0, 1.0))
    turned = (Rotation.from_quat(attitude[first]).inv() * Rotation.from_quat(attitude[last])).as_rotvec()
    elapsed = t[last] - t[first]
    return np.where((elapsed < 4.0 * span)[:, None], turned / np.maximum(elapsed, span)[:, None], 0.0)


def _attitude(values: Floats, entry: Mapping[str, Any]) -> Floats:
    """Return quaternions xyzw, FLU body to ENU world, of length 1 (NaN without one)."""
    if entry.get("euler"):
        values = Rotation.from_euler("ZYX", np.nan_to_num(values)[:, ::-1]).as_quat()
    elif entry.get("order", "xyzw") == "wxyz":
        values = values[:, [1, 2, 3, 0]]
    length = np.linalg.norm(values, axis=1)
    good = np.abs(length - 1.0) < 0.1
    values = np.where(good[:, None], values / np.where(good, length, 1.0)[:, None], np.nan)
    if entry.get("frame") in ("ned", "frd-ned"):
        turned = Rotation.from_quat(_FROM_NED) * Rotation.from_quat(np.where(good[:, None], values, _FROM_FRD))
        values = np.where(good[:, None], (turned * Rotation.from_quat(_FROM_FRD)).as_quat(), np.nan)
    return values
