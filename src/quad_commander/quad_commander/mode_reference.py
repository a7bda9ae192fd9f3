"""The reference of a mode, by one table: from the mode before, the mode, the ground and what flies to one of five acts.

``ACTS[before, mode, on_ground, laws_fly]`` is what begins at a step. ``on_ground``: the vehicle is not clear of the
ground. ``laws_fly``: the laws follow the reference. They do not where the guard, a pilot or an autopilot flies, or an
autopilot did at the step before, or where the autopilot's estimate has jumped.
"""

import itertools
from collections.abc import Callable, Iterable
from enum import Enum
from typing import NamedTuple

from quad_commander import references
from quad_commander.mode_table import BY_REFERENCE
from quad_commander.modes import Inputs
from quad_commander.parameters import ReferenceLimits
from quad_commander.references import Place, ReferencePlan
from quad_core.enumerations import ON_GROUND, Mode
from quad_core.geometry import ZERO
from quad_core.types import NOT_BEGUN, TrajectoryPoint, VehicleState

_UNSURE_GROUND = 5.0  # m; an autopilot's estimate moves in flight, and a landing goes on until it has met the ground


class Act(Enum):
    """What the reference does at a step; each is a method of ``ModeReference``."""

    CARRY_ON = "the plan that began earlier goes on"
    FROM_STATE = "a plan begins with the vehicle's own motion"
    FROM_REFERENCE = "a plan begins with the reference and brings it to rest: in LAND on the ground, in HOLD at a place"
    RISE = "a take-off begins at the vehicle"
    HAND_OVER = "the reference goes over to the mission's"


class ActRow(NamedTuple):
    """Where an act begins; an empty ``before`` is the mode itself, None means both."""

    before: Iterable[Mode]
    modes: Iterable[Mode]
    on_ground: bool | None
    laws_fly: bool | None
    act: Act


SAME: Iterable[Mode] = ()
UNFOLLOWED = tuple(mode for mode in Mode if mode not in (*ON_GROUND, *BY_REFERENCE))
ROWS = (
    ActRow(SAME, ON_GROUND, None, None, Act.CARRY_ON),
    ActRow(Mode, ON_GROUND, None, None, Act.FROM_STATE),
    ActRow(SAME, Mode, None, True, Act.CARRY_ON),
    ActRow(Mode, (Mode.TAKEOFF,), None, None, Act.RISE),
    ActRow(Mode, (Mode.MISSION,), None, None, Act.HAND_OVER),
    ActRow(Mode, Mode, None, False, Act.FROM_STATE),
    ActRow((*ON_GROUND, *UNFOLLOWED), Mode, None, True, Act.FROM_STATE),
    ActRow((Mode.TAKEOFF,), (Mode.LAND,), True, True, Act.FROM_STATE),
    ActRow(Mode, Mode, None, True, Act.FROM_REFERENCE),
)
"""The first row that fits counts."""


def _act(before: Mode, mode: Mode, on_ground: bool, laws_fly: bool) -> Act:
    return next(
        row.act
        for row in ROWS
        if before in (row.before or (mode,))
        and mode in row.modes
        and row.on_ground in (None, on_ground)
        and row.laws_fly in (None, laws_fly)
    )


ACTS = {key: _act(*key) for key in itertools.product(Mode, Mode, (False, True), (False, True))}


class ModeReference:
    """The reference, the plan that it follows and since when, and the place it was sent to."""

    def __init__(self, limits: ReferenceLimits, takeoff_height: float, state: VehicleState) -> None:
        """Stand at ``state``; take off to ``takeoff_height`` m above the ground."""
        self._limits, self._height = limits, takeoff_height
        self.point = references.from_state(state)._replace(v_w=ZERO)
        self.place: Place | None = None
        self._follow: Callable[[Inputs, Mode], TrajectoryPoint] = self._planned
        self._current, self._autopilot_flew, self._laws_fly = self.point, False, True
        self._plan = references.plan_mode(limits, Mode.DISARMED, self.point, 0.0, 0.0)
        self._hand_over: ReferencePlan | None = None
        self._aside: tuple[ReferencePlan, float] | None = None
        self._time = self._handed = 0.0

    @property
    def arrived(self) -> bool:
        """Whether the plan has come to rest."""
        return self._time >= self._plan.duration

    @property
    def rest_time(self) -> float:
        """For how long in s it has been at rest."""
        return max(self._time - self._plan.duration, 0.0)

    @property
    def is_handed_over(self) -> bool:
        """Whether it follows the mission's reference."""
        return self._hand_over is not None

    def step(self, seen: Inputs, before: Mode, mode: Mode, place: Place | None, is_granted: bool) -> TrajectoryPoint:
        """Return the reference in ``mode`` after ``before``.

        ``is_granted``: a request was granted at this step; ``place`` is the one that it names.
        """
        jumped = seen.by_autopilot and seen.estimator_reset
        others_fly = seen.autopilot_flies or (seen.by_autopilot and self._autopilot_flew) or jumped
        self._autopilot_flew = mode not in ON_GROUND and seen.autopilot_flies
        self._laws_fly = mode not in UNFOLLOWED and not others_fly
        act = ACTS[before, mode, seen.state.on_ground, self._laws_fly]
        if seen.by_autopilot and mode in ON_GROUND:  # its estimate wanders while the vehicle stands
            act = Act.FROM_STATE
        is_sent = is_granted and mode == Mode.HOLD and place != self.place
        if mode != before or is_sent:
            self.place = place if is_granted and mode == Mode.HOLD else None
        if is_sent and act == Act.CARRY_ON:
            act = Act.FROM_REFERENCE
        self._current = references.continued(self.point, seen.dt)
        _METHODS[act](self, seen, before, mode)
        self.point = self._follow(seen, mode)
        return self.point

    def carry_on(self, seen: Inputs, _before: Mode, _mode: Mode) -> None:
        """Let the plan go on."""
        self._time += seen.dt

    def from_state(self, seen: Inputs, before: Mode, mode: Mode) -> None:
        """Begin with the vehicle's own motion, or at rest on the ground."""
        self._begin(seen, mode, self._own_motion(seen, before, mode), self._planned)

    def from_reference(self, seen: Inputs, _before: Mode, mode: Mode) -> None:
        """Begin with the motion of the reference."""
        self._begin(seen, mode, self._current, self._planned)

    def rise(self, seen: Inputs, before: Mode, mode: Mode) -> None:
        """Begin to take off."""
        self._begin(seen, mode, self._own_motion(seen, before, mode), self._risen)

    def hand_over(self, seen: Inputs, before: Mode, mode: Mode) -> None:
        """Begin to follow the mission, from the reference or, if it was not followed, from the vehicle's own motion."""
        start = self._current if self._laws_fly else self._own_motion(seen, before, mode)
        self._begin(seen, mode, start, self._of_mission)

    def _own_motion(self, seen: Inputs, before: Mode, mode: Mode) -> TrajectoryPoint:
        own = references.from_state(seen.state)
        is_at_rest = mode in ON_GROUND or (before in ON_GROUND and self._laws_fly)
        return own._replace(v_w=ZERO) if is_at_rest else own

    def _begin(
        self, seen: Inputs, mode: Mode, start: TrajectoryPoint, follow: Callable[[Inputs, Mode], TrajectoryPoint]
    ) -> None:
        ground = seen.state.ground_z - (_UNSURE_GROUND if seen.by_autopilot and mode == Mode.LAND else 0.0)
        self._plan = references.plan_mode(self._limits, mode, start, ground, self._height, self.place)
        self._current, self._follow = start, follow
        self._time, self._hand_over, self._aside = 0.0, None, None

    def _planned(self, seen: Inputs, mode: Mode) -> TrajectoryPoint:
        point = references.sample(self._plan, self._time)
        sideways = self._time < max(self._plan.axes[0].duration, self._plan.axes[1].duration)
        if mode != Mode.LAND or not seen.guard.on_ground or sideways:
            return point
        return references.beside(point, TrajectoryPoint(p_w=seen.state.p_w))  # on the ground it must not tilt

    def _risen(self, seen: Inputs, _: Mode) -> TrajectoryPoint:
        """Return a point straight up, over where the air takes the vehicle until it may tilt."""
        if seen.state.on_ground or self._aside is None:
            own = references.from_state(seen.state)
            self._aside = references.plan_mode(self._limits, Mode.HOLD, own, 0.0, 0.0), self._time
        stop, since = self._aside
        point, beside = references.sample(self._plan, self._time), references.sample(stop, self._time - since)
        return references.beside(point, beside)

    def _of_mission(self, seen: Inputs, mode: Mode) -> TrajectoryPoint:
        """Return the mission's point plus what is left of the way to it; the plan's until there is one."""
        if seen.mission is None or rests(seen.mission):
            return self._planned(seen, mode)
        point = references.continued(seen.mission, seen.mission_lag)
        if self._hand_over is None:
            self._hand_over, self._handed = references.plan_hand_over(self._limits, self._current, point), 0.0
        else:
            self._handed += seen.dt
        return references.handed_over(self._hand_over, self._handed, point)


_METHODS = {
    Act.CARRY_ON: ModeReference.carry_on,
    Act.FROM_STATE: ModeReference.from_state,
    Act.FROM_REFERENCE: ModeReference.from_reference,
    Act.RISE: ModeReference.rise,
    Act.HAND_OVER: ModeReference.hand_over,
}


def rests(point: TrajectoryPoint) -> bool:
    """Return whether a mission's trajectory has not begun, or has ended."""
    return point.trajectory_time <= NOT_BEGUN
