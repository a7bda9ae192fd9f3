"""Waypoints as text: one a line (or after a semicolon), ``x y z`` in m and, where it changes, ``yaw``.

A yaw is in rad, or in degrees with ``deg`` behind it (``90deg``). What is not understood is refused with its line.
"""

import math
import re

import numpy as np

from quad_core.parameters import ParameterError
from quad_trajectory.minimum_snap import Table

MOST_POINTS = 32
FARTHEST = 1e4
CLOSEST = 0.01
"""m; between two waypoints, below which the path between them is no path."""

_NUMBER = re.compile(r"[+-]?\d+(\.\d+)?|[+-]?\.\d+", re.ASCII)
_TURN = 2.0 * math.pi


def written_points(text: str) -> list[list[float]]:
    """Return x, y, z in m and, where it is written, yaw in rad of each waypoint.

    Raises ParameterError, naming the line, if ``text`` is not 2 to MOST_POINTS waypoints apart from each other.
    """
    points: list[list[float]] = []
    for count, line in enumerate(re.split(r"[\n;]", text), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        where = f"points: waypoint {len(points) + 1} (line {count}): found {line.strip()!r}, expected"
        if len(words) not in (3, 4):
            raise ParameterError(f"{where} x y z in m and, if it changes, yaw in rad (or 90deg)")
        for word in (*words[:3], *(yaw.removesuffix("deg") for yaw in words[3:])):
            if not _NUMBER.fullmatch(word):
                raise ParameterError(f"{where} numbers as 12.5, not {word!r}")
        values = [math.radians(float(word[:-3])) if word.endswith("deg") else float(word) for word in words]
        if max(map(abs, values[:3])) > FARTHEST:
            raise ParameterError(f"{where} x y z in [-{FARTHEST:g}, {FARTHEST:g}] m")
        if len(values) == 4 and abs(values[3]) > _TURN:
            hint = "" if words[3].endswith("deg") else f"; for degrees write {words[3]}deg"
            raise ParameterError(f"{where} a yaw of at most one turn, 6.2831 rad or 360deg, either way{hint}")
        if points and math.dist(points[-1][:3], values[:3]) < CLOSEST:
            raise ParameterError(f"{where} a waypoint at least {CLOSEST} m from the one before")
        points.append(values)
    if not 2 <= len(points) <= MOST_POINTS:
        raise ParameterError(f"points: found {len(points)} waypoints, expected 2 to {MOST_POINTS}")
    return points


def read_points(text: str) -> Table:
    """Return the waypoints as rows (x, y, z in m, yaw in rad); a yaw holds until the next. Raises ParameterError.

    Whole turns are added to a yaw so that it is within half a turn of the one before.
    """
    rows: list[list[float]] = []
    for x, y, z, *yaw in written_points(text):
        before = rows[-1][3] if rows else None
        turned = yaw[0] if yaw else before or 0.0
        if before is not None:
            turned -= _TURN * math.floor((turned - before) / _TURN + 0.5)
        rows.append([x, y, z, turned])
    return np.array(rows)


def long_turns(text: str) -> list[str]:
    """Return a sentence for each waypoint whose yaw, as written, is over half a turn away."""
    flown, found, before = read_points(text)[:, 3], [], 0.0
    for row, (_, _, _, *yaw) in enumerate(written_points(text)):
        written = yaw[0] if yaw else before
        long, short, before = written - before, flown[row] - flown[row - 1], written
        if row and abs(long - short) > 1e-9:
            found.append(
                f"waypoint {row + 1}: the heading turns {math.degrees(short):.0f} deg, not {math.degrees(long):.0f} deg"
                " (for the long way write a waypoint between)"
            )
    return found
