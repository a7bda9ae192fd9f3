"""Which state the guard accepts: the newest good sample, else a prediction with the nominal model.

After a reset that turns it, and when the motion contradicts its heading (``quad_guard.motion``), the attitude of a
sample is not used. That of the last good sample is then carried on by the body rates, its tilt held by the specific
force that the velocity shows,

    q' = q exp(omega dt + K b x s / g),   s = dv / dt + g z,

and its heading by what the motion explains best.
"""

from typing import NamedTuple

from quad_core.cycle import BODY_RATE_BOUND
from quad_core.enumerations import StateRefusal
from quad_core.geometry import ZERO, body_z, clamp, cross, norm, rotate_inverse, rotated_by_vector, scale
from quad_core.node_parameters import ContactRule, GuardParameters, StateLimits
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle, max_thrust
from quad_guard.backup import predict
from quad_guard.checks import BodyState, StateSample, attitude_change, sample_refusal
from quad_guard.motion import LOST, NO_EVIDENCE, Evidence, about_z, begun_anew, gathered, turn_found, unexplained
from quad_guard.unknown_torque import UnknownTorque, torque_at

COARSEST = 0.02  # m, m/s, rad/s and parts of a quaternion: the grain of an estimate that has not changed yet

LEAST = 1e-9  # m, m/s, rad, rad/s: a change below need not show
SETTLED = 0.05  # s after a change until the wrench is that of the unchanged state


class Grain(NamedTuple):
    """The smallest change of an estimate on any axis: m, m/s, rad/s; of a part of the quaternion."""

    p: float
    v: float
    omega: float
    q: float


class Missing(NamedTuple):
    """What a state that repeats itself has not shown: ``time`` s, ``speed`` u, ``shift`` s, ``turn`` w, as above.

    ``held`` is the wrench f_0, tau_0. ``shows``: a live vehicle would have shown it since the last change.
    """

    held: Wrench
    time: float
    speed: float
    shift: float
    turn: Vec3
    shows: bool


COARSEST_GRAIN = Grain(COARSEST, COARSEST, COARSEST, COARSEST)  # the grain before the first change
NOTHING_MISSING = Missing(Wrench(), 0.0, 0.0, 0.0, Vec3(), False)  # what is missing at a change


def finer(grain: Grain, before: BodyState, after: VehicleState) -> Grain:
    """Return the grain after a change from ``before`` to ``after``."""
    a, b = before.q_wb, after.q_wb
    return Grain(
        smallest(grain.p, before.p_w, after.p_w),
        smallest(grain.v, before.v_w, after.v_w),
        smallest(grain.omega, before.omega_b, after.omega_b),
        smaller(smaller(smaller(smaller(grain.q, a.x, b.x), a.y, b.y), a.z, b.z), a.w, b.w),
    )


def smallest(grain: float, before: Vec3, after: Vec3) -> float:
    """Return the grain of a vector after a change."""
    return smaller(smaller(smaller(grain, before.x, after.x), before.y, after.y), before.z, after.z)


def smaller(grain: float, before: float, after: float) -> float:
    """Return the grain of a number after a change; a number that stays the same does not tell its grain."""
    change = abs(after - before)
    return change if 0.0 < change < grain else grain


def missed(
    rule: ContactRule,
    vehicle: Vehicle,
    grain: Grain,
    missing: Missing,
    last: BodyState,
    height: float,
    flown: Wrench,
    dt: float,
) -> Missing:
    """Return what is missing ``dt`` s later under ``flown`` if the state still is ``last``, ``height`` m up.

        v t + n s >= 2 grain,  n u >= 2 grain,  |omega| t >= 4 grain,  w >= 2 grain       on any axis: it is frozen
        u' = (f - f_0) / m,  s' = u,  w' = J^-1 (tau - tau_0)

    t is the time since the state last changed, v, n and omega are its velocity, body z axis and body rate, f_0 and
    tau_0 the wrench 0.05 s after that change, when the controllers have answered it, f and tau the one flown now. The
    grain is the smallest change that the estimate has shown so far: an estimate in whole millimetres repeats itself in
    a calm hover, one with noise never does. On the ground only thrust beyond the weight moves a vehicle.
    """
    thrust, weight = clamp(flown.thrust, 0.0, max_thrust(vehicle)), vehicle.mass * vehicle.gravity
    low = height <= rule.stop_height
    if low and thrust <= weight and norm(last.v_w) < rule.speed:
        return NOTHING_MISSING
    held = missing.held if missing.time >= SETTLED else flown
    before = weight if low else clamp(held.thrust, 0.0, max_thrust(vehicle))
    speed = missing.speed + dt * (thrust - before) / vehicle.mass
    time, shift = missing.time + dt, missing.shift + dt * speed
    turn = Vec3(
        missing.turn.x + dt * (flown.torque_b.x - held.torque_b.x) / vehicle.inertia_xx,
        missing.turn.y + dt * (flown.torque_b.y - held.torque_b.y) / vehicle.inertia_yy,
        missing.turn.z + dt * (flown.torque_b.z - held.torque_b.z) / vehicle.inertia_zz,
    )
    up, v = body_z(last.q_wb), last.v_w
    shows = (
        missing.shows
        or exceeds(grain.omega, turn.x, turn.y, turn.z)
        or exceeds(grain.v, up.x * speed, up.y * speed, up.z * speed)
        or exceeds(grain.p, time * v.x + up.x * shift, time * v.y + up.y * shift, time * v.z + up.z * shift)
        or time * norm(last.omega_b) >= max(4.0 * grain.q, LEAST)
    )
    return Missing(held, time, speed, shift, turn, shows)


def exceeds(grain: float, x: float, y: float, z: float) -> bool:
    """Return whether a change of a vector must show on one of its axes."""
    least = max(2.0 * grain, LEAST)
    return abs(x) >= least or abs(y) >= least or abs(z) >= least


REFUSED_COUNT, REFUSED_WINDOW = 10, 0.2
"""So many refused samples within so many s end the controller's flight (ArduPilot)."""
LONGEST_CARRY, TILT_BANDWIDTH = 0.3, 0.3  # an attitude may be carried over a gap of so many s; K in rad/s
NEVER_SEEN = 0.5  # s without a first sample until the motors stop


class Estimate(NamedTuple):
    """The state as the guard knows it, and the last accepted sample with its ``ground_z`` m. Steps are -1 before one.

    ``step`` is that of the last accepted sample, ``rate_step`` that of the last measured body rate. ``reading`` is the
    body rate in rad/s of the estimator's newest reading, accepted or not. ``grain`` and ``missing`` tell a frozen
    sample (``missed``), ``evidence`` a wrong heading. ``believed``: the attitude is that of the samples, not
    carried on; ``knows_heading``: the motion has not spoken against every heading that could be carried on.
    """

    state: BodyState
    sample: BodyState
    ground_z: float
    step: int
    rate_step: int
    reading: Vec3
    grain: Grain
    missing: Missing
    evidence: Evidence
    believed: bool
    knows_heading: bool


class Refusals(NamedTuple):
    """Refused samples: in all, and within the window that began at step ``start``; ``reset``: a jump was accepted."""

    total: int
    start: int
    recent: int
    reset: bool


_REST = BodyState(ZERO, ZERO, Quat(), ZERO)
NO_ESTIMATE = Estimate(_REST, _REST, 0.0, -1, -1, ZERO, COARSEST_GRAIN, NOTHING_MISSING, NO_EVIDENCE, True, True)
"""What is known before the first sample: nothing, written as rest in the origin."""


def observe(
    parameters: GuardParameters,
    vehicle: Vehicle,
    estimate: Estimate,
    refusals: Refusals,
    sample: StateSample,
    flown: Wrench,
    unknown: UnknownTorque,
    now: int,
    period: int,
    dt: float,
) -> tuple[Estimate, Refusals, int]:
    """Return the estimate at plant step ``now``, the counts and the refusal of ``sample``.

    ``flown``: the last wrench, ``unknown``: the torque in addition to it and after its lag. After too many refusals
    the next sample that only jumped is accepted: the estimator was reset, and the backup law flies better on its new
    position and velocity than on a prediction. Of other samples the body rate is used, unless it repeats itself to the
    last bit: whatever froze the attitude may have frozen the rate.
    """
    limits = parameters.state
    refusals = expired(refusals, now, period)
    refusal, gyro, grain, missing = StateRefusal.ACCEPTED, False, estimate.grain, estimate.missing
    state, reading, last = estimate.state, estimate.reading, estimate.sample
    is_new = sample.arrived and not (estimate.step >= 0 and is_same(sample.state, last))
    if estimate.step >= 0 and not is_new:
        missing = missed(parameters.contact, vehicle, grain, missing, last, last.p_w.z - estimate.ground_z, flown, dt)
    if sample.arrived:
        turned, turned_step = turned_by_rates(estimate)
        frozen = not is_new and missing.shows
        refusal = sample_refusal(limits, sample, last, estimate.step, turned, turned_step, now, period, frozen)
        if refusal == StateRefusal.ACCEPTED:
            if is_new:
                grain = finer(grain, last, sample.state) if estimate.step >= 0 else grain
                missing = NOTHING_MISSING
            found = accepted(vehicle, estimate, sample, grain, missing, flown.thrust, period, dt)
            return found, refusals, refusal
        refusals = counted(refusals, refusal, now)
        if is_jump(refusal) and is_full(refusals):
            reset = Refusals(refusals.total, refusals.start, refusals.recent, True)
            known = after_reset(limits, estimate, sample, now, period)
            found = accepted(vehicle, known, sample, grain, NOTHING_MISSING, flown.thrust, period, dt)
            return found, reset, refusal
        rate = sample.state.omega_b
        gyro = rate_serves(refusal) and is_bounded(rate) and rate != reading
        reading = rate
        if gyro:
            state = BodyState(state.p_w, state.v_w, state.q_wb, rate)
    if estimate.step < 0:
        return estimate, refusals, refusal
    made, d = unknown.made, torque_at(vehicle, unknown, unknown.thrust)
    acting = Wrench(estimate.evidence.strength * flown.thrust, Vec3(made.x + d.x, made.y + d.y, made.z + d.z))
    predicted = predict(vehicle, state, acting, gyro, dt)
    rate_step = now if gyro else estimate.rate_step
    # fmt: off
    after = Estimate(
        predicted, last, estimate.ground_z, estimate.step, rate_step, reading, grain, missing,
        estimate.evidence, estimate.believed, estimate.knows_heading,
    )
    # fmt: on
    return after, refusals, refusal


def turned_by_rates(estimate: Estimate) -> tuple[BodyState, int]:
    """Return the last sample, or the state whose attitude measured body rates have turned since; and its step."""
    if estimate.rate_step > estimate.step:
        return estimate.state, estimate.rate_step
    return estimate.sample, estimate.step


def after_reset(limits: StateLimits, estimate: Estimate, sample: StateSample, now: int, period: int) -> Estimate:
    """Return ``estimate`` before a reset to ``sample`` is accepted: it no longer believes attitudes if that one turns.

    What was not seen for longer than LONGEST_CARRY was predicted without body rates, and is no better than the sample.
    """
    is_carried = (now - estimate.step) * period / 1e9 <= LONGEST_CARRY
    return with_belief(estimate, False) if is_carried and is_turned(limits, estimate, sample.state.q_wb) else estimate


def accepted(
    vehicle: Vehicle,
    before: Estimate,
    sample: StateSample,
    grain: Grain,
    missing: Missing,
    thrust: float,
    period: int,
    dt: float,
) -> Estimate:
    """Return what is known from a sample that is accepted; ``grain`` and ``missing`` as in ``Estimate``."""
    state, believed, knows_heading = sample.state, before.believed, before.knows_heading
    q = state.q_wb if believed else carried(vehicle, before, sample, period, dt)
    evidence = gathered(before.evidence, vehicle, state.v_w, q, thrust, sample.step, period)
    if evidence.step != before.evidence.step:
        turn = turn_found(evidence)
        if turn != 0.0:
            q, evidence, believed = about_z(turn, q), begun_anew(evidence), False
        elif not believed and unexplained(evidence) > LOST:
            knows_heading = False
    motion = BodyState(state.p_w, state.v_w, q, state.omega_b)
    seen = BodyState(state.p_w, state.v_w, state.q_wb, state.omega_b)
    # fmt: off
    return Estimate(
        motion, seen, state.ground_z, sample.step, sample.step, state.omega_b, grain, missing,
        evidence, believed, knows_heading,
    )
    # fmt: on


def carried(vehicle: Vehicle, before: Estimate, sample: StateSample, period: int, dt: float) -> Quat:
    """Return the attitude ``dt`` s after that of ``before``, as body rates and the change of velocity have it."""
    q = rotated_by_vector(before.state.q_wb, scale(dt, before.state.omega_b))
    gap = (sample.step - before.step) * period / 1e9
    v, last, weight = sample.state.v_w, before.sample.v_w, gap * vehicle.gravity
    pull = cross(body_z(q), Vec3((v.x - last.x) / weight, (v.y - last.y) / weight, (v.z - last.z) / weight + 1.0))
    size = norm(pull)
    share = gap * TILT_BANDWIDTH * (1.0 if size <= 1.0 else 1.0 / size)
    return rotated_by_vector(q, rotate_inverse(q, scale(share, pull)))


def with_belief(e: Estimate, believed: bool) -> Estimate:
    """Return estimate ``e`` that believes the attitude of samples, or no longer does."""
    # fmt: off
    return Estimate(
        e.state, e.sample, e.ground_z, e.step, e.rate_step, e.reading, e.grain, e.missing, e.evidence, believed, True,
    )
    # fmt: on


def is_misled(limits: StateLimits, estimate: Estimate) -> bool:
    """Return whether samples are accepted whose attitude is not the vehicle's."""
    return not estimate.believed and is_turned(limits, estimate, estimate.sample.q_wb)


def is_turned(limits: StateLimits, estimate: Estimate, q: Quat) -> bool:
    """Return whether attitude ``q`` of a sample is too far from that of ``estimate``."""
    return attitude_change(estimate.state.q_wb, q) > limits.attitude_jump


def is_same(a: VehicleState, b: BodyState) -> bool:
    """Return whether two states are one reading, whatever they say of its age and of the ground."""
    return a.p_w == b.p_w and a.v_w == b.v_w and a.q_wb == b.q_wb and a.omega_b == b.omega_b


def is_bounded(omega: Vec3) -> bool:
    """Return whether a body rate is finite and within ``cycle.BODY_RATE_BOUND``."""
    return abs(omega.x) <= BODY_RATE_BOUND and abs(omega.y) <= BODY_RATE_BOUND and abs(omega.z) <= BODY_RATE_BOUND


def is_jump(refusal: int) -> bool:
    """Return whether the sample only jumped."""
    return refusal == StateRefusal.POSITION_JUMP or refusal == StateRefusal.ATTITUDE_JUMP


def rate_serves(refusal: int) -> bool:
    """Return whether the body rate of a refused sample may be used, if it is not that of the reading before."""
    return refusal == StateRefusal.NOT_FINITE or is_jump(refusal)


def expired(refusals: Refusals, now: int, period: int) -> Refusals:
    """Return the counts at step ``now``: a window that is over is forgotten."""
    if refusals.recent == 0 or (now - refusals.start) * period / 1e9 <= REFUSED_WINDOW:
        return refusals
    return Refusals(refusals.total, now, 0, False)


def counted(refusals: Refusals, refusal: int, now: int) -> Refusals:
    """Return the counts after a sample was refused; the first one that counts opens the window.

    Repetitions and frozen samples do not count.
    """
    if refusal == StateRefusal.NOT_NEWER or refusal == StateRefusal.FROZEN:
        return Refusals(refusals.total + 1, refusals.start, refusals.recent, refusals.reset)
    start = now if refusals.recent == 0 else refusals.start
    return Refusals(refusals.total + 1, start, refusals.recent + 1, refusals.reset)


def is_full(refusals: Refusals) -> bool:
    """Return whether too many samples were refused within the window."""
    return refusals.recent >= REFUSED_COUNT


def is_gone(limits: StateLimits, estimate: Estimate, rate_age: float) -> bool:
    """Return whether nothing is known any more; ``rate_age`` in s. What never was known is not predicted."""
    return rate_age > (limits.gone_age if estimate.step >= 0 else NEVER_SEEN)
