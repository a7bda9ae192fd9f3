"""Which mistake an estimator makes, by its pose, its twist and the wrench that moves the vehicle.

    v_p = slope of p     v_t = R twist.linear     v_f = integral of R z T / m - g      (world)
    w_p = slope of R     w_t = twist.angular      w_f = integral of J^-1 tau           (body)
    s   = sum of (v_f - v_t) . (v_p - v_t) / sum of |v_p - v_t|^2

Sums are of changes over the last MEMORY s. Where pose and twist differ, s is near 0 if the pose is wrong, near 1 if the
twist is; in wind s passes 0, but the sum of |v_f - v_t|^2 is then larger than that of |v_p - v_t|^2.
A row of a table is a mistake: what it is called, and what it makes of the right value.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

from quad_core.geometry import ZERO, dot, norm, rotate, scale, subtract
from quad_core.types import Quat, Vec3

MEMORY = 0.5  # s over which a change is taken
KEPT = 0.99  # share of the sums that is left at the next look, 10 ms later
POSE_IS_WRONG, LEAST_APART = 0.3, 0.2
"""Largest size of s where the pose is wrong; sum of squares from which on s says something: 5 looks of 0.2 m/s."""
TURN, LEAST_MOTION = math.radians(10.0), 5.0
"""rad between two velocities that is no mistake yet; sum of squares that shows it: 0.5 s at 0.3 m/s."""
ASTRAY, LEAST_PUSH = math.radians(45.0), 60.0
"""The same between thrust and change of velocity: a gust of 0.5 s does not count."""
MOST = 2.0  # times as much as the thrust pushes that a position may be sped up
STOP, STOP_WITHIN = 0.6, 0.2
"""m/s by which a vehicle slows down within so many s only if something pushes it: 3 m/s^2 are more than wind does."""
JOLT, FALLS = 2.0, 1.5
"""The same of any change: gravity. Below so many m/s the ground may have stopped the vehicle."""
DEAF, DEAF_WITHIN = 4.0, 0.1
"""rad/s by which torque turns a vehicle more within so many s than in those before, so that its pose must show it."""
LAGS = (0.0, 0.01, 0.02, 0.03, 0.04)  # s by which a pose may be late without a word of it
DEAF_LOOKS = "a pose that comes late, one sent again, FRD axes, expected FLU, or a rotor that fails"
ALIKE = 0.9  # cosine of what is left between two vectors after a turn

Made = dict[str, Callable[[Vec3], Vec3]]

_EITHER: Made = {
    "the wrong sign": lambda right: scale(-1.0, right),
    "FRD axes, expected FLU": lambda right: Vec3(right.x, -right.y, -right.z),
    "x and y swapped": lambda right: Vec3(right.y, right.x, right.z),
    "a twist that is not filled in": lambda _: ZERO,
}
LINEAR: Made = {**_EITHER, "km/h, expected m/s": lambda right: scale(3.6, right)}
"""Mistakes in twist.linear: what each makes of the right one (body frame)."""
ANGULAR: Made = {**_EITHER, "deg/s, expected rad/s": lambda right: scale(math.degrees(1.0), right)}
"""Mistakes in twist.angular."""
POSITION: Made = {
    "x and y of the position swapped": lambda right: Vec3(right.y, right.x, right.z),
    "a left-handed frame, x mirrored": lambda right: Vec3(-right.x, right.y, right.z),
    "a left-handed frame, y mirrored": lambda right: Vec3(right.x, -right.y, right.z),
    "a position whose z points down": lambda right: Vec3(right.x, right.y, -right.z),
    "a position in NED, expected ENU": lambda right: Vec3(right.y, right.x, -right.z),
    "a position in mm, expected m": lambda right: scale(1000.0, right),
    "a position in cm, expected m": lambda right: scale(100.0, right),
    "a position in ft, expected m": lambda right: scale(1.0 / 0.3048, right),
}
"""Mistakes in the position: what each makes of the right velocity (world)."""
ATTITUDE: dict[str, Callable[[Quat], Quat]] = {
    "a quaternion in the order w, x, y, z, expected x, y, z, w": lambda q: Quat(q.y, q.z, q.w, q.x),
    "a quaternion from the world to the body, expected body to world": lambda q: Quat(-q.x, -q.y, -q.z, q.w),
    "an FRD body, expected FLU": lambda q: Quat(q.w, q.z, -q.y, -q.x),
}
"""Mistakes in the attitude: what makes each right again."""


def likely(made: Made, found: Vec3, right: Vec3, q: Quat | None = None) -> str:
    """Return which mistakes in the vector ``right`` explain what was found, the likeliest first, empty if none does.

    ``q``: the attitude, where both are in the body frame and one in the world is a mistake.
    """
    rows = {words: make(right) for words, make in made.items()}
    if q is not None:
        rows["the world frame, expected the body frame"] = rotate(q, right)
    return nearest(rows, found, right)


def nearest(rows: Mapping[str, Vec3], found: Vec3, right: Vec3) -> str:
    """Return which of ``rows`` lie nearer to ``found``, by half and more, than ``right`` does, the nearest first."""
    off = {words: norm(subtract(found, vector)) for words, vector in rows.items()}
    fits = sorted((words for words in off if off[words] < 0.5 * norm(subtract(found, right))), key=off.__getitem__)
    return " or ".join(fits)


def between(a: Vec3, b: Vec3) -> float:
    """Return the angle about the vertical in rad from one vector to another one."""
    return math.atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y)


def heading(angle: float) -> Made:
    """Return the mistake of a heading that is ``angle`` rad off, made of a velocity (world)."""
    turn = Quat(0.0, 0.0, -math.sin(0.5 * angle), math.cos(0.5 * angle))
    return {f"a heading that is off by {math.degrees(angle):.0f} deg": lambda right: rotate(turn, right)}


class Turn:
    """The angle about the vertical from one vector to another one, over the last second."""

    def __init__(self, least: float) -> None:
        """Begin without any; sums of squares below ``least`` say nothing."""
        self._least = least
        self._dot = self._cross = self._a = self._b = 0.0

    def note(self, a: Vec3, b: Vec3) -> None:
        """Take in a pair."""
        self._dot = KEPT * self._dot + a.x * b.x + a.y * b.y
        self._cross = KEPT * self._cross + a.x * b.y - a.y * b.x
        self._a = KEPT * self._a + a.x * a.x + a.y * a.y
        self._b = KEPT * self._b + b.x * b.x + b.y * b.y

    @property
    def angle(self) -> float:
        """The angle in rad, 0 where little moves or no turn explains the pairs."""
        return math.atan2(self._cross, self._dot) if self._is_sure else 0.0

    @property
    def factor(self) -> float:
        """Length of the second vector over that of the first, 1 where the angle is not known."""
        return math.sqrt(self._b / self._a) if self._is_sure else 1.0

    @property
    def _is_sure(self) -> bool:
        alike = math.hypot(self._dot, self._cross)
        return alike > self._least and alike > ALIKE * math.sqrt(self._a * self._b)


class Claim(NamedTuple):
    """What pose, twist and wrench say of a motion at one time in s."""

    time: float
    pose: Vec3
    twist: Vec3
    wrench: Vec3


class Witness:
    """The wrench, asked whether pose or twist is wrong."""

    def __init__(self) -> None:
        self._claims: deque[Claim] = deque()
        self._nearer = self._apart = self._unlike = 0.0

    def note(self, claim: Claim) -> tuple[Vec3, Vec3]:
        """Take in what is claimed; return by how much pose and wrench changed over the last MEMORY s."""
        self._claims.append(claim)
        while self._claims[0].time < claim.time - MEMORY:
            self._claims.popleft()
        pose, twist, wrench = (subtract(now, then) for now, then in zip(claim[1:], self._claims[0][1:], strict=True))
        between, unlike = subtract(pose, twist), subtract(wrench, twist)
        self._nearer = KEPT * self._nearer + dot(unlike, between)
        self._apart = KEPT * self._apart + dot(between, between)
        self._unlike = KEPT * self._unlike + dot(unlike, unlike)
        return pose, wrench

    def changes(self, span: float, ago: float = 0.0) -> tuple[Vec3, Vec3]:
        """Return by how much pose and wrench changed over ``span`` s that ended ``ago`` s before the newest claim."""
        end = self._claims[-1].time - ago
        now, then = self._at(end), self._at(end - span)
        return subtract(now.pose, then.pose), subtract(now.wrench, then.wrench)

    def hides(self, span: float, least: float) -> tuple[Vec3, Vec3] | None:
        """Return by how much more pose and wrench change within ``span`` s than before; None where the pose follows.

        It follows up to ``least``, and where it is within half of what the wrench says, as late as one of LAGS.
        """
        turned, spins = self._spurt(span, 0.0)
        if norm(spins) <= least:
            return None
        off = min(norm(subtract(turned, self._spurt(span, ago)[1])) for ago in LAGS)
        return (turned, spins) if off > 0.5 * norm(spins) else None

    def _spurt(self, span: float, ago: float) -> tuple[Vec3, Vec3]:
        now, before = self.changes(span, ago), self.changes(span, ago + span)
        return subtract(now[0], before[0]), subtract(now[1], before[1])  # a weak rotor turns a vehicle evenly

    def _at(self, time: float) -> Claim:
        return next((one for one in reversed(self._claims) if one.time <= time), self._claims[0])

    @property
    def blames_pose(self) -> bool:
        """Whether the pose is wrong, where both differ."""
        tells = self._apart > max(LEAST_APART, self._unlike)
        return tells and abs(self._nearer) < POSE_IS_WRONG * self._apart
