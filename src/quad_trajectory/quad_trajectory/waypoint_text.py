"""Waypoints as text: one a line (or after a semicolon), ``x y z`` in m and, where it changes, ``yaw``.

A yaw is in rad, or in degrees with ``deg`` behind it (``90deg``). ``check_points`` refuses, with its line, what
``read_points`` does not understand. ``read_points`` is pure: Numba compiles it with the plan. A number of at most 15
digits is an integer over a power of ten, both exact, so it has the bits of float().
"""

import math
import re

from numpy import zeros

from quad_core.parameters import ParameterError
from quad_trajectory.minimum_snap import Table

MOST_POINTS = 32
FARTHEST = 1e4
CLOSEST = 0.01
"""m; between two waypoints, below which the path between them is no path."""

_NUMBER = re.compile(r"[+-]?\d+(\.\d+)?|[+-]?\.\d+", re.ASCII)
_MOST_DIGITS = 15
_DEGREE = math.pi / 180.0
_TURN = 2.0 * math.pi

DOT, ZERO, NINE = ord("."), ord("0"), ord("9")


def check_points(text: str) -> None:
    """Raise ParameterError, naming the line, if ``text`` is not 2 to MOST_POINTS waypoints apart from each other."""
    points: list[list[float]] = []
    for count, line in enumerate(re.split(r"[\n;]", text), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        where = f"points: waypoint {len(points) + 1} (line {count}): found {line.strip()!r}, expected"
        if len(words) not in (3, 4):
            raise ParameterError(f"{where} x y z in m and, if it changes, yaw in rad (or 90deg)")
        for word in (*words[:3], *(yaw.removesuffix("deg") for yaw in words[3:])):
            if not _NUMBER.fullmatch(word) or sum(map(str.isdigit, word)) > _MOST_DIGITS:
                raise ParameterError(f"{where} numbers as 12.5, not {word!r}, of at most {_MOST_DIGITS} digits")
        values = [number(word) for word in words]
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


def read_points(text: str) -> Table:
    """Return the waypoints of a checked ``text`` as rows (x, y, z in m, yaw in rad); a yaw holds until the next.

    Whole turns are added to a yaw so that it is within half a turn of the one before.
    """
    table = zeros((MOST_POINTS, 4))
    count = 0
    for line in text.replace(";", "\n").split("\n"):
        words = line.partition("#")[0].split()
        if len(words) > 0:
            if count > 0:
                table[count, 3] = table[count - 1, 3]
            for column in range(len(words)):
                table[count, column] = number(words[column])
            count += 1
    for row in range(1, count):
        table[row, 3] -= _TURN * math.floor((table[row, 3] - table[row - 1, 3]) / _TURN + 0.5)
    return table[:count]


def long_turns(text: str) -> list[str]:
    """Return a sentence for each waypoint of a checked ``text`` whose yaw, as written, is over half a turn away."""
    flown, found, before = read_points(text)[:, 3], [], 0.0
    lines = [words for line in re.split(r"[\n;]", text) if (words := line.partition("#")[0].split())]
    for row, words in enumerate(lines):
        written = number(words[3]) if len(words) == 4 else before
        long, short, before = written - before, flown[row] - flown[row - 1], written
        if row and abs(long - short) > 1e-9:
            found.append(
                f"waypoint {row + 1}: the heading turns {math.degrees(short):.0f} deg, not {math.degrees(long):.0f} deg"
                " (for the long way write a waypoint between)"
            )
    return found


def number(word: str) -> float:
    """Return the decimal number ``word``, in rad if ``deg`` stands behind it."""
    digits = 0
    scale = 1
    fraction = False
    for letter in word:
        code = ord(letter)
        if code == DOT:
            fraction = True
        elif ZERO <= code <= NINE:
            digits = 10 * digits + (code - ZERO)
            scale = 10 * scale if fraction else scale
    value = digits / scale
    if word.startswith("-"):
        value = -value
    if word.endswith("deg"):
        value *= _DEGREE
    return value
