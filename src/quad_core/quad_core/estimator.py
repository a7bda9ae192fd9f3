"""What an estimator sends, sample by sample, as states on the grid of plant steps: checked, counted, completed.

    step = round((stamp - origin) / plant period)
    v    = slope of p, w_b = slope of the rotation vector, both by least squares over the last WINDOW s, age WINDOW / 2

Twist and slopes are held against each other and against the wrench that moves the vehicle (``quad_core.mistakes``). A
twist that does not fit is named, and from then on the slopes take its place; a pose that does not fit ends the flight.
A position that jumps is a reset: what it jumped by is taken off again, so that the states go on without a step; an
attitude that jumps is wrong. Stamps may jitter, samples may be doubled, swapped or missing: all are counted. A moving
vehicle whose pose is to the bit one of the last has not been measured: in lockstep its last state stands, else there is
none. A pose that stops without a push is wrong, and one that torque turns and that does not show it.
"""

import math
from collections import Counter, deque
from collections.abc import Sequence
from typing import NamedTuple

from quad_core.geometry import (
    ZERO,
    add,
    body_z,
    norm,
    relative_attitude,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    tilt,
    total,
)
from quad_core.mistakes import (
    ANGULAR,
    ASTRAY,
    ATTITUDE,
    DEAF,
    DEAF_LOOKS,
    DEAF_WITHIN,
    FALLS,
    JOLT,
    LEAST_MOTION,
    LEAST_PUSH,
    LINEAR,
    MEMORY,
    MOST,
    POSITION,
    STOP,
    STOP_WITHIN,
    TURN,
    Claim,
    Turn,
    Witness,
    between,
    heading,
    likely,
    nearest,
)
from quad_core.types import Quat, Vec3, VehicleState, fresh, with_ages

WINDOW = 0.024  # s over which velocity and body rates are derived, at least three samples
CHECK, CHECK_EVERY = 0.1, 0.01  # s over which a twist is held against the pose, and how often
VELOCITY_MISFIT, RATE_MISFIT, MISFIT_SHARE = 0.3, 0.6, 0.25
"""m/s and rad/s, and the share of the slope, by which a twist may differ."""
RESET_DISTANCE, RESET_ANGLE = 0.3, math.radians(18.0)
"""m and rad beyond what the motion explains, from which on a change of pose is a reset."""
RESTART = 1.0  # s by which a stamp may be off what the clock says: more is another clock, or another start of it
SLOWEST = 0.017
"""s between two samples from which on nothing can be flown: at 60 Hz two in a row may be lost before the guard's 0.05 s
end; the rest is what a clock is off."""
LEAST_SAMPLES = 20  # samples that show a spacing
UPRIGHT = math.radians(15.0)  # rad by which a vehicle may lean that has not flown yet
STILL = 1e-4  # m/s and rad/s below which the pose of a vehicle may stay the same
AT_REST = 0.05  # m/s below which the ground may hold a vehicle
REPLAYED, FINE, APART = 64, 5e-6, 1e-9
"""Poses of which a live estimate takes none again, if its position comes in steps finer than FINE m; m between two."""
STANDS, TURNED = 0.1, 0.1  # s for which a part may stay the same to the bit, and rad/s that torque makes meanwhile
LIGHT = 0.7  # thrust over weight below which a vehicle at rest stands on the ground
_RESETS = 5  # resets within RESTART that no estimator makes
_REPLAY = "the same poses"
_CROWDED = 10
"""Samples that fell into the step of another one and left theirs empty, after which the grid moves by half a step."""


class Drive(NamedTuple):
    """What the rotors do: thrust over mass along body z and gravity in m/s^2, torque over inertia in rad/s^2 (body)."""

    force: float
    gravity: float
    spin: Vec3


class Sample(NamedTuple):
    """One message: stamp in ns, arrival in s of the steady clock, pose, and the twist as sent (body) or None.

    ``pushed``, ``spun``: velocity m/s (world) and body rates rad/s that thrust and torque have given the vehicle.
    """

    stamp_ns: int
    arrived: float
    p_w: Vec3
    q_wb: Quat
    twist_linear: Vec3 | None = None
    twist_angular: Vec3 | None = None
    pushed: Vec3 = ZERO
    spun: Vec3 = ZERO

    @property
    def time(self) -> float:
        """The stamp in s."""
        return 1e-9 * self.stamp_ns


class Estimator:
    """Follows one estimator through a flight; ``news``: kind and text of what is still to be said of it.

    ``stall``: why its last sample was no new one, empty if it was; ``good_step``: the step of the last new one.
    """

    def __init__(self, name: str, plant_period: int, from_first: bool, lockstep: bool, delay: float) -> None:
        """Begin without a sample; ``name`` is the topic, ``delay`` in s is how old its samples are when they come."""
        self.name, self.news = name, deque[tuple[str, str]]()
        self.counts: Counter[str] = Counter()
        self.derives_velocity = self.derives_rate = False
        self.jitter_ns = self.good_step = 0
        self.stall = ""
        self._standing_stamps = 0
        self._period, self._from_first, self._lockstep, self._delay = plant_period, from_first, lockstep, delay
        self._origin: int | None = None if from_first else 0
        self._last: Sample | None = None
        self._state = VehicleState()  # of the last new sample
        self._step = -1
        self._crowded = self._skipped = 0  # samples in the step of another one, and steps left empty, since it moved
        self._seen: deque[Sample] = deque()
        self._poses: deque[tuple[Vec3, Quat]] = deque(maxlen=REPLAYED)
        self._grain = math.inf  # m: the smallest change of the position on any axis so far
        self._stands: dict[str, tuple[tuple[float, ...], Sample, float]] = {}  # value, since, smallest change
        self._offset = ZERO
        self._misfit_since: dict[str, float] = {}
        self._drives: deque[tuple[float, Drive]] = deque(maxlen=1000)  # and the newest stamp before each in s
        self._pushed = self._spun = ZERO
        self._rests = True
        self._of_velocity, self._of_rate, self._of_turn = Witness(), Witness(), Witness()
        self._resets: deque[float] = deque(maxlen=_RESETS)
        self._turned, self._astray = Turn(LEAST_MOTION), Turn(LEAST_PUSH)
        self._checked = -math.inf
        self._spacings: deque[float] = deque(maxlen=200)
        self._bound = 0
        self._lags: deque[int] = deque(maxlen=100)

    def wait(self, sample: Sample) -> None:
        """Take in a sample before the flight: it shows the spacing, and where stamps begin."""
        last = self._last
        if last is not None:
            self._spacings.append(sample.arrived - last.arrived)
            stands = sample.p_w != last.p_w and sample.stamp_ns <= last.stamp_ns
            self._standing_stamps = self._standing_stamps + 1 if stands else 0
        self._last = sample
        if self._from_first:
            self._origin = sample.stamp_ns

    @property
    def spacing(self) -> float:
        """Median time between the last samples in s, 0 if there were too few."""
        ordered = sorted(self._spacings)
        return ordered[len(ordered) // 2] if len(ordered) >= LEAST_SAMPLES - 1 else 0.0

    def refusal(self) -> str:
        """Return why nothing can be flown with it, empty if it can be: asked before the flight."""
        if self._last is not None:
            stamp, lean = self._last.time, tilt(self._last.q_wb)
            if lean > UPRIGHT:
                found = f"{self.name}: found the vehicle {math.degrees(lean):.0f} deg from upright before the flight"
                return f"{found}, expected at most {math.degrees(UPRIGHT):.0f} deg{self._looks_turned(self._last.q_wb)}"
            if not self._from_first and abs(stamp) > RESTART:
                found = f"{self.name}: its stamps are of another clock: found {stamp:.3f} s before the flight"
                return f"{found}, expected 0 s: set odometry_relay.stamps=first"
            if self._standing_stamps >= LEAST_SAMPLES:
                return f"{self.name}: its stamps do not advance, found {stamp:.3f} s in each"
        if self._lockstep:
            return ""
        if not self.spacing:
            count = len(self._spacings) + (self._last is not None)
            return f"{self.name}: found {count} messages, expected {LEAST_SAMPLES} to tell their spacing"
        if self.spacing <= SLOWEST:
            return ""
        return f"{self.name}: samples {1e3 * self.spacing:.1f} ms apart, expected at most {1e3 * SLOWEST:g} ms"

    def _looks_turned(self, q: Quat) -> str:
        fits = [words for words, mended in ATTITUDE.items() if tilt(mended(q)) < UPRIGHT]
        return f"; it looks like {' or '.join(fits)}" if fits else ""

    def take(self, sample: Sample) -> tuple[int, VehicleState] | None:
        """Return step and state of a sample in flight; None, counted, for one that comes too late or twice."""
        if self._origin is None:
            self._origin = sample.stamp_ns
        last = self._last if self._step >= 0 else None
        if last is not None and not self._lockstep:
            self._restart(last, sample)
        step = self._aligned(sample.stamp_ns)
        if step < 0:
            self._say("stamp_backwards", f"stamp {sample.stamp_ns} ns lies before the flight")
            return None
        if step <= self._step and last is not None:
            is_same = sample.p_w == last.p_w
            kind = "swapped" if step < self._step else "doubled" if is_same else "crowded"
            self.counts[f"{kind}_samples"] += 1
            self._crowded += kind == "crowded"
            if sample.stamp_ns <= last.stamp_ns:
                self.stall = self.stall or "its stamps do not advance"
            if self._from_first and min(self._crowded, self._skipped) >= _CROWDED:
                self._origin += self._period // 2  # samples lie where two steps meet: now in the middle of one
                self._crowded = self._skipped = 0
            return None
        if last is not None and (repeats := self._repeats(sample, last)):
            self.counts["repeated_samples"] += 1
            self.stall = repeats
            self._step = step
            return (step, self._state) if self._lockstep else None
        self._note(step, sample, last)
        self._state, self.stall, self.good_step = self._made(sample), "", step
        return step, self._state

    def _repeats(self, sample: Sample, last: Sample) -> str:
        """Return what a sample repeats, empty if it is a new one: the last pose, or some of the poses before it."""
        if sample.p_w == last.p_w and sample.q_wb == last.q_wb:
            if self.stall == _REPLAY:
                return _REPLAY
            return "the same pose" if self._moves() else ""
        is_told = self._grain < FINE and norm(subtract(sample.p_w, last.p_w)) > APART
        return _REPLAY if is_told and (sample.p_w, sample.q_wb) in self._poses else ""

    def _moves(self) -> bool:
        return norm(self._state.v_w) > STILL or norm(self._state.omega_b) > STILL

    def owner_is_at(self, step: int) -> None:
        """Note the vehicle's own plant step: a state ahead of it would be answered by a wrench from the future."""
        self._bound = max(self._bound, step)

    def drive(self, drive: "Drive") -> None:
        """Note what the rotors do to the vehicle from now on."""
        self._drives.append((self._last.time if self._last is not None else -math.inf, drive))

    def _aligned(self, stamp_ns: int) -> int:
        """Return the step of a stamp; where stamps count from the first one the vehicle's step sets their beginning."""
        assert self._origin is not None
        step = round((stamp_ns - self._origin) / self._period)
        if not self._from_first or self._lockstep:
            return step
        lag = self._bound - step
        self._lags.append(lag)
        shift = lag if lag < 0 else min(self._lags) if len(self._lags) == self._lags.maxlen else 0
        if shift:
            self._origin -= shift * self._period
            self._lags.clear()
        return step + shift

    def _note(self, step: int, sample: Sample, last: Sample | None) -> None:
        assert self._origin is not None
        off = abs(sample.stamp_ns - self._origin - step * self._period)
        if off:
            self.counts["stamps_off_grid"] += 1
            self.jitter_ns = max(self.jitter_ns, off)
        if last is not None:
            elapsed = sample.time - last.time
            moves = subtract(sample.p_w, last.p_w)
            self._grain = min(self._grain, *(abs(part) or math.inf for part in moves))
            self._integrate(sample, elapsed)
            self._spacings.append(elapsed)
            self._skipped += step > self._step + 1
            if self.spacing and elapsed > 1.6 * self.spacing:
                self.counts["missing_samples"] += round(elapsed / self.spacing) - 1
            self._look_for_reset(last, sample, elapsed)
        place = subtract(sample.p_w, self._offset)
        self._seen.append(sample._replace(p_w=place, pushed=self._pushed, spun=self._spun))
        self._look_for_standing(sample._replace(spun=self._spun))
        while len(self._seen) > 3 and self._seen[0].time < sample.time - CHECK:
            self._seen.popleft()
        self._step, self._last = step, sample
        self._poses.append((sample.p_w, sample.q_wb))
        self._check(sample.time)

    def _integrate(self, sample: Sample, elapsed: float) -> None:
        """Add up what thrust and torque did when the sample was taken; a vehicle at rest is held by the ground."""
        while len(self._drives) > 1 and self._drives[1][0] <= sample.time - self._delay:
            self._drives.popleft()
        drive = self._drives[0][1] if self._drives else None
        if drive is None or (self._rests and drive.force < LIGHT * drive.gravity):
            return
        self._spun = add(self._spun, scale(elapsed, drive.spin))
        if self._rests:
            return
        force = scale(drive.force, body_z(sample.q_wb))
        self._pushed = add(self._pushed, scale(elapsed, Vec3(force.x, force.y, force.z - drive.gravity)))

    def _look_for_standing(self, sample: Sample) -> None:
        """Name an attitude or a twist that stays the same to the bit while the position, by noise alone, does not."""
        twist = (*(sample.twist_linear or ()), *(sample.twist_angular or ()))
        for what, found in (("attitude", tuple(sample.q_wb)), ("twist", twist)):
            before, since, grain = self._stands.get(what, (found, sample, math.inf))
            if found != before:
                changes = [abs(now - then) or math.inf for now, then in zip(found, before, strict=False)]
                since, grain = sample, min([grain, *changes])
            self._stands[what] = found, since, grain
            is_told = any(found) and grain < FINE and sample.p_w != since.p_w and sample.time - since.time > STANDS
            if is_told and norm(subtract(sample.spun, since.spun)) > TURNED:
                self._say("wrong_pose", f"the same {what} since {since.time:.3f} s, though torque turns the vehicle")

    def _restart(self, last: Sample, sample: Sample) -> None:
        """Go on where the stamps were when they jump: a clock was set, or the first one was stale."""
        passed = sample.arrived - last.arrived
        jump = 1e-9 * (sample.stamp_ns - last.stamp_ns) - passed
        if abs(jump) <= RESTART:
            return
        assert self._origin is not None
        self._origin += sample.stamp_ns - last.stamp_ns - round(passed * 1e9 / self._period) * self._period
        self._seen.clear()
        self._say("stamps_jumped", f"stamps jumped by {jump:.3f} s; they count afresh from here")

    def _look_for_reset(self, last: Sample, sample: Sample, elapsed: float) -> None:
        """Take a jump of the position off; the attitude of a vehicle does not jump."""
        move, turn = subtract(sample.p_w, last.p_w), norm(_rotation(relative_attitude(last.q_wb, sample.q_wb)))
        if elapsed <= 0.01 and norm(move) <= 0.5 * RESET_DISTANCE and turn <= RESET_ANGLE:
            return  # nearly every sample, without a slope
        speed = self._slope().v_w if len(self._seen) >= 3 else ZERO
        jump = subtract(move, scale(elapsed, speed))
        if norm(jump) <= RESET_DISTANCE + 10.0 * elapsed * elapsed and turn <= RESET_ANGLE + 20.0 * elapsed:
            return
        self._offset = add(self._offset, jump)
        self._seen.clear()
        text = f"jumped by {norm(jump):.2f} m and {math.degrees(turn):.1f} deg within {1e3 * elapsed:.1f} ms"
        if turn > RESET_ANGLE + 20.0 * elapsed:
            self._say("wrong_pose", f"the pose {text}, which no vehicle turns")
        self._say("estimator_reset", f"{text}; its position counts on from where it was")
        self._resets.append(sample.time)
        if len(self._resets) == self._resets.maxlen and sample.time - self._resets[0] < RESTART:
            self._say("wrong_pose", f"the position jumped {len(self._resets)} times within {RESTART:g} s")

    def _made(self, sample: Sample) -> VehicleState:
        """Return the state of a sample; what is derived says its age."""
        v, w, age, rate_age = sample.twist_linear, sample.twist_angular, self._delay, self._delay
        if v is not None:
            v = rotate(sample.q_wb, v)
        if v is None or w is None or self.derives_velocity or self.derives_rate:
            slope = self._slope()
            if v is None or self.derives_velocity:
                v, age = slope.v_w, self._delay + slope.age
            if w is None or self.derives_rate:
                w, rate_age = slope.omega_b, self._delay + slope.age
        p = subtract(sample.p_w, self._offset)
        return with_ages(fresh(p, v, sample.q_wb, w), self._delay, age, self._delay, rate_age)

    def _recent(self) -> list[Sample]:
        chosen = [one for one in self._seen if one.time >= self._seen[-1].time - WINDOW]
        return chosen if len(chosen) >= 3 else list(self._seen)[-3:]

    def _slope(self) -> "Slope":
        return slope(self._recent())

    def _check(self, time: float) -> None:
        """Hold twist and pose of the last CHECK s against each other, and against what the wrench does."""
        too_few = len(self._seen) < 3 or time - self._seen[0].time < 0.5 * CHECK
        if too_few or abs(time - self._checked) < CHECK_EVERY:
            return
        self._checked = time
        seen, newest, true = list(self._seen), self._seen[-1], change(self._seen[0], self._seen[-1])
        pushed, spun = _mean([one.pushed for one in seen]), _mean([one.spun for one in seen])
        linear = angular = None
        if newest.twist_linear is not None:
            linear = _mean([rotate(one.q_wb, one.twist_linear or ZERO) for one in seen])
        if newest.twist_angular is not None:
            angular = _mean([one.twist_angular or ZERO for one in seen])
        self._rests = norm(true.v_w) < AT_REST and norm(linear or ZERO) < AT_REST
        if self._drives:
            changed, pushes = self._of_velocity.note(Claim(time, true.v_w, linear or true.v_w, pushed))
            self._of_rate.note(Claim(time, true.omega_b, angular or true.omega_b, spun))
            self._astray.note(pushes, changed)
            self._check_course(changed, pushes, true.v_w)
            self._check_turn(time)
        if linear is not None:
            self._check_velocity(time, linear, true.v_w)
        if angular is not None:
            self._check_rate(time, angular, true.omega_b)

    def _check_course(self, changed: Vec3, pushes: Vec3, velocity: Vec3) -> None:
        """Compare how the position is sped up with how the thrust pushes."""
        angle = self._astray.angle
        if abs(angle) > ASTRAY or self._astray.factor > MOST:
            looks = likely(POSITION | heading(-angle), changed, pushes)
            self._blame_pose("the position", changed, pushes, f"m/s more within {MEMORY:g} s", looks)
        found, expected = self._of_velocity.changes(STOP_WITHIN)
        off = subtract(found, expected)
        if norm(velocity) < FALLS:  # upwards the ground may push
            off = Vec3(off.x, off.y, min(off.z, 0.0))
        if norm(off) > JOLT:
            looks = likely(POSITION | heading(between(found, expected)), found, expected)
            self._blame_pose("the position", found, expected, f"m/s more within {STOP_WITHIN:g} s", looks)
        elif self._rests and norm(off) > STOP:
            self._blame_pose("the position", ZERO, scale(-1.0, off), "m/s", "the last pose, sent again")

    def _check_turn(self, time: float) -> None:
        """Compare how the attitude is turned with what torque does, within the last 0.02 s and those of 0.1 s ago."""
        recent = self._recent()
        omega = slope(recent).omega_b
        self._of_turn.note(Claim(time, omega, omega, _mean([one.spun for one in recent])))
        if deaf := self._of_turn.hides(DEAF_WITHIN, DEAF):
            self._blame_pose("the attitude", *deaf, f"rad/s more within {DEAF_WITHIN:g} s", DEAF_LOOKS)

    def _check_velocity(self, time: float, found: Vec3, true: Vec3) -> None:
        """Compare twist.linear, turned into the world, with the slope of the position."""
        self._turned.note(true, found)
        turn, q = self._turned.angle, self._seen[-1].q_wb
        wrong = norm(subtract(found, true)) > VELOCITY_MISFIT + MISFIT_SHARE * norm(true)
        if not self._lasts("velocity", wrong or abs(turn) > TURN, time, 0.5 * CHECK):
            return
        of_pose = POSITION | heading(turn or between(true, found))
        if self._of_velocity.blames_pose:
            self._blame_pose("the position", true, found, "m/s", likely(of_pose, true, found))
        elif not self.derives_velocity:
            self.derives_velocity = True
            looks = likely(LINEAR, rotate_inverse(q, found), rotate_inverse(q, true), q)
            self._name("linear", found, true, "m/s", looks or likely(of_pose, true, found))

    def _check_rate(self, time: float, found: Vec3, true: Vec3) -> None:
        """Compare twist.angular with the slope of the attitude."""
        wrong = norm(subtract(found, true)) > RATE_MISFIT + MISFIT_SHARE * norm(true)
        if not self._lasts("rate", wrong, time, 0.0):
            return
        if self._of_rate.blames_pose:
            ends = self._seen[0], self._seen[-1]
            mended = {
                words: change(*(one._replace(q_wb=mend(one.q_wb)) for one in ends)).omega_b
                for words, mend in ATTITUDE.items()
            }
            self._blame_pose("the attitude", true, found, "rad/s", nearest(mended, found, true))
        elif not self.derives_rate:
            self.derives_rate = True
            self._name("angular", found, true, "rad/s", likely(ANGULAR, found, true, self._seen[-1].q_wb))

    def _lasts(self, what: str, wrong: bool, time: float, patience: float) -> bool:
        if not wrong:
            self._misfit_since.pop(what, None)
            return False
        return time - self._misfit_since.setdefault(what, time) >= patience

    def _name(self, part: str, found: Vec3, true: Vec3, unit: str, looks: str) -> None:
        looks = f"it looks like {looks}; " if looks else ""
        text = (
            f"twist.{part} does not fit the change of pose: found {_shown(found)} {unit}, the pose changes by "
            f"{_shown(true)} {unit}; expected {unit} in the body frame (REP 105), FLU axes; {looks}"
            f"from now on it is derived from the pose, {1e3 * 0.5 * WINDOW:.0f} ms old"
        )
        self._say("wrong_twist", text)

    def _blame_pose(self, part: str, found: Vec3, expected: Vec3, unit: str, looks: str) -> None:
        text = f"{part} does not move as the wrench says: found {_shown(found)} {unit}, expected {_shown(expected)}"
        self._say("wrong_pose", f"{text}; it looks like {looks}" if looks else text)

    def _say(self, kind: str, text: str) -> None:
        self.counts[kind] += 1
        self.news.append((kind, f"{self.name}: {text}"))


class Slope(NamedTuple):
    """Velocity m/s (world), body rates rad/s, and how old both are in s."""

    v_w: Vec3
    omega_b: Vec3
    age: float


def slope(seen: Sequence[Sample]) -> Slope:
    """Return how the pose of ``seen`` changes, by least squares; zero for fewer than two samples."""
    if len(seen) < 2:
        return Slope(ZERO, ZERO, 0.0)
    newest = seen[-1]
    middle = sum(one.time for one in seen) / len(seen)
    spread = sum((one.time - middle) * (one.time - middle) for one in seen)
    if spread <= 0.0:
        return Slope(ZERO, ZERO, 0.0)
    v, w = ZERO, ZERO
    for one in seen:
        share = (one.time - middle) / spread
        v = add(v, scale(share, one.p_w))
        w = add(w, scale(share, _rotation(relative_attitude(newest.q_wb, one.q_wb))))
    return Slope(v, w, newest.time - middle)


def change(first: Sample, last: Sample) -> Slope:
    """Return the mean velocity and body rates from one pose to another one, as comparable with the mean of a twist."""
    elapsed = last.time - first.time
    turn = _rotation(relative_attitude(first.q_wb, last.q_wb))
    return Slope(scale(1.0 / elapsed, subtract(last.p_w, first.p_w)), scale(1.0 / elapsed, turn), 0.5 * elapsed)


def _mean(vectors: Sequence[Vec3]) -> Vec3:
    return scale(1.0 / len(vectors), total(vectors))


def _rotation(q: Quat) -> Vec3:
    """Return the rotation vector in rad of a unit quaternion, the short way."""
    sign = 1.0 if q.w >= 0.0 else -1.0
    sine = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z)
    factor = sign * 2.0 if sine < 1e-9 else sign * 2.0 * math.atan2(sine, abs(q.w)) / sine
    return Vec3(factor * q.x, factor * q.y, factor * q.z)


def _shown(v: Vec3) -> str:
    return f"({v.x:.2f}, {v.y:.2f}, {v.z:.2f})"
