"""What identification takes: one flight as arrays, checked, and brought onto one grid of time.

SI units, body frame forward-left-up, world frame east-north-up, quaternions xyzw (body to world). Nothing is resampled
before this module, so that it knows at which rate each signal was logged.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from quad_core.vehicle import ARRANGEMENTS, Arrangement

Floats = NDArray[np.float64]
FASTEST = 1000.0  # Hz of the grid
BLOCK_RATE = 100.0  # Hz at which model and measurement are compared; both are means over the same spans
WINDOW = 0.25  # s over which body rates are integrated without correction
IN_FLIGHT = 0.5  # of the median command: below it the vehicle stands or falls
GAP = 1.0  # s without force, rates or motors after which a new grid begins: its first second is left to the lag
PIECE = 2.0  # s of the shortest grid
MOST = 1_000_000  # samples of a flight's grids: 17 minutes at 1 kHz; 905,000 took 0.8 GB
NEAR_GROUND = 1.5  # s after take-off and before landing that are left out
SLOWEST = 20.0  # Hz of specific force, rates and motors below which nothing is tried


class RecordError(ValueError):
    """A log that cannot be used; the text names signal, found and expected."""


class Samples(NamedTuple):
    """One signal: times in s, shape (n,), and values, shape (n, columns)."""

    t: Floats
    values: Floats

    @property
    def rate(self) -> float:
        """Median rate in Hz."""
        return float(1.0 / np.median(np.diff(self.t)))


class Flight(NamedTuple):
    """One log: commands of four motors in 0..1 (or speeds in rad/s), specific force m/s^2 and body rates rad/s.

    Where known: velocity m/s (world), attitude xyzw, position m (world), voltage V of the battery. ``differentiated``:
    the specific force is the change of the velocity.
    """

    motors: Samples
    specific_force: Samples | None = None
    body_rates: Samples | None = None
    rotors: Arrangement = ARRANGEMENTS["x"]
    speeds: bool = False
    velocity: Samples | None = None
    attitude: Samples | None = None
    position: Samples | None = None
    voltage: Samples | None = None
    name: str = "log"
    differentiated: bool = False


COLUMNS = {"specific_force": 3, "body_rates": 3, "motors": 4, "velocity": 3, "attitude": 4, "position": 3, "voltage": 1}


def checked(flight: Flight) -> tuple[Flight, list[str]]:
    """Return ``flight`` without rows that are not finite, lone spikes of its motors and steps back in time; and notes.

    Raises RecordError for what is missing, too short, too slow, or does not move at all.
    """
    notes = []
    for name, columns in COLUMNS.items():
        found: Samples | None = getattr(flight, name)
        if found is None:
            continue
        t, values = np.asarray(found.t, float), np.asarray(found.values, float).reshape(len(found.t), -1)
        where = f"{flight.name}: {name}"
        if values.shape[1] != columns:
            raise RecordError(f"{where}: found {values.shape[1]} columns, expected {columns}")
        good = np.isfinite(t) & np.isfinite(values).all(axis=1)
        if name == "motors":
            good &= values.max(axis=1, initial=0.0) <= 3.0 * np.percentile(np.where(good, values.T, 0.0), 99.0) + 1e-9
        later = np.maximum.accumulate(np.where(good, t, -np.inf))
        good[1:] &= t[1:] > later[:-1]
        if not good.all():
            notes.append(
                f"{where}: {int((~good).sum())} of {len(t)} rows left out: not finite, a spike, or back in time"
            )
        t, values = t[good], values[good]
        if len(t) < 2 or t[-1] - t[0] < 5.0:
            length = t[-1] - t[0] if len(t) > 1 else 0.0
            raise RecordError(f"{where}: found {length:.1f} s that can be used, expected at least 5 s")
        used: dict[str, Any] = {name: Samples(t, values)}
        flight = flight._replace(**used)
    for name in ("specific_force", "body_rates", "motors"):
        samples: Samples | None = getattr(flight, name)
        if samples is None:
            continue
        if samples.rate < SLOWEST:
            raise RecordError(f"{flight.name}: {name}: found {samples.rate:.0f} Hz, expected at least {SLOWEST:.0f} Hz")
        if np.ptp(samples.values, axis=0).max() == 0.0:
            raise RecordError(f"{flight.name}: {name}: found one value all along, expected a flight")
    if not flight.speeds and not (flight.motors.values.min() >= -1e-6 and flight.motors.values.max() <= 1.0 + 1e-6):
        low, high = flight.motors.values.min(), flight.motors.values.max()
        raise RecordError(f"{flight.name}: motors: found {low:g} to {high:g}, expected commands in 0..1")
    return flight, notes


class Grid(NamedTuple):
    """A piece of a flight in windows of blocks. Fine: grid of the motors; block: where model and log are compared.

    ``t`` (n,): of the blocks, in s from the middle of the flight's windows.
    ``command`` (fine, 4); ``fine_step``, ``step`` s; ``per`` fine steps a block; ``windows`` (w, blocks): indices of
    blocks. Means over blocks: ``force``, ``rates`` (n, 3), ``velocity_b`` (n, 3) or None, ``voltage`` (n,) V or None;
    ``attitude`` (n, 4), ``velocity``, ``position`` (n, 3), or None, at the middle of the block. ``rates_hz``: logged.
    """

    t: Floats
    command: Floats
    fine_step: float
    step: float
    per: int
    windows: NDArray[np.int64]
    force: Floats
    rates: Floats
    velocity_b: Floats | None
    voltage: Floats | None
    attitude: Floats | None
    velocity: Floats | None
    position: Floats | None
    rotors: Arrangement
    rates_hz: dict[str, float]


def gridded(flight: Flight, full_speed: float = 1.0) -> list[Grid]:
    """Return a checked flight on grids, one for each piece between gaps of more than GAP s.

    ``full_speed`` rad/s is counted as command 1 where speeds were logged. Raises RecordError if too little is left.
    """
    rates_hz = {name: getattr(flight, name).rate for name in COLUMNS if getattr(flight, name) is not None}
    step = 1.0 / min(FASTEST, rates_hz["specific_force"], rates_hz["body_rates"])
    pieces = _pieces(flight)
    count = sum(int((end - begin) / step) for begin, end in pieces)
    if count > MOST:
        expected = f"at most {MOST}: a damaged time, or a log to be cut"
        raise RecordError(f"{flight.name}: found {count} samples, expected {expected}")
    total = flight.motors.values.sum(axis=1) / full_speed
    flying = IN_FLIGHT * float(np.median(total[total > 0.2 * total.max()]))
    grids = [_grid(flight, piece, step, full_speed, flying, rates_hz) for piece in pieces]
    grids = [grid for grid in grids if len(grid.windows)]
    found = WINDOW * sum(len(grid.windows) for grid in grids)
    if found < 4.0:
        raise RecordError(f"{flight.name}: found {found:g} s of flight without a gap, expected at least 4")
    middle = float(np.concatenate([grid.t[grid.windows].ravel() for grid in grids]).mean())
    return [grid._replace(t=grid.t - middle) for grid in grids]


def _pieces(flight: Flight) -> list[tuple[float, float]]:
    """Return begin and end in s of each piece of PIECE s and more with force, rates and motors."""
    needed = [each for each in (flight.specific_force, flight.body_rates, flight.motors) if each is not None]
    gaps = [(each.t[at], each.t[at + 1]) for each in needed for at in np.flatnonzero(np.diff(each.t) > GAP)]
    begin, end = max(each.t[0] for each in needed), min(each.t[-1] for each in needed)
    pieces = []
    for low, high in [*sorted(gaps), (end, end)]:
        if min(low, end) - begin >= PIECE:
            pieces.append((begin, min(low, end)))
        begin = max(begin, high)
    return pieces


def _grid(
    flight: Flight,
    piece: tuple[float, float],
    step: float,
    full_speed: float,
    flying: float,
    rates_hz: dict[str, float],
) -> Grid:
    """Return the grid of one piece; below a sum of commands ``flying`` the vehicle stands or falls."""
    assert flight.specific_force is not None
    assert flight.body_rates is not None
    per = max(1, round(1.0 / (step * BLOCK_RATE)))
    count = int((piece[1] - piece[0]) / step) // per * per
    t: Floats = piece[0] + step * np.arange(count, dtype=np.float64)
    middle = t.reshape(-1, per).mean(axis=1)
    command = held(flight.motors, t) / full_speed
    needed = (flight.specific_force, flight.body_rates, flight.motors)
    good = np.logical_and.reduce([gap_free(each, t, step) for each in needed]).reshape(-1, per).all(axis=1)
    good[-2:] = False  # slopes and increments reach so far
    second = round(1.0 / (per * step))
    low = smoothed(command.sum(axis=1).reshape(-1, per).mean(axis=1), second) <= flying
    edge = round(NEAR_GROUND * second)
    good &= np.convolve(low, np.ones(2 * edge + 1), "same") == 0  # take-off and landing: ground effect, contact
    optional = {name: getattr(flight, name) for name in ("velocity", "position", "voltage")}
    found = {name: None if each is None else linear(each, middle) for name, each in optional.items()}
    attitude = None if flight.attitude is None else turned_to(flight.attitude, middle)
    velocity_b = None
    if attitude is not None and found["velocity"] is not None:
        velocity_b = Rotation.from_quat(attitude).apply(found["velocity"], inverse=True)
    return Grid(
        middle,
        command,
        step,
        per * step,
        per,
        _windows(good, round(WINDOW / (per * step))),
        linear(flight.specific_force, t).reshape(-1, per, 3).mean(axis=1),
        linear(flight.body_rates, t).reshape(-1, per, 3).mean(axis=1),
        velocity_b,
        None if found["voltage"] is None else smoothed(found["voltage"][:, 0], second),
        attitude,
        found["velocity"],
        found["position"],
        flight.rotors,
        rates_hz,
    )


def _windows(good: NDArray[np.bool_], blocks: int) -> NDArray[np.int64]:
    """Return the windows, shape (w, blocks), in which all is ``good``; the first second is left to the lag's memory."""
    starts, at = [], round(1.0 / WINDOW) * blocks
    while at + blocks <= len(good):
        bad = np.flatnonzero(~good[at : at + blocks])
        if len(bad):
            at += int(bad[-1]) + 1
        else:
            starts.append(at)
            at += blocks
    return np.array(starts, dtype=np.int64)[:, None] + np.arange(blocks)


def held(samples: Samples, t: Floats) -> Floats:
    """Return the value that was in force at each of ``t``: the last one before or at it."""
    index = np.searchsorted(samples.t, t + 1e-9, side="right") - 1
    return samples.values[np.clip(index, 0, None)]


def linear(samples: Samples, t: Floats) -> Floats:
    """Return values between samples."""
    return np.stack([np.interp(t, samples.t, column) for column in samples.values.T], axis=1)


def turned_to(samples: Samples, t: Floats) -> Floats:
    """Return attitudes between samples, on the shortest arc."""
    inside = np.clip(t, samples.t[0], samples.t[-1])
    quaternions: Floats = Slerp(samples.t, Rotation.from_quat(samples.values))(inside).as_quat()
    return quaternions


def gap_free(samples: Samples, t: Floats, step: float) -> NDArray[np.bool_]:
    """Return at which of ``t`` the signal was logged without a gap of more than five of its periods."""
    after = np.clip(np.searchsorted(samples.t, t), 1, len(samples.t) - 1)
    gap: NDArray[np.bool_] = samples.t[after] - samples.t[after - 1] < 5.0 * max(step, 1.0 / samples.rate)
    return gap


def smoothed(values: Floats, width: int) -> Floats:
    """Return running means over ``width`` values, shorter at the ends."""
    kernel = np.ones(max(1, width))
    total: Floats = np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same")
    return total
