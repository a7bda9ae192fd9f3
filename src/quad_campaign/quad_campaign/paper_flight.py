"""Flights of the paper's section 4, told in a few words: case, preset, start and what differs from it.

The studies of the laws (docs/decisions/0002, docs/stability.md, docs/as_printed.md) and their acceptance runs share it.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from quad_campaign.flight import Flight, flight_from_parameters
from quad_campaign.sweep import sweep
from quad_core.parameters import Value

CASES = ("case1", "case2")
FIRST_POINT = {"case1": (5.0, 5.0, 11.0), "case2": (10.0, 0.0, 10.0)}
"""Position of the reference at t = 0 in m (eqs. 62-64, 66-68)."""

POSITION_ADAPTATION_OFF: dict[str, Value] = {f"{axis}.adaptation_rate": 0.0 for axis in "xyz"}
ATTITUDE_ADAPTATION_OFF: dict[str, Value] = {
    f"{axis}.adaptation_{what}": 0.0 for axis in ("roll", "pitch", "yaw") for what in ("constant", "angle", "rate")
}


class Told(NamedTuple):
    """One flight of a case: preset, start and the parameters that differ; names without the plug-in's.

    ``start``: approach or printed. ``initial``: where the vehicle is at take-off in m. ``duration``: s from t = 0.
    """

    case: str
    preset: str = "tuned"
    start: str = "approach"
    position: Mapping[str, Value] = {}
    attitude: Mapping[str, Value] = {}
    disturbance: Mapping[str, Value] = {}
    vehicle: Mapping[str, Value] = {}
    initial: tuple[float, float, float] = (0.0, 0.0, 0.0)
    duration: float = 80.0
    plant: str = "rigid_body"
    plant_changes: Mapping[str, Value] = {}


class Arrival(NamedTuple):
    """Worst over the seeds: how many ended, error at some time in m, largest error and RMSE from then on."""

    seeds: int
    ended: int
    error_then: float
    largest_after: float
    rmse_after: float


def paper_flight(told: Told, score_from: float = 0.0) -> Flight:
    """Return the flight: attitude at 500 Hz, the rest at 100 Hz, disturbance ``held_gaussian``.

    Errors are counted from trajectory time ``score_from`` s. Raises as ``flight_from_parameters``.
    """
    path: dict[str, Value] = {"trajectory": told.case, f"{told.case}.start": told.start}
    path[f"{told.case}.duration"] = told.duration
    start: dict[str, Value] = {f"initial.p.{axis}": value for axis, value in zip("xyz", told.initial, strict=True)}
    return flight_from_parameters(
        {
            "/**": _under("vehicle", told.vehicle),
            "simulator": {"plant": told.plant}
            | _under(told.plant, {**start, **told.plant_changes})
            | _under("held_gaussian", told.disturbance),
            "trajectory": path,
            "position_controller": {"preset": told.preset} | _under("aibs", told.position),
            "attitude_controller": {"preset": told.preset} | _under("abfnitsm", told.attitude),
        },
        score_from,
    )


def arrival(told: Told, seeds: Iterable[int], after: float = 20.0, *, compiled: bool = True) -> Arrival:
    """Return how ``told`` goes from t = ``after`` s on, worst over ``seeds``; NaN where no seed got there."""
    chosen = list(seeds)
    whole = sweep(paper_flight(told, after), chosen, compiled=compiled)
    short = sweep(paper_flight(told._replace(duration=after)), chosen, compiled=compiled)
    then = [result.last_error for result in short if result.outcome == "ended"]
    late = [result for result in whole if result.rmse == result.rmse]
    nothing = float("nan")
    return Arrival(
        len(chosen),
        sum(result.outcome == "ended" for result in whole),
        max(then, default=nothing),
        max((result.largest_error for result in late), default=nothing),
        max((result.rmse for result in late), default=nothing),
    )


def worst_rmse(told: Told, seeds: Iterable[int], *, compiled: bool = True) -> float:
    """Return the largest RMSE in m over ``seeds`` from t = 0 on; infinite if a seed did not end."""
    results = sweep(paper_flight(told), list(seeds), compiled=compiled)
    return max(result.rmse if result.outcome == "ended" else float("inf") for result in results)


def _under(name: str, values: Mapping[str, Value]) -> dict[str, Value]:
    return {f"{name}.{key}": value for key, value in values.items()}
