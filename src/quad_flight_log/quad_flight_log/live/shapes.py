"""What is drawn of a flight at one instant: shapes in the world frame (ENU, m), known to no viewer in particular."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from quad_core.geometry import rotate
from quad_core.types import Quat, Vec3
from quad_flight_log.report.interactive_figures import PALETTE, REFERENCE_COLOUR
from quad_flight_log.report.vehicle_drawing import ARM, DISTURBANCE_SCALE, ROTORS, THRUST_SCALE

Point = tuple[float, float, float]
LINES, STRIP, DOTS, ARROW = "lines", "strip", "dots", "arrow"


class Snapshot(NamedTuple):
    """What is known at one instant; None where no message came yet. SI units, world frame, thrust in N along body z."""

    stamp_ns: int
    position: Vec3
    attitude: Quat
    reference: Vec3 | None = None
    thrust: float | None = None
    force: Vec3 | None = None


class Shape(NamedTuple):
    """One shape. ``kind``: pairs of points, a strip, dots, or an arrow (two points); ``width`` in m; ``#rrggbb``."""

    name: str
    kind: str
    points: tuple[Point, ...]
    width: float
    colour: str


class Trail:
    """The last points of a path, at least ``spacing`` m apart."""

    def __init__(self, length: int, spacing: float = 0.05) -> None:
        self._points: deque[Point] = deque(maxlen=length)
        self._spacing = spacing

    def add(self, point: Vec3) -> None:
        """Append ``point`` if it is far enough from the last one."""
        if self._points:
            x, y, z = self._points[-1]
            if (point.x - x) ** 2 + (point.y - y) ** 2 + (point.z - z) ** 2 < self._spacing**2:
                return
        self._points.append((point.x, point.y, point.z))

    @property
    def points(self) -> tuple[Point, ...]:
        """The points, oldest first."""
        return tuple(self._points)


def shapes(snapshot: Snapshot, flown: Trail, planned: Trail) -> list[Shape]:
    """Return everything that is to be seen, after both trails were given the newest points."""
    corners = [_moved(rotor, snapshot) for rotor in ROTORS]
    found = [
        Shape("vehicle", LINES, (corners[0], corners[2], corners[1], corners[3]), 0.06 * ARM, REFERENCE_COLOUR),
        Shape("rotors", DOTS, tuple(corners), 0.5 * ARM, PALETTE[0]),
        Shape(
            "forward",
            ARROW,
            (_point(snapshot.position), _moved((1.6 * ARM, 0.0, 0.0), snapshot)),
            0.06 * ARM,
            PALETTE[3],
        ),
        Shape("flown", STRIP, flown.points, 0.04, PALETTE[0]),
        Shape("planned", STRIP, planned.points, 0.03, "#9aa4af"),
    ]
    if snapshot.reference is not None:
        found.append(Shape("reference", DOTS, (_point(snapshot.reference),), 0.25, PALETTE[4]))
    if snapshot.thrust is not None:
        tip = _moved((0.0, 0.0, THRUST_SCALE * snapshot.thrust), snapshot)
        found.append(Shape("thrust", ARROW, (_point(snapshot.position), tip), 0.06, PALETTE[1]))
    if snapshot.force is not None:
        start, force = snapshot.position, snapshot.force
        tip = (
            start.x + DISTURBANCE_SCALE * force.x,
            start.y + DISTURBANCE_SCALE * force.y,
            start.z + DISTURBANCE_SCALE * force.z,
        )
        found.append(Shape("disturbance", ARROW, (_point(start), tip), 0.06, PALETTE[2]))
    return [shape for shape in found if len(shape.points) >= _FEWEST[shape.kind]]


_FEWEST = {LINES: 2, STRIP: 2, DOTS: 1, ARROW: 2}


def _point(vector: Vec3) -> Point:
    return vector.x, vector.y, vector.z


def _moved(body: Sequence[float], snapshot: Snapshot) -> Point:
    x, y, z = rotate(snapshot.attitude, Vec3(*body))
    return snapshot.position.x + x, snapshot.position.y + y, snapshot.position.z + z
