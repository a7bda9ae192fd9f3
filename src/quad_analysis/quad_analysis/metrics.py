"""How well a flight was flown, in numbers with units.

All functions take NumPy arrays and know nothing of files, so a batch of flights uses them as well. Conventions: times
are integer nanoseconds (``stamp_ns``), sorted and without repeats; the tracking error is evaluated at the steps for
which a reference was computed (it holds from there on, and is compared where it is exact) against ``truth``; unless
said otherwise a metric covers the time after the approach (``trajectory_time`` >= 0). Integrals of errors use the
trapezoidal rule, integrals of commands hold each command until the next.
"""

from collections.abc import Mapping
from math import isfinite
from typing import Annotated, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from quad_analysis.arrays import Floats, Stamps, by_stamp, euler_angles, matched, norms, wrapped
from quad_core.cascade import COMMAND
from quad_core.enumerations import Mode

SETTLING_BAND = 0.1  # m
HIGH_FREQUENCY = 20.0  # Hz


class Metric(NamedTuple):
    """One line of the table: unit and what exactly is computed."""

    unit: str
    meaning: str


Number = float | None


class FlightMetrics(NamedTuple):
    """The metrics of a flight; None where the data for one is missing or it does not exist (never settled)."""

    duration: Annotated[Number, "s", "flight time after the approach; in a mission all of MISSION"] = None
    position_rmse: Annotated[Number, "m", "root of the mean squared 3-D position error"] = None
    position_max: Annotated[Number, "m", "largest 3-D position error"] = None
    position_final: Annotated[Number, "m", "3-D position error at the last reference"] = None
    position_iae: Annotated[Number, "m s", "integral of the 3-D position error"] = None
    position_itae: Annotated[Number, "m s^2", "integral of trajectory time times the 3-D position error"] = None
    settling_time: Annotated[
        Number, "s", f"time until the 3-D position error stays below {SETTLING_BAND} m to the end"
    ] = None
    attitude_rmse: Annotated[
        Number, "rad", "root of the mean squared error of phi, theta, psi together against the setpoint"
    ] = None
    thrust_effort: Annotated[Number, "N^2 s", "integral of the squared commanded thrust"] = None
    torque_effort: Annotated[Number, "N^2 m^2 s", "integral of the squared commanded torque"] = None
    torque_total_variation: Annotated[
        Number, "N m", "sum of all changes of the commanded torque, the three axes added"
    ] = None
    torque_high_frequency: Annotated[
        Number, "N^2 m^2 s", f"part of torque_effort above {HIGH_FREQUENCY:g} Hz, the mean torque taken off"
    ] = None
    chattering_index: Annotated[
        Number, "", f"share of the commanded torque's energy above {HIGH_FREQUENCY:g} Hz, the mean torque taken off"
    ] = None
    saturation_time: Annotated[
        Number, "s", "time in which the vehicle did not reach the commanded wrench on some axis"
    ] = None


METRICS: dict[str, Metric] = {
    name: Metric(*kind.__metadata__) for name, kind in get_type_hints(FlightMetrics, include_extras=True).items()
}


def rmse(errors: Floats) -> float:
    """Return the root of the mean of the squared rows of (n,) or (n, 3): a 3-D RMSE is not divided by 3."""
    return float(np.sqrt(np.sum(errors * errors) / len(errors)))


def _integral(times: Floats, values: Floats) -> float:
    """Return the integral of values over time (trapezoidal)."""
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(times)))


def settling_time(times: Floats, errors: Floats, band: float = SETTLING_BAND) -> float | None:
    """Return the time from ``times[0]`` until abs(error) is below ``band`` for good; None if it is not at the end."""
    above = np.flatnonzero(~(np.abs(errors) < band))
    if len(above) == 0:
        return 0.0
    if above[-1] == len(errors) - 1:
        return None
    return float(times[above[-1] + 1] - times[0])


def hold_times(stamp_ns: Stamps) -> Floats:
    """Return for how long (s) each command acts: until the next one, the last for the median of the others."""
    spacing = np.diff(stamp_ns)
    return np.append(spacing, np.median(spacing)) * 1e-9


def effort(hold: Floats, commands: Floats) -> float:
    """Return the integral of the squared command, (n,) or (n, 3), each held for ``hold`` s."""
    squares = commands * commands
    return float(np.sum(hold * (squares if squares.ndim == 1 else squares.sum(axis=1))))


def total_variation(commands: Floats) -> float:
    """Return the sum of the absolute changes of a command from step to step, axes added."""
    return float(np.sum(np.abs(np.diff(commands, axis=0))))


def band_energy(commands: Floats, period: float, cutoff: float = HIGH_FREQUENCY) -> tuple[float, float]:
    """Return (energy above ``cutoff`` Hz, whole energy) of commands (n, m), the mean taken off, every ``period`` s.

    Unit squared times s; by Parseval's theorem over the discrete Fourier transform.
    """
    count = len(commands)
    spectrum = np.abs(np.fft.rfft(commands - commands.mean(axis=0), axis=0)) ** 2
    weight = np.full(len(spectrum), 2.0)
    weight[0] = 1.0
    if count % 2 == 0:
        weight[-1] = 1.0
    energy = weight * spectrum.sum(axis=1) * (period / count)
    above = np.fft.rfftfreq(count, period) > cutoff
    return float(np.sum(energy[above])), float(np.sum(energy))


@np.errstate(over="ignore", invalid="ignore")
def flight_metrics(tables: Mapping[str, NDArray[np.void]]) -> FlightMetrics:
    """Return the metrics of one flight; one that comes out as no finite number is None.

    ``tables``: {relative topic: structured array with ``stamp_ns`` and the fields of its message}, of ``truth``,
    ``reference``, ``attitude_setpoint``, the vehicle's command and ``actuation``. What is not there gives None. With
    ``flight/mode`` only what was flown in MISSION counts.
    """
    known = in_mission({name: by_stamp(table) for name, table in tables.items() if len(table)})
    if "reference" not in known:
        return FlightMetrics()
    reference = known["reference"]
    flown = reference[reference["trajectory_time"] >= 0.0]
    if len(flown) == 0:
        return FlightMetrics()
    start_ns = int(flown["stamp_ns"][0])
    end_ns = max(int(table["stamp_ns"][-1]) for table in known.values())
    values: dict[str, float | None] = {"duration": (end_ns - start_ns) * 1e-9}
    if "truth" in known:
        values.update(_position(known["truth"], flown))
        if "attitude_setpoint" in known:
            values.update(_attitude(known["truth"], _since(known["attitude_setpoint"], start_ns)))
    if COMMAND in known:
        values.update(_command(_since(known[COMMAND], start_ns)))
    if "actuation" in known:
        values.update(_saturation(_since(known["actuation"], start_ns)))
    return FlightMetrics(
        **{name: value if value is None or isfinite(value) else None for name, value in values.items()}
    )


def in_mission(tables: Mapping[str, NDArray[np.void]]) -> dict[str, NDArray[np.void]]:
    """Return the rows of ``tables``, sorted by stamp, that belong to mode MISSION; all where there is no `flight/mode`.

    A mode holds from its stamp until the next one's. A table without any such row is left out.
    """
    modes = tables.get("flight/mode")
    if modes is None:
        return dict(tables)
    found = {}
    for name, table in tables.items():
        at = np.searchsorted(modes["stamp_ns"], table["stamp_ns"], side="right") - 1
        rows = table[(at >= 0) & (modes["mode"][at] == Mode.MISSION)]
        if len(rows):
            found[name] = rows
    return found


def _since(table: NDArray[np.void], start_ns: int) -> NDArray[np.void]:
    return table[table["stamp_ns"] >= start_ns]


def _position(truth: NDArray[np.void], reference: NDArray[np.void]) -> dict[str, float | None]:
    truth, reference = matched(truth, reference)
    if len(truth) == 0:
        return {}
    error, times = norms(truth["p_w"] - reference["p_w"]), reference["trajectory_time"]
    return {
        "position_rmse": rmse(error),
        "position_max": float(error.max()),
        "position_final": float(error[-1]),
        "position_iae": _integral(times, error),
        "position_itae": _integral(times, times * error),
        "settling_time": settling_time(times, error),
    }


def _attitude(truth: NDArray[np.void], setpoint: NDArray[np.void]) -> dict[str, float | None]:
    truth, setpoint = matched(truth, setpoint)
    if len(truth) == 0:
        return {}
    error = wrapped(euler_angles(truth["q_wb"]) - setpoint["angles"])
    return {"attitude_rmse": rmse(error)}


def _command(wrench: NDArray[np.void]) -> dict[str, float | None]:
    if len(wrench) < 2:
        return {}
    thrust, torque = thrust_and_torque(wrench)
    hold, spacing = hold_times(wrench["stamp_ns"]), np.diff(wrench["stamp_ns"])
    even = (spacing == spacing[0]).all()
    high, whole = band_energy(torque, int(spacing[0]) * 1e-9) if even else (None, None)
    return {
        "thrust_effort": effort(hold, thrust),
        "torque_effort": effort(hold, torque),
        "torque_total_variation": total_variation(torque),
        "torque_high_frequency": high,
        "chattering_index": high / whole if high is not None and whole else None,
    }


def thrust_and_torque(wrench: NDArray[np.void]) -> tuple[Floats, Floats]:
    """Return thrust (n,) in N and torque (n, 3) in N m of geometry_msgs/WrenchStamped rows, or of flat ones."""
    if "wrench" not in (wrench.dtype.names or ()):
        return wrench["thrust"], wrench["torque_b"]
    torque = wrench["wrench"]["torque"]
    return wrench["wrench"]["force"]["z"], np.stack([torque[axis] for axis in "xyz"], axis=1)


def _saturation(actuation: NDArray[np.void]) -> dict[str, float | None]:
    if len(actuation) < 2:
        return {}
    hold = hold_times(actuation["stamp_ns"])
    flags = ("thrust_high", "thrust_low", "roll_limited", "pitch_limited", "yaw_limited")
    limited = np.logical_or.reduce([actuation[flag] for flag in flags])
    return {"saturation_time": float(np.sum(hold[limited]))}
