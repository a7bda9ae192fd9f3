"""Flights of the paper's section 4, described in a few words: case, preset, start and what differs from it.

The studies of the laws (docs/explanation/additions.md, docs/explanation/stability.md, docs/results/as_printed.md) and
their acceptance runs share it.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from quad_core.parameters import Value
from quad_flight.flight import Flight, flight_from_parameters
from quad_flight.many import sweep

CASES = ("case1", "case2")
FIRST_POINT = {"case1": (5.0, 5.0, 11.0), "case2": (10.0, 0.0, 10.0)}
"""Position of the reference at t = 0 in m (eqs. 62-64, 66-68)."""

POSITION_ADAPTATION_OFF: dict[str, Value] = {f"{axis}.adaptation_rate": 0.0 for axis in "xyz"}
ATTITUDE_ADAPTATION_OFF: dict[str, Value] = {
    f"{axis}.adaptation_{what}": 0.0 for axis in ("roll", "pitch", "yaw") for what in ("constant", "angle", "rate")
}


class PaperCase(NamedTuple):
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


def paper_flight(described: PaperCase, score_from: float = 0.0) -> Flight:
    """Return the flight: attitude at 500 Hz, the rest at 100 Hz, disturbance ``held_gaussian``.

    Errors are counted from trajectory time ``score_from`` s. Raises as ``flight_from_parameters``.
    """
    path: dict[str, Value] = {"trajectory": described.case, f"{described.case}.start": described.start}
    path[f"{described.case}.duration"] = described.duration
    start: dict[str, Value] = {f"initial.p.{axis}": value for axis, value in zip("xyz", described.initial, strict=True)}
    # the guard would land what is to be measured
    flown: dict[str, Value] = {"plant": described.plant, "guard.enabled": False}
    return flight_from_parameters(
        {
            "/**": _under("vehicle", described.vehicle),
            "simulator": flown
            | _under(described.plant, {**start, **described.plant_changes})
            | _under("held_gaussian", described.disturbance),
            "trajectory": path,
            "position_controller": {"preset": described.preset} | _under("aibs", described.position),
            "attitude_controller": {"preset": described.preset} | _under("abfnitsm", described.attitude),
        },
        score_from,
    )


def arrival(described: PaperCase, seeds: Iterable[int], after: float = 20.0, *, compiled: bool = True) -> Arrival:
    """Return how ``described`` goes from t = ``after`` s on, worst over ``seeds``; NaN where no seed got there."""
    chosen = list(seeds)
    whole = sweep(paper_flight(described, after), chosen, compiled=compiled)
    short = sweep(paper_flight(described._replace(duration=after)), chosen, compiled=compiled)
    then = [result.score.last_error for result in short if result.outcome == "ended"]
    late = [result for result in whole if result.rmse == result.rmse]
    nothing = float("nan")
    return Arrival(
        len(chosen),
        sum(result.outcome == "ended" for result in whole),
        max(then, default=nothing),
        max((result.score.largest_error for result in late), default=nothing),
        max((result.rmse for result in late), default=nothing),
    )


def worst_rmse(described: PaperCase, seeds: Iterable[int], *, compiled: bool = True) -> float:
    """Return the largest RMSE in m over ``seeds`` from t = 0 on; infinite if a seed did not end."""
    results = sweep(paper_flight(described), list(seeds), compiled=compiled)
    return max(result.rmse if result.outcome == "ended" else float("inf") for result in results)


def _under(name: str, values: Mapping[str, Value]) -> dict[str, Value]:
    return {f"{name}.{key}": value for key, value in values.items()}
