"""Figures of what went on inside a flight: commands, saturation, adaptation, sliding variables, disturbance."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quad_core.cascade import COMMAND
from quad_flight_log.analysis.arrays import norms
from quad_flight_log.analysis.metrics import thrust_and_torque
from quad_flight_log.report.figures import Figure, Floats, Line, Panel
from quad_flight_log.report.run import Run, position_error

_POSITION, _ATTITUDE = "position_controller/internals", "attitude_controller/internals"
_XYZ, _ANGLES = ("x", "y", "z"), ("φ", "θ", "ψ")
_LIMITS = ("thrust_high", "thrust_low", "roll_limited", "pitch_limited", "yaw_limited")


class _Quantity(NamedTuple):
    """A vector field of a topic, one panel per axis."""

    key: str
    title: str
    caption: str
    topic: str
    field: str
    symbol: str
    unit: str
    axes: tuple[str, ...]


_QUANTITIES = (
    _Quantity("adaptive-gains", "Adaptive gains of the position law", "ξ̂ of Eq. 37.",
              _POSITION, "adaptive_gain", "ξ̂", "1/s", _XYZ),
    _Quantity("integrals", "Error integrals of the position law", "Γ of Eq. 21.",
              _POSITION, "error_integral", "Γ", "m s", _XYZ),
    _Quantity("sliding", "Sliding variables", "s of Eq. 45.",
              _ATTITUDE, "sliding_variable", "s", "rad/s", _ANGLES),
    _Quantity("adaptive-constants", "Adaptive constants of the attitude law", "Q̂1 of Eq. 54.",
              _ATTITUDE, "adaptive_constant", "Q̂1", "rad/s²", _ANGLES),
    _Quantity("attitude-lyapunov", "Lyapunov functions of the attitude law", "l of Eq. 57, known terms only.",
              _ATTITUDE, "lyapunov", "l", "mixed", _ANGLES),
)  # fmt: skip


def inside_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return the figures of runs of one trajectory; quantities that no run has are left out."""
    prefix = runs[0].trajectory or "flight"
    figures = [_error_figure(runs), _thrust_figure(runs), _torque_figure(runs), _saturation_figure(runs)]
    figures += [_vector_figure(runs, quantity) for quantity in _QUANTITIES]
    figures += [_lyapunov_figure(runs), _disturbance_figure(runs)]
    return [
        figure._replace(key=f"{prefix}-{figure.key}")
        for figure in figures
        if any(len(panel.lines) for panel in figure.panels)
    ]


def _error_figure(runs: Sequence[Run]) -> Figure:
    lines = []
    for run in runs:
        if run.has("truth", "reference"):
            times, error = position_error(run)
            lines.append(Line(run.name, run.name, (times, norms(error))))
    caption = "Distance from the reference, approach included."
    return Figure("distance", "Distance from the reference", caption, (Panel("distance [m]", tuple(lines)),))


def _thrust_figure(runs: Sequence[Run]) -> Figure:
    lines = []
    for run in runs:
        if run.has(COMMAND):
            thrust, _ = thrust_and_torque(run.tables[COMMAND])
            lines.append(Line(run.name, f"{run.name}: commanded", (run.times(COMMAND), thrust), dashed=True))
        if run.has("actuation"):
            achieved = run.tables["actuation"]["thrust"]
            lines.append(Line(run.name, f"{run.name}: achieved", (run.times("actuation"), achieved)))
    caption = "Collective thrust along body z, commanded (Eq. 38) and achieved by the rotors."
    return Figure("thrust", "Thrust", caption, (Panel("thrust [N]", tuple(lines)),))


def _torque_figure(runs: Sequence[Run]) -> Figure:
    panels = []
    for axis, letter in enumerate(_XYZ):
        lines = []
        for run in runs:
            if run.has(COMMAND):
                _, torque = thrust_and_torque(run.tables[COMMAND])
                lines.append(Line(run.name, run.name, (run.times(COMMAND), torque[:, axis])))
        panels.append(Panel(f"τ{letter} [N m]", tuple(lines)))
    return Figure("torque", "Commanded torque", "Torque about the body axes (Eq. 56).", tuple(panels))


def _saturation_figure(runs: Sequence[Run]) -> Figure:
    lines = []
    for run in runs:
        if run.has("actuation"):
            table = run.tables["actuation"]
            count = np.sum([table[flag] for flag in _LIMITS], axis=0).astype(float)
            lines.append(Line(run.name, run.name, (run.times("actuation"), count)))
    caption = f"How many of {', '.join(_LIMITS)} are set."
    return Figure("saturation", "Saturation", caption, (Panel("flags set [1]", tuple(lines), steps=True),))


def _vector_figure(runs: Sequence[Run], quantity: _Quantity) -> Figure:
    panels = []
    for axis, letter in enumerate(quantity.axes):
        lines = []
        for run in runs:
            values = _column(run, quantity.topic, quantity.field, axis)
            if values is not None:
                lines.append(Line(run.name, run.name, (run.times(quantity.topic), values)))
        panels.append(Panel(f"{quantity.symbol}{letter} [{quantity.unit}]", tuple(lines)))
    return Figure(quantity.key, quantity.title, quantity.caption, tuple(panels))


def _lyapunov_figure(runs: Sequence[Run]) -> Figure:
    panels = []
    for field, label in (("lyapunov", "L"), ("lyapunov_rate", "L' bound")):
        known = [run for run in runs if run.has(_POSITION) and field in (run.tables[_POSITION].dtype.names or ())]
        lines = [Line(run.name, run.name, (run.times(_POSITION), run.tables[_POSITION][field])) for run in known]
        panels.append(Panel(f"{label} [mixed]", tuple(lines)))
    caption = "L_P of Eq. 35 without the unknown estimation-error terms, and the bound of Eq. 36 with the estimates."
    return Figure("position-lyapunov", "Lyapunov function of the position law", caption, tuple(panels))


def _disturbance_figure(runs: Sequence[Run]) -> Figure:
    panels = []
    for axis, letter in enumerate(_XYZ):
        lines = []
        for run in runs:
            true = _column(run, "disturbance", "lumped_acceleration_w", axis)
            if true is not None:
                lines.append(Line(run.name, f"{run.name}: true", (run.times("disturbance"), true), dashed=True))
            estimate = _column(run, _POSITION, "disturbance_estimate", axis)
            if estimate is not None:
                lines.append(Line(run.name, f"{run.name}: estimate", (run.times(_POSITION), estimate)))
        panels.append(Panel(f"D{letter} [m/s²]", tuple(lines), steps=True))
    caption = "D_P of Eqs. 10-12 as it truly was, and the position law's estimate of it (0: the law makes none)."
    return Figure("disturbance", "Disturbance and its estimate", caption, tuple(panels))


def _column(run: Run, topic: str, field: str, axis: int) -> Floats | None:
    if not run.has(topic) or field not in (run.tables[topic].dtype.names or ()):
        return None
    values: Floats = run.tables[topic][field]
    return values[:, axis] if values.ndim == 2 and axis < values.shape[1] else None
