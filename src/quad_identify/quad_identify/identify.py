"""Identification of a vehicle from its flights: fit, verdict, and errors on what the fit has not seen.

Example, in a notebook::

    flight = Flight(Samples(t, force), Samples(t, rates), Samples(t, motors), rotors=ARRANGEMENTS["x"])
    result = identify([flight], mass=0.5, arms=(0.09, 0.09))
    print(result.text())
"""

import json
from typing import Any, NamedTuple

import numpy as np

from quad_identify.fit import Fit, Report, fitted
from quad_identify.model import AT, NAMES, Model
from quad_identify.prediction import Errors, held_out
from quad_identify.record import WINDOW, Flight, Floats, Grid, RecordError, checked, gridded
from quad_identify.state_age import state_ages
from quad_identify.verdict import UNITS, Parameter, evidence, given, judged, trimmed, unknown

KEPT_OUT = 0.2  # share of a single flight that the errors are measured on


class Result(NamedTuple):
    """What flights tell. ``parameters``: {name: Parameter}; ``held_out``: {quantity: {predictor: RMS error}}.

    ``notes``: what was left out or assumed. ``fit`` is None where only the trim could be judged. ``full_speed`` rad/s
    is what command 1 means where speeds were logged, 0 where not; ``mean_voltage`` V that of the curve, 0 without.
    """

    parameters: dict[str, Parameter]
    held_out: Errors
    notes: list[str]
    fit: Fit | None
    full_speed: float
    mean_voltage: float

    def told(self, name: str) -> float | None:
        """Return the value of a parameter that is told, or None."""
        found = self.parameters[name]
        return found.value if found.told and isinstance(found.value, float) else None

    def as_json(self) -> str:
        """Return parameters, held-out errors and notes."""
        content: dict[str, Any] = {name: found._asdict() for name, found in self.parameters.items()}
        return json.dumps({"parameters": content, "held_out": self.held_out, "notes": self.notes}, indent=2)

    def text(self) -> str:
        """Return the verdict, a line per parameter, then errors and notes."""
        lines = [line for name, found in self.parameters.items() for line in _lines(name, found)]
        if self.held_out:
            lines.append("held out, RMS error:")
        for quantity, errors in self.held_out.items():
            lines.append(f"  {quantity}: " + ", ".join(f"{name} {value:.3g}" for name, value in errors.items()))
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])


def _lines(name: str, found: Parameter) -> list[str]:
    between = ""
    if found.low is not None:
        low, high = (np.atleast_1d(np.asarray(end, float)) for end in (found.low, found.high))
        values = np.atleast_1d(np.asarray(found.value if found.value is not None else np.nan, float))
        shown = ", ".join(
            f"{v:.4g} [{a:.4g}, {b:.4g}]" for v, a, b in zip(np.resize(values, len(low)), low, high, strict=True)
        )
        between = shown.replace("nan ", "") + (f" {found.unit}" if found.unit else "")
    if found.told:
        return [f"{name}: {between} ({found.why})"]
    return [f"{name}: not told{f', in {between}' if between else ''}: {found.why}"] + (
        [f"  fly: {found.fly}"] if found.fly else []
    )


def identify(
    flights: list[Flight],
    mass: float | None = None,
    arms: tuple[float, float] | None = None,
    *,
    curve: float | None = None,
    delay: float | None = None,
    prior: dict[str, float] | None = None,
    last_held_out: bool = False,
    judge: bool = True,
    report: Report = lambda _: None,
) -> Result:
    """Return what ``flights`` tell of one vehicle.

    ``mass`` kg; ``arms`` m: places of the rotors along x and along y. Known beforehand: ``curve``, share of the square
    term (PX4's THR_MDL_FAC), and ``delay`` in s. ``prior``: parameters of a model to compare with ({name of NAMES:
    value}). Errors are measured on the last flight if ``last_held_out``, else on the last fifth of each (not at all
    without ``judge``), before the fit to all of it. Raises RecordError where nothing can be said.
    """
    notes: list[str] = []
    whole: list[Flight] = []
    for flight in flights:
        good, said = checked(flight)
        whole, notes = [*whole, good], notes + said
    moving = [flight for flight in whole if flight.specific_force is not None and flight.body_rates is not None]
    full_speed = max((float(np.percentile(one.motors.values, 99.9)) for one in moving if one.speeds), default=0.0)
    if len(moving) < len(whole):
        return _of_trim(whole, mass, notes)
    if full_speed:
        curve = 1.0
        notes.append(f"speeds were logged: thrust is their square, command 1 is {full_speed:.0f} rad/s")
    of_flights = [gridded(flight, full_speed or 1.0) for flight in moving]
    grids = [grid for each in of_flights for grid in each]
    errors: Errors = {}
    if judge:
        pieces = len(of_flights[-1])
        fit_to, kept = (grids[:-pieces], grids[-pieces:]) if last_held_out and len(moving) > 1 else _split(grids)
        report("fit to what is not held out")
        model = Model(fit_to, arms or (1.0, 1.0), curve, delay)
        seen = fitted(model, report=report)
        models = {"identified": seen.p} | ({"prior": _prior(seen.p, prior)} if prior else {})
        test = Model(kept, arms or (1.0, 1.0), curve, delay)
        test.mean_voltage = model.mean_voltage
        errors = held_out(test, models)
    model = Model(grids, arms or (1.0, 1.0), curve, delay)
    fit = fitted(model, seen.p if judge else None, report)
    if fit.left_out:
        notes.append(f"{WINDOW * fit.left_out:g} of {WINDOW * (fit.left_out + fit.windows):g} s left out: large errors")
    parameters = judged(evidence(model, fit, mass, arms)) | state_ages(grids)
    if any(flight.differentiated for flight in moving):
        why = "the specific force was had from this velocity"
        parameters["velocity_age"] = unknown("velocity_age", why, "log an accelerometer")
    return Result(parameters, errors, notes, fit, full_speed, model.mean_voltage)


def _split(grids: list[Grid]) -> tuple[list[Grid], list[Grid]]:
    """Return grids with the first windows of each, and with the last fifth."""
    cuts = [max(1, round(len(grid.windows) * (1.0 - KEPT_OUT))) for grid in grids]
    pairs = list(zip(grids, cuts, strict=True))
    return (
        [grid._replace(windows=grid.windows[:cut]) for grid, cut in pairs],
        [grid._replace(windows=grid.windows[cut:]) for grid, cut in pairs if cut < len(grid.windows)],
    )


def _prior(like: Floats, prior: dict[str, float]) -> Floats:
    p = np.zeros(len(NAMES))
    p[AT["flatness"]], p[AT["rotor_time_constant"]] = 0.9, 1e-4
    p[AT["force_bias_x"] : AT["force_bias_y"] + 1] = like[AT["force_bias_x"] : AT["force_bias_y"] + 1]
    for name, value in prior.items():
        p[AT[name]] = value
    return p


def _of_trim(flights: list[Flight], mass: float | None, notes: list[str]) -> Result:
    """Return what motors alone tell: which rotor works harder in level flight."""
    missing = {name for one in flights for name in ("specific_force", "body_rates") if getattr(one, name) is None}
    lacks = " and ".join(sorted(missing)).replace("_", " ")
    parameters = {name: unknown(name, f"no {lacks} in the log", "log accelerometer, gyro and motors") for name in UNITS}
    if mass is not None:
        parameters["mass"] = given("mass", mass)
    flown = []
    for flight in flights:
        total, second = flight.motors.values.sum(axis=1), round(flight.motors.rate)
        level = np.flatnonzero(total > 0.7 * np.median(total[total > 0.3 * np.percentile(total, 95.0)]))
        if len(level) < 3 * second:
            found = f"{len(level) / second:.1f} s of flight, expected at least 3 s"
            raise RecordError(f"{flight.name}: motors: found {found}")
        flown.append(flight.motors.values[level[second:-second]])
    parameters["rotor_effectiveness"] = trimmed(np.concatenate(flown).mean(axis=0))
    return Result(parameters, {}, notes, None, 0.0, 0.0)
