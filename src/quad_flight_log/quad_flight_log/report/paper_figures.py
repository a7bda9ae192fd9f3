"""The figures of the paper's section 4 (5 to 18): path, x, y, z and the three Euler angles of both cases."""

from collections.abc import Sequence

import numpy as np

from quad_flight_log.analysis.arrays import euler_angles
from quad_flight_log.report.figures import REFERENCE, Figure, Floats, Line, Panel
from quad_flight_log.report.run import Run, attitude_error, position_error, same_reference

FIRST_FIGURE = {"case1": 5, "case2": 12}
CASES = {"case1": "Case 1: rectangle (Eqs. 61-64)", "case2": "Case 2: helix (Eqs. 65-68)"}
_MOTIONS = (("longitudinal", "x"), ("lateral", "y"), ("vertical", "z"))
_ANGLES = (("roll", "φ"), ("pitch", "θ"), ("yaw", "ψ"))


def paper_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return the seven figures of one case, for runs of one trajectory; what the bags do not hold is left out."""
    flown = [run for run in runs if run.has("truth")]
    if not flown:
        return []
    figures = [path_figure(flown)]
    figures += [position_figure(flown, axis) for axis in range(3)]
    figures += [attitude_figure(flown, axis) for axis in range(3)]
    return figures


def path_figure(runs: Sequence[Run]) -> Figure:
    """Return Fig. 5 or 12: flown paths and the reference in space."""
    lines = [Line(run.name, run.name, _columns(run.tables["truth"]["p_w"])) for run in runs]
    for run, label in _references(runs):
        lines.append(Line(_group(label), label, _columns(run.tables["reference"]["p_w"]), dashed=True))
    key, title = _named(runs, 0, "path", "3-D position trajectory tracking")
    return Figure(key, title, "The flown path and the reference, world frame (ENU).", (Panel("m", tuple(lines)),),
                  spatial=True)  # fmt: skip


def position_figure(runs: Sequence[Run], axis: int) -> Figure:
    """Return Fig. 6 to 8 or 13 to 15: one coordinate with its reference, and its error."""
    motion, letter = _MOTIONS[axis]
    lines = [Line(run.name, run.name, (run.times("truth"), run.tables["truth"]["p_w"][:, axis])) for run in runs]
    for run, label in _references(runs):
        values = run.tables["reference"]["p_w"][:, axis]
        lines.append(Line(_group(label), label, (run.times("reference"), values), dashed=True))
    errors = []
    for run in runs:
        if run.has("reference"):
            times, error = position_error(run)
            errors.append(Line(run.name, run.name, (times, error[:, axis])))
    key, title = _named(runs, 1 + axis, letter, f"{motion} translational motion tracking")
    panels = (Panel(f"{letter} [m]", tuple(lines)), Panel(f"{letter} error [m]", tuple(errors)))
    caption = "Above: position and reference. Below: flown minus reference (Eq. 18)."
    return Figure(key, title, caption, panels, span=_span(runs))


def attitude_figure(runs: Sequence[Run], axis: int) -> Figure:
    """Return Fig. 9 to 11 or 16 to 18: one Euler angle with what its own position law wanted, and its error."""
    angle, letter = _ANGLES[axis]
    lines, errors = [], []
    for run in runs:
        flown = np.unwrap(euler_angles(run.tables["truth"]["q_wb"])[:, axis])
        lines.append(Line(run.name, run.name, (run.times("truth"), flown)))
        if run.has("attitude_setpoint"):
            wanted = np.unwrap(run.tables["attitude_setpoint"]["angles"][:, axis])
            lines.append(Line(run.name, f"{run.name}: wanted", (run.times("attitude_setpoint"), wanted), dashed=True))
            times, error = attitude_error(run)
            errors.append(Line(run.name, run.name, (times, error[:, axis])))
    key, title = _named(runs, 4 + axis, angle, f"{angle} angle tracking")
    panels = (Panel(f"{letter} [rad]", tuple(lines)), Panel(f"{letter} error [rad]", tuple(errors)))
    caption = (
        "Above: the angle and, dashed, what the position law of the same flight asked for (Eq. 38). "
        "Below: flown minus wanted (Eq. 40)."
    )
    return Figure(key, title, caption, panels, span=_span(runs))


def _columns(points: Floats) -> tuple[Floats, ...]:
    return points[:, 0], points[:, 1], points[:, 2]


def _references(runs: Sequence[Run]) -> list[tuple[Run, str]]:
    """Return each different reference once, with its label."""
    known = [run for run in runs if run.has("reference")]
    different: list[Run] = []
    for run in known:
        if not any(same_reference(run, other) for other in different):
            different.append(run)
    if len(different) == 1:
        return [(different[0], REFERENCE)]
    return [(run, f"{run.name}: reference") for run in different]


def _group(label: str) -> str:
    return label.removesuffix(f": {REFERENCE}")


def _named(runs: Sequence[Run], offset: int, key: str, title: str) -> tuple[str, str]:
    trajectory = runs[0].trajectory
    first = FIRST_FIGURE.get(trajectory)
    name = f"{trajectory or 'flight'}-{key}"
    if first is None:
        return name, title[0].upper() + title[1:]
    number = first + offset
    return f"figure-{number:02d}-{name}", f"Figure {number}. {title[0].upper() + title[1:]}"


def _span(runs: Sequence[Run]) -> tuple[float, float] | None:
    """Return from the trajectory's start (the approach is left of it) to the end of the longest flight."""
    if not all(run.has("reference") for run in runs):
        return None
    end = max(float(run.times("truth")[-1]) for run in runs)
    return (0.0, round(end, 1)) if end >= 0.1 else None
