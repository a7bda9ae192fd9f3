"""Flights as the viewer plays them (``viewer.js``): sampled columns of single precision."""

import base64
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from quad_core.cascade import COMMAND
from quad_flight_log.analysis.arrays import Floats
from quad_flight_log.analysis.metrics import thrust_and_torque
from quad_flight_log.report.flight_figures import Run, numbered

SAMPLES = 3000  # of one flight, evenly spaced; between them the viewer interpolates


class Playback(NamedTuple):
    """The viewer in a page: flights of one trajectory, the first in full, the others as ghosts."""

    key: str
    title: str
    caption: str
    runs: Sequence[Run]


def playback(runs: Sequence[Run]) -> list[Playback]:
    """Return the playback of those of ``runs`` that have ``truth``: one, or none."""
    flown = [run for run in runs if run.has("truth")]
    if not flown:
        return []
    key, title = numbered(flown[0].trajectory, 0, "path", "3-D position trajectory tracking")
    parts = ["The vehicle is drawn larger than it is; its thrust orange, the wind blue, the reference grey."]
    parts += [f"{flown[0].name}: its path by its error."] if flown[0].has("reference") else []
    parts += [f"Ghosts: {', '.join(run.name for run in flown[1:])}."] if len(flown) > 1 else []
    return [Playback(key, title, " ".join([*parts, "Keys: space, arrows, 1 to 4."]), flown)]


def scene(runs: Sequence[Run], colour: Mapping[str, str]) -> dict[str, Any]:
    """Return what the viewer needs of flights that have ``truth``, the first one in full, the others as ghosts."""
    flights: list[dict[str, Any]] = []
    for run in (each for each in runs if each.has("truth")):
        columns = {name: _packed(values) for name, values in samples(run).items()}
        own = not _same_reference(run, runs[0])
        flights.append({"name": run.name, "colour": colour[run.name], "ownReference": own, **columns})
    return {"flights": flights}


def samples(run: Run, count: int = SAMPLES) -> dict[str, Floats]:
    """Return at most ``count`` samples: t (n,) in s, p (n, 3) in m, q (n, 4), and where recorded more.

    That is thrust (n,) in N, reference (n, 3) in m, NaN before and after it, and wind (n, 3) in m/s.
    """
    truth = run.tables["truth"]
    rows = np.linspace(0, len(truth) - 1, min(len(truth), count)).astype(int)
    times = run.times("truth")[rows]
    found: dict[str, Floats] = {"t": times, "p": truth["p_w"][rows], "q": truth["q_wb"][rows]}
    if run.has("actuation"):
        found["thrust"] = np.interp(times, run.times("actuation"), run.tables["actuation"]["thrust"])
    elif run.has(COMMAND):
        found["thrust"] = np.interp(times, run.times(COMMAND), thrust_and_torque(run.tables[COMMAND])[0])
    if run.has("reference"):
        known = run.times("reference")
        found["reference"] = _columns(times, known, run.tables["reference"]["p_w"])
        found["reference"][(times < known[0]) | (times > known[-1])] = np.nan
    if run.has("disturbance") and "wind_w" in (run.tables["disturbance"].dtype.names or ()):
        wind = _columns(times, run.times("disturbance"), run.tables["disturbance"]["wind_w"])
        found |= {"wind": wind} if wind.any() else {}
    return found


def _columns(times: Floats, known: Floats, values: Floats) -> Floats:
    """Return (n, 3) values at ``times`` of those known at others."""
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _packed(values: Floats) -> str:
    largest = np.finfo(np.float32).max
    return base64.b64encode(np.clip(values, -largest, largest).astype("<f4").tobytes()).decode("ascii")


def _same_reference(run: Run, other: Run) -> bool:
    tables = [each.tables["reference"]["p_w"] for each in (run, other) if each.has("reference")]
    return len(tables) < 2 or (tables[0].shape == tables[1].shape and bool((tables[0] == tables[1]).all()))
