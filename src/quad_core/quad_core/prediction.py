"""The state now, predicted from one that is A old: what a law acts on where it is asked to (an addition to the paper).

    alpha_m' = (alpha - alpha_m) 2/A,  alpha = J^-1 (tau - w x J w)           mean of the last A, rad/s^2
    w_now    = w + A alpha_m                                                  body rates, rad/s
    q_now    = q exp(A (w_now - A/2 alpha_m))                                 attitude
    a        = f/m b_z(q_mid) - g e_z                                         what thrust and gravity explain, m/s^2
    v_now    = v + A a,   p_now = p + A v + A^2/2 a

f and tau are what the rotors gave (`actuation`). The first line is the first Pade form of a mean over a sliding window,
(1 - e^(-sA))/(sA) = 1/(1 + sA/2): a Smith predictor (O. J. M. Smith, 1957) without a delay line. Each channel has its
own A: what the state says of it, else what the parameters assume, plus the time since its reading last changed, at
most ``max_age``.

With ``smoothing`` the predicted position and velocity are not used directly: an alpha-beta filter of fading memory
(E. Brookner, Tracking and Kalman Filtering Made Easy, 1998) runs on a and on an estimate d of what a leaves out:

    v = v_m + (1 - z^2) r,  d = d_m + (1 - z)^2 r / T,  p = p_m + (1 - z) (p_now - p_m),  r = v_now - v_m,  z = e^(-L T)

with v_m = v + T (a + d) and p_m = p + T v + T^2/2 (a + d) of the step before. ``position_smoothing`` gives p a slower z
of its own: a measured velocity says more about the next centimetre than a noisy position. ``attitude_smoothing`` is the
same for q: turned on by the gyro, and back to q_now by 1 - e^(-L T) of the difference (a complementary filter; Mahony,
Hamel and Pflimlin, IEEE TAC 53(5), 2008).
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, NamedTuple

from quad_core.geometry import ZERO, add, body_z, cross, relative_attitude, rotated_by_vector, scale, subtract
from quad_core.parameters import Flag, Real
from quad_core.plugins import Law
from quad_core.records import field_kinds, referable
from quad_core.types import Actuation, Quat, Vec3, VehicleState, fresh
from quad_core.vehicle import Vehicle


class Prediction(NamedTuple):
    """Whether, and over how much time, the state that a law sees is predicted."""

    enabled: Annotated[bool, Flag("the law acts on the predicted state; false: on the received one")] = False
    position_age: Annotated[float, Real("s", "age of position and velocity if not in the state", 0.0, 0.1)] = 0.0
    attitude_age: Annotated[float, Real("s", "age of the attitude if not in the state", 0.0, 0.1)] = 0.0
    rate_age: Annotated[float, Real("s", "age of the body rates if not in the state", 0.0, 0.1)] = 0.0
    max_age: Annotated[float, Real("s", "largest age that is predicted over", 0.0, 0.1)] = 0.06
    smoothing: Annotated[float, Real("rad/s", "bandwidth for p and v; larger: less lag; 0: none", 0.0, 500.0)] = 0.0
    position_smoothing: Annotated[float, Real("rad/s", "bandwidth for p alone; 0: the same", 0.0, 500.0)] = 0.0
    attitude_smoothing: Annotated[float, Real("rad/s", "bandwidth for q; larger: less lag; 0: none", 0.0, 2000.0)] = 0.0
    rate_smoothing: Annotated[float, Real("rad/s", "bandwidth for w; larger: less lag; 0: none", 0.0, 2000.0)] = 0.0


class Estimate(NamedTuple):
    """The estimate that is kept from step to step.

    ``reading``: the last state; ``held``: time in s for which its position, attitude and rates have not changed;
    ``mean_acceleration_b`` alpha_m in rad/s^2; ``predicted``: the last prediction; ``disturbance_w`` d in m/s^2.
    """

    reading: VehicleState = VehicleState()
    held: Vec3 = Vec3()
    mean_acceleration_b: Vec3 = Vec3()
    predicted: VehicleState = VehicleState()
    disturbance_w: Vec3 = Vec3()
    initialised: bool = False


class Shown(NamedTuple):
    """What the internals show of a prediction.

    ``prediction_ages`` in s of position, attitude and rates; ``predicted_shift_w`` in m: the position predicted less
    the one that came; ``prediction_residual_w`` in m: the position predicted now less what the last prediction expects
    now; ``age_bounded``: 1 if an age was larger than ``max_age``, else 0.
    """

    prediction_ages: Vec3 = Vec3()
    predicted_shift_w: Vec3 = Vec3()
    prediction_residual_w: Vec3 = Vec3()
    age_bounded: float = 0.0


UNKNOWN = Estimate()  # what is remembered before the first step


def predict(
    parameters: Prediction, vehicle: Vehicle, known: Estimate, state: VehicleState, actuation: Actuation, dt: float
) -> tuple[VehicleState, Estimate, Shown]:
    """Return the state now, the next memory and what is shown, of one step of ``dt`` s.

    ``state`` is as old as ``parameters`` say; ``actuation`` that of the plant step before. Raises nothing on flyable
    inputs.
    """
    held = held_for(known, state, dt)
    longest = parameters.max_age
    age = Vec3(
        age_or_default(state.position_age, parameters.position_age) + held.x,
        age_or_default(state.attitude_age, parameters.attitude_age) + held.y,
        age_or_default(state.rate_age, parameters.rate_age) + held.z,
    )
    ages = Vec3(min(longest, age.x), min(longest, age.y), min(longest, age.z))
    bounded = age.x > longest or age.y > longest or age.z > longest
    angular = angular_acceleration(vehicle, known.predicted.omega_b, actuation.torque_b)
    mean = angular if known.initialised else ZERO
    window = ages.y if ages.y > ages.z else ages.z
    if known.initialised and window > 0.0:
        mean = moved_towards(known.mean_acceleration_b, angular, 2.0 / window, dt)
    omega = add(state.omega_b, scale(ages.z, mean))
    if parameters.rate_smoothing > 0.0 and known.initialised:
        expected = add(known.predicted.omega_b, scale(dt, angular))
        omega = moved_towards(expected, omega, parameters.rate_smoothing, dt)
    q = rotated_by_vector(state.q_wb, scale(ages.y, subtract(omega, scale(0.5 * ages.y, mean))))
    if parameters.attitude_smoothing > 0.0 and known.initialised:
        before = known.predicted
        expected_q = rotated_by_vector(before.q_wb, scale(0.5 * dt, add(before.omega_b, omega)))
        q = turned_towards(expected_q, q, parameters.attitude_smoothing, dt)
    acceleration = ZERO
    if known.initialised:
        middle = rotated_by_vector(q, scale(-0.5 * ages.x, omega))
        acceleration = modelled_acceleration(vehicle, middle, actuation.thrust)
    p = ahead(state.p_w, state.v_w, acceleration, ages.x)
    v = add(state.v_w, scale(ages.x, acceleration))
    if state.velocity_age > 0.0 and state.velocity_age != state.position_age:
        v = add(state.v_w, scale(min(longest, state.velocity_age + held.x), acceleration))
        p = ahead(state.p_w, subtract(v, scale(ages.x, acceleration)), acceleration, ages.x)
    p, v, d, residual = _smoothed(parameters, known, p, v, acceleration, dt)
    predicted = fresh(p, v, q, omega)
    shown = Shown(ages, subtract(p, state.p_w), residual, 1.0 if bounded else 0.0)
    return predicted, Estimate(state, held, mean, predicted, d, True), shown


def _smoothed(
    parameters: Prediction, known: Estimate, p: Vec3, v: Vec3, acceleration: Vec3, dt: float
) -> tuple[Vec3, Vec3, Vec3, Vec3]:
    """Return ``p`` and ``v`` filtered if that is asked for, d, and how far ``p`` is off what was expected."""
    if not known.initialised:
        return p, v, ZERO, ZERO
    total = add(acceleration, known.disturbance_w)
    expected_p = ahead(known.predicted.p_w, known.predicted.v_w, total, dt)
    residual = subtract(p, expected_p)
    if parameters.smoothing <= 0.0:
        return p, v, ZERO, residual
    z = math.exp(-parameters.smoothing * dt)
    slow = math.exp(-parameters.position_smoothing * dt) if parameters.position_smoothing > 0.0 else z
    expected_v = add(known.predicted.v_w, scale(dt, total))
    miss = subtract(v, expected_v)
    d = add(known.disturbance_w, scale((1.0 - z) * (1.0 - z) / dt, miss))
    return add(expected_p, scale(1.0 - slow, residual)), add(expected_v, scale(1.0 - z * z, miss)), d, residual


def held_for(known: Estimate, state: VehicleState, dt: float) -> Vec3:
    """Return for how long in s position (and velocity), attitude and body rates have been the same reading."""
    if not known.initialised:
        return ZERO
    before, held = known.reading, known.held
    return Vec3(
        held.x + dt if before.p_w == state.p_w and before.v_w == state.v_w else 0.0,
        held.y + dt if before.q_wb == state.q_wb else 0.0,
        held.z + dt if before.omega_b == state.omega_b else 0.0,
    )


def age_or_default(said: float, assumed: float) -> float:
    """Return the age in s that a state says, else the one that the parameters assume."""
    return said if said > 0.0 else assumed


def angular_acceleration(vehicle: Vehicle, omega: Vec3, torque: Vec3) -> Vec3:
    """Return J^-1 (tau - w x J w) in rad/s^2 for ``omega`` in rad/s and ``torque`` in N m (Eq. 1 without drag)."""
    xx, yy, zz = vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz
    turning = cross(omega, Vec3(xx * omega.x, yy * omega.y, zz * omega.z))
    return Vec3((torque.x - turning.x) / xx, (torque.y - turning.y) / yy, (torque.z - turning.z) / zz)


def modelled_acceleration(vehicle: Vehicle, q: Quat, thrust: float) -> Vec3:
    """Return f/m b_z - g e_z in m/s^2, world frame; ``thrust`` in N."""
    axis, lift = body_z(q), thrust / vehicle.mass
    return Vec3(lift * axis.x, lift * axis.y, lift * axis.z - vehicle.gravity)


def ahead(p: Vec3, v: Vec3, a: Vec3, time: float) -> Vec3:
    """Return p + v t + a t^2 / 2 in m."""
    half = 0.5 * time * time
    return Vec3(p.x + time * v.x + half * a.x, p.y + time * v.y + half * a.y, p.z + time * v.z + half * a.z)


def moved_towards(value: Vec3, target: Vec3, rate: float, dt: float) -> Vec3:
    """Return a first-order lag of ``rate`` 1/s after ``dt`` s with the input ``target``, exactly."""
    left = math.exp(-rate * dt)
    return add(target, scale(left, subtract(value, target)))


def turned_towards(q: Quat, target: Quat, rate: float, dt: float) -> Quat:
    """Return ``q`` turned the short way towards ``target`` by 1 - e^(-rate dt) of their difference, which is small.

    The difference is 2 (q_x, q_y, q_z) of q^-1 target: the rotation vector but for a third of its cube over eight.
    """
    apart = relative_attitude(q, target)
    share = 2.0 * (1.0 - math.exp(-rate * dt))
    if apart.w < 0.0:
        share = -share
    return rotated_by_vector(q, Vec3(share * apart.x, share * apart.y, share * apart.z))


@cache
def with_prediction(law: Law, inputs: type[Any], predicted: Callable[..., Any] = predict) -> Law:
    """Return ``law`` as it acts on the predicted state; ``predicted`` predicts it.

    ``inputs`` is the class of what the law's stage takes, the state first. ``Parameters`` are (law, prediction),
    ``Memory`` is (law, known), ``Internals`` are the law's and those of ``Shown``. Whatever runs a law (node, replay,
    loop, compiled) runs this in its place, so that all give the same bits.
    """
    suffix, law_init, law_step = f"{law.name}_prediction", law.init, law.step
    fields = field_kinds(law.Internals) | field_kinds(Shown)
    memory_kind: Any = referable("Memory", suffix, {"law": law.Memory, "known": Estimate}, __name__)
    shown_kind: Any = referable("Internals", suffix, fields, __name__)

    def init(parameters: Any, vehicle: Any) -> Any:
        return memory_kind(law_init(parameters.law, vehicle), UNKNOWN)

    def step(parameters: Any, vehicle: Any, memory: Any, seen: Any, dt: float) -> Any:
        state, known, shown = predicted(parameters.prediction, vehicle, memory.known, seen.state, seen.actuation, dt)
        output, own, internals = law_step(parameters.law, vehicle, memory.law, inputs(state, *seen[1:]), dt)
        return output, memory_kind(own, known), shown_kind(*(internals[:] + shown[:]))

    both = referable("Parameters", suffix, {"law": law.Parameters, "prediction": Prediction}, __name__)
    return Law(f"{law.name}[prediction]", both, memory_kind, shown_kind, init, step)
