"""Which state the guard accepts: the newest good sample, else a prediction with the nominal model."""

from typing import NamedTuple

from quad_core.cycle import BODY_RATE_BOUND
from quad_core.geometry import ZERO
from quad_core.guard_parameters import GuardParameters, StateLimits
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_guard.backup import predict
from quad_guard.checks import (
    ACCEPTED,
    ATTITUDE_JUMP,
    POSITION_JUMP,
    BodyState,
    StateSample,
    sample_refusal,
)
from quad_guard.frozen import COARSEST_GRAIN, NOTHING_MISSING, Grain, Missing, finer, missed

COUNTED = (False, True, False, True, True, True, False)
"""By refusal: whether it counts towards the end of the controller's flight. Repetitions and frozen samples: no."""

RATE_SERVES = (False, True, False, False, True, True, False)
"""By refusal: whether the sample's body rate may still be used, if it is not that of the reading before."""

REFUSED_COUNT, REFUSED_WINDOW = 10, 0.2
"""So many refused samples within so many s end the controller's flight (ArduPilot)."""


class Estimate(NamedTuple):
    """The state as the guard knows it, and the last accepted sample with its ``ground_z`` m. Steps are -1 before one.

    ``step`` is that of the last accepted sample, ``rate_step`` that of the last measured body rate. ``reading`` is the
    body rate in rad/s of the estimator's newest reading, accepted or not. ``grain`` and ``missing`` tell a frozen
    sample (``quad_guard.frozen``).
    """

    state: BodyState
    sample: BodyState
    ground_z: float
    step: int
    rate_step: int
    reading: Vec3
    grain: Grain
    missing: Missing


class Refusals(NamedTuple):
    """Refused samples: in all, and within the window that began at step ``start``; ``reset``: a jump was accepted."""

    total: int
    start: int
    recent: int
    reset: bool


_REST = BodyState(ZERO, ZERO, Quat(), ZERO)
NO_ESTIMATE = Estimate(_REST, _REST, 0.0, -1, -1, ZERO, COARSEST_GRAIN, NOTHING_MISSING)
"""What is known before the first sample: nothing, written as rest in the origin."""


def observe(
    parameters: GuardParameters,
    vehicle: Vehicle,
    estimate: Estimate,
    refusals: Refusals,
    sample: StateSample,
    flown: Wrench,
    now: int,
    period: int,
    dt: float,
) -> tuple[Estimate, Refusals, int]:
    """Return the estimate at plant step ``now``, the counts and the refusal of ``sample``; ``flown``: the last wrench.

    After too many refusals the next sample that only jumped is accepted: the estimator was reset, and the backup law
    flies better on its new attitude and velocity than on a prediction. Of other samples the body rate is used, unless
    it repeats itself to the last bit: whatever froze the attitude may have frozen the rate.
    """
    limits = parameters.state
    refusals = expired(refusals, now, period)
    refusal, gyro, state, reading, last = ACCEPTED, False, estimate.state, estimate.reading, estimate.sample
    grain, missing = estimate.grain, estimate.missing
    is_new = sample.arrived and not (estimate.step >= 0 and is_same(sample.state, last))
    if estimate.step >= 0 and not is_new:
        missing = missed(parameters.contact, vehicle, grain, missing, last, last.p_w.z - estimate.ground_z, flown, dt)
    if sample.arrived:
        refusal = sample_refusal(limits, sample, last, estimate.step, now, period, not is_new and missing.shows)
        if refusal == ACCEPTED:
            if is_new:
                grain = finer(grain, last, sample.state) if estimate.step >= 0 else grain
                missing = NOTHING_MISSING
            return accepted(sample, grain, missing), refusals, refusal
        refusals = counted(refusals, refusal, now)
        if POSITION_JUMP <= refusal <= ATTITUDE_JUMP and is_full(refusals):
            reset = Refusals(refusals.total, refusals.start, refusals.recent, True)
            return accepted(sample, grain, NOTHING_MISSING), reset, refusal
        rate = sample.state.omega_b
        repeats = rate.x == reading.x and rate.y == reading.y and rate.z == reading.z
        gyro = RATE_SERVES[refusal] and is_bounded(rate) and not repeats
        reading = rate
        if gyro:
            state = BodyState(state.p_w, state.v_w, state.q_wb, rate)
    if estimate.step < 0:
        return estimate, refusals, refusal
    predicted = predict(vehicle, state, flown, gyro, dt)
    rate_step = now if gyro else estimate.rate_step
    return (
        Estimate(predicted, last, estimate.ground_z, estimate.step, rate_step, reading, grain, missing),
        refusals,
        refusal,
    )


def accepted(sample: StateSample, grain: Grain, missing: Missing) -> Estimate:
    """Return what is known from a sample that is accepted; ``grain`` and ``missing`` as in ``Estimate``."""
    state = sample.state
    motion = BodyState(state.p_w, state.v_w, state.q_wb, state.omega_b)
    return Estimate(motion, motion, state.ground_z, sample.step, sample.step, state.omega_b, grain, missing)


def is_same(a: VehicleState, b: BodyState) -> bool:
    """Return whether two states are one reading, whatever they say of its age and of the ground."""
    return a.p_w == b.p_w and a.v_w == b.v_w and a.q_wb == b.q_wb and a.omega_b == b.omega_b


def is_bounded(omega: Vec3) -> bool:
    """Return whether a body rate is finite and within ``cycle.BODY_RATE_BOUND``."""
    return abs(omega.x) <= BODY_RATE_BOUND and abs(omega.y) <= BODY_RATE_BOUND and abs(omega.z) <= BODY_RATE_BOUND


def expired(refusals: Refusals, now: int, period: int) -> Refusals:
    """Return the counts at step ``now``: a window that is over is forgotten."""
    if refusals.recent == 0 or (now - refusals.start) * period / 1e9 <= REFUSED_WINDOW:
        return refusals
    return Refusals(refusals.total, now, 0, False)


def counted(refusals: Refusals, refusal: int, now: int) -> Refusals:
    """Return the counts after a sample was refused; the first one that counts opens the window."""
    if not COUNTED[refusal]:
        return Refusals(refusals.total + 1, refusals.start, refusals.recent, refusals.reset)
    start = now if refusals.recent == 0 else refusals.start
    return Refusals(refusals.total + 1, start, refusals.recent + 1, refusals.reset)


def is_full(refusals: Refusals) -> bool:
    """Return whether too many samples were refused within the window."""
    return refusals.recent >= REFUSED_COUNT


def is_gone(limits: StateLimits, estimate: Estimate, rate_age: float) -> bool:
    """Return whether nothing is known any more; ``rate_age`` in s. What never was known is not predicted for long."""
    return rate_age > (limits.gone_age if estimate.step >= 0 else limits.blind_age)
