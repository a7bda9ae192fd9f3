"""What a log tells: each parameter with its 95 % interval, told or not, why, and what to fly to learn it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quad_identify.fit import MOVES, OF_AXIS, Fit
from quad_identify.model import AT, BOUNDS, NAMES, Model, effectiveness
from quad_identify.prediction import GRAVITY
from quad_identify.record import NEAR_GROUND, WINDOW, Floats, smoothed

ROTATION_RATE = 225.0  # Hz of motors and gyro: 250 less what clocks are off
TIMING_RATE = 900.0  # Hz below which the moment of a command is known to its period alone: control may be at 1 kHz
GRID = 0.12  # of a period: standard deviation of a timing by the grid alone
SAG = 0.02  # of the thrust: standard deviation where a battery sags unseen
CURVE_RATE = 90.0  # Hz below which commands between the logged ones make the curve wrong
HARDLY = 0.02  # standard deviation over mean of the thrust within SLOW s: less is a hover
SLOW = 2.0 * NEAR_GROUND  # s over which a thrust that changes is a battery that sags
TURNS = 0.0175  # rad/s within a window (1 deg/s): an axis that turns less was not flown, whatever moved it
WEAK = 0.85  # effectiveness below which a rotor is named
ANSWERED = 4.0  # standard deviation of a timing over lag and delay, per share of the motion that no motor explains
LIFTS = 0.8  # share of the force that motors explain from which it alone tells a timing
COUPLED = 0.12  # of lasting force errors: standard deviation of the share that goes with velocity or voltage
CENTRE = 0.05  # arms: how far the centre of gravity may be off where only the trim tells
TORQUES = ("roll_torque_per_inertia", "pitch_torque_per_inertia", "yaw_torque_per_inertia")
INERTIAS = ("inertia_xx", "inertia_yy", "inertia_zz")
UNITS = {
    "mass": "kg",
    **dict.fromkeys(("specific_thrust", "thrust_offset", "thrust_linear", "thrust_square"), "m/s^2"),
    "thrust_battery": "",
    "rotor_time_constant": "s",
    "command_delay": "s",
    "linear_drag": "1/s",
    **dict.fromkeys(TORQUES, "1/m"),
    **dict.fromkeys(INERTIAS, "kg m^2"),
    "yaw_drag_ratio": "m",
    "rotor_effectiveness": "",
    "attitude_age": "s",
    "velocity_age": "s",
}
UNFITTED_MATTERS = {name for names in OF_AXIS.values() for name in names}
HOVER = "hover alone: square term and lag cannot be told apart"
FLY_THRUST = "climbs and descents: thrust 20 % up and down, a second each, for 30 s"
FLY_FAST = "log motors and gyro at 250 Hz or more"
FLY_ZZ = "roll and pitch to and fro while turning at 1 rad/s or more"
FLY_AXIS = (
    "roll to 15 degrees and back, a second each, for 20 s",
    "pitch to 15 degrees and back, a second each, for 20 s",
    "turns of 1 rad/s to both sides, for 20 s",
)


class Parameter(NamedTuple):
    """One parameter: ``value`` with its 95 % interval, None where unknown; four numbers each for the rotors.

    ``why``: what told it, or why it is not told; ``fly``: what to fly to learn it.
    """

    unit: str
    value: float | list[float] | None
    low: float | list[float] | None
    high: float | list[float] | None
    told: bool
    why: str
    fly: str = ""


def unknown(name: str, why: str, fly: str) -> Parameter:
    """Return a parameter that a log says nothing of."""
    return Parameter(UNITS[name], None, None, None, False, why, fly)


def given(name: str, value: float) -> Parameter:
    """Return a parameter that the user has given."""
    return Parameter(UNITS[name], value, value, value, True, "given")


class Evidence(NamedTuple):
    """A fit with what its verdict needs: given mass kg and arms m, slowest rates Hz, variation of the thrust.

    ``turns``: RMS of the rates within windows about each axis, rad/s.
    """

    model: Model
    fit: Fit
    mass: float | None
    arms: tuple[float, float] | None
    motors_hz: float
    gyro_hz: float
    variation: float
    turns: Floats


def evidence(model: Model, fit: Fit, mass: float | None, arms: tuple[float, float] | None) -> Evidence:
    """Return the fit with what its verdict needs."""
    moved = []
    for number, grid in enumerate(model.grids):
        thrust = model.thrusts(fit.p, number).sum(axis=1)
        slow = smoothed(thrust, round(SLOW / grid.step))
        moved.append((thrust[grid.windows] / slow[grid.windows]).ravel())
    motors, gyro = (min(grid.rates_hz[name] for grid in model.grids) for name in ("motors", "body_rates"))
    turns = np.concatenate(model.measured)[:, :, 3:].std(axis=(0, 1))
    return Evidence(model, fit, mass, arms, motors, gyro, float(np.concatenate(moved).std()), turns)


def interval(e: Evidence, of: str | Callable[[Floats], float], more: float = 0.0) -> tuple[float, float]:
    """Return the value of a parameter, or of a function of all, and the half width of its 95 % interval.

    ``more``: a further standard deviation, in the unit of the value.
    """
    if isinstance(of, str):
        name = of
        return interval(e, lambda p: float(p[AT[name]]), more)
    p, slope = e.fit.p, np.zeros(len(NAMES))
    value = of(p)
    known = np.diag(e.fit.covariance) > 0.0
    for index, name in enumerate(NAMES):
        if not known[index] and name not in UNFITTED_MATTERS:
            continue
        moved, step = p.copy(), 1e-4 * max(abs(p[index]), 1e-2)
        moved[index] += step
        slope[index] = (of(moved) - value) / step
    if slope[~known].any():  # what depends on a parameter that was not fitted has no interval
        return float(value), np.inf
    variance = float(slope @ e.fit.covariance @ slope) + more * more
    return float(value), e.fit.quantile * float(np.sqrt(max(variance, 0.0)))


def judged(e: Evidence) -> dict[str, Parameter]:
    """Return all parameters of a fit."""
    mass = unknown("mass", "no flight tells a mass: forces are known per mass", "weigh it")
    out = {"mass": mass if e.mass is None else given("mass", e.mass)}
    out |= _curve(e) | _timing(e)
    out["linear_drag"] = _drag(e)
    out |= _rotation(e)
    out["rotor_effectiveness"] = _effectiveness(e)
    return out


def _one(
    name: str, found: tuple[float, float], limit: float, against: str, why: str, fly: str, low: float = -np.inf
) -> Parameter:
    """Return a parameter: not told for the reason ``against``, or where its half width is beyond ``limit``."""
    value, half = found
    if not np.isfinite(half):
        return unknown(name, against or "the fit says nothing of it", fly)
    ends = max(low, value - half), max(low, value + half)
    if not against and half > limit:
        against = f"its interval of {2 * half:.3g} {UNITS[name]} is too wide to use"
    return Parameter(UNITS[name], None if against else value, *ends, not against, against or why, fly * bool(against))


def _curve(e: Evidence) -> dict[str, Parameter]:
    """Return the thrust curve: of total specific thrust over the command of all rotors."""
    wide, explained, against = 3.0 if e.motors_hz < CURVE_RATE else 1.0, 100 * e.fit.explained[2], ""
    if e.variation < HARDLY and e.model.curve is None:
        against = f"{HOVER} (thrust varies by {100 * e.variation:.1f} %)"
    elif explained < 0.0:
        against = f"the motors explain nothing of the force ({explained:.0f} %)"
    why = f"thrust varied by {100 * e.variation:.0f} %, {explained:.0f} % of the force explained"

    def full(p: Floats) -> float:
        return float(p[AT["thrust_offset"]] + sum(e.model.curve_of(p)))

    top = max(abs(full(e.fit.p)), 1.0)
    unseen = 0.0 if e.model.mean_voltage or e.model.curve is not None else SAG * top
    out = {}
    for name, of, limit, low in (
        ("specific_thrust", full, 0.05 * top, 0.0),
        ("thrust_offset", "thrust_offset", 1.0, -np.inf),
        ("thrust_linear", lambda p: e.model.curve_of(p)[0], 0.15 * top, -np.inf),
        ("thrust_square", lambda p: e.model.curve_of(p)[1], 0.15 * top, -np.inf),
    ):
        value, half = interval(e, of, unseen)
        out[name] = _one(name, (value, wide * half), limit, against, why, FLY_THRUST, low)
    sag = e.model.voltage_range()
    if AT["thrust_battery"] in e.model.free():
        taken = COUPLED * e.fit.lasting[2] / (GRAVITY * sag / np.sqrt(12.0))  # a voltage falls as evenly as errors may
        value, half = interval(e, "thrust_battery", taken)
        why = f"voltage fell by {100 * sag:.0f} %"
        out["thrust_battery"] = _one("thrust_battery", (value, wide * half), 0.5, against, why, "fly longer")
    else:
        lacks = f"the voltage varied by {100 * sag:.1f} % alone" if sag else "no voltage in the log"
        out["thrust_battery"] = unknown("thrust_battery", lacks, "log the voltage and fly until it has sagged")
    return out


def _timing(e: Evidence) -> dict[str, Parameter]:
    period, against, out = 1.0 / e.motors_hz, "", {}
    rough = period / np.sqrt(12.0) if e.motors_hz < TIMING_RATE else GRID * period
    turns = e.fit.explained[3:]
    if turns.max() >= MOVES:  # control answers pushes and noise, as if the rotors were quicker
        late = e.fit.p[AT["rotor_time_constant"]] + e.fit.p[AT["command_delay"]]
        rough = float(np.hypot(rough, ANSWERED * (1.0 - np.median(turns[turns >= MOVES])) * late))
    if e.motors_hz < CURVE_RATE:
        against = f"timing needs motors at 100 Hz and more, found {e.motors_hz:.0f}"
    elif e.variation < HARDLY and turns[:2].max() < MOVES:
        against = HOVER
    elif turns.max() < MOVES and e.fit.explained[2] < LIFTS:
        share = f"{100 * max(turns.max(), 0.0):.0f} % of any turn, {100 * e.fit.explained[2]:.0f} % of the thrust"
        against = f"the motors explain {share}: noise that control answers looks like quicker rotors"
    for name, limit in (("rotor_time_constant", 0.008), ("command_delay", 0.006)):
        value, half = interval(e, name, rough)
        half = half if half <= BOUNDS[name][1] else np.inf
        why, fly = f"motors at {e.motors_hz:.0f} Hz", f"{FLY_FAST}; {FLY_THRUST}"
        out[name] = _one(name, (value, half), max(limit, 0.15 * value), against, why, fly, 0.0)
    if e.model.delay is not None:
        out["command_delay"] = given("command_delay", e.model.delay)
    return out


def _drag(e: Evidence) -> Parameter:
    """Return the linear drag: a force that lasts also moves the vehicle, so it looks like less drag."""
    along = [g.velocity_b[g.windows][:, :, :2].reshape(-1, 2) for g in e.model.grids if g.velocity_b is not None]
    if not e.model.has_velocity:
        return unknown("linear_drag", "no velocity or attitude in the log", "log velocity and attitude")
    v, pushes = np.concatenate(along), float(np.hypot(*e.fit.lasting[:2]))
    taken = COUPLED * pushes / max(float(np.hypot(*v.std(axis=0))), 1e-9)
    found = interval(e, "linear_drag", taken)
    limit, against = max(0.05, 0.25 * abs(found[0])), ""
    if found[1] > limit and e.fit.quantile * taken > 0.5 * limit:
        against = f"pushes or gusts of {pushes:.2g} m/s^2 look like drag"
    return _one("linear_drag", found, limit, against, f"up to {abs(v).max():.1f} m/s", "fly at 3 m/s and more, in calm")


def _against_rotation(e: Evidence, axis: int) -> str:
    slowest, share = min(e.motors_hz, e.gyro_hz), 100 * max(e.fit.explained[3 + axis], 0.0)
    if slowest < ROTATION_RATE:
        return f"rotation needs motors and gyro at 250 Hz and more, found {slowest:.0f}"
    name = ("roll", "pitch", "yaw")[axis]
    if e.turns[axis] < TURNS:
        return f"{name} was hardly excited: {np.degrees(e.turns[axis]):.1f} deg/s within {WINDOW:g} s, expected 1"
    if share < 100 * MOVES:
        return (
            f"{name}: the motors explain {share:.0f} % of its motion, expected {100 * MOVES:.0f}: too small, or pushed"
        )
    if e.variation < HARDLY and e.model.curve is None:
        return "hover alone: torque is known per slope of the thrust curve, which is not"
    return ""


def inertia_of(p: Floats, mass: float, arms: tuple[float, float]) -> Floats:
    """Return the moments of inertia in kg m^2 about x, y and z."""
    x = mass * arms[1] / p[AT["roll_torque_per_inertia"]]
    y = mass * arms[0] / p[AT["pitch_torque_per_inertia"]]
    return np.array([x, y, p[AT["flatness"]] * (x + y)])


def _rotation(e: Evidence) -> dict[str, Parameter]:
    """Return torque per inertia of each axis and, of given mass and arms, the moments of inertia."""
    out, against = {}, [_against_rotation(e, axis) for axis in range(3)]
    fly = [FLY_FAST if "Hz" in reason else FLY_AXIS[axis] for axis, reason in enumerate(against)]
    for axis, name in enumerate(TORQUES):
        found = interval(e, name)
        why = f"{100 * e.fit.explained[3 + axis]:.0f} % of the motion explained"
        out[name] = _one(name, found, 0.1 * abs(found[0]), against[axis], why, fly[axis])
    if e.mass is None or e.arms is None:
        lacks = "mass" if e.mass is None else "arms"
        why = f"needs the {lacks}, which no flight tells"
        return out | {name: unknown(name, why, f"give --{lacks}") for name in (*INERTIAS, "yaw_drag_ratio")}
    mass, arms = e.mass, e.arms
    for axis, name in enumerate(INERTIAS[:2]):
        found = interval(e, lambda p, axis=axis: float(inertia_of(p, mass, arms)[axis]))  # type: ignore[misc]
        why = "from torque per inertia, mass and arms"
        out[name] = _one(name, found, 0.1 * found[0], against[axis], why, fly[axis], 0.0)
    zz = interval(e, lambda p: float(inertia_of(p, mass, arms)[2]))
    ratio = interval(e, lambda p: float(p[AT["yaw_torque_per_inertia"]] * inertia_of(p, mass, arms)[2] / mass))
    lacks = next(filter(None, against), "")
    for name, found in (("inertia_zz", zz), ("yaw_drag_ratio", ratio)):
        why = "from the gyroscopic coupling of the axes"
        out[name] = _one(name, found, 0.1 * abs(found[0]), lacks, why, FLY_FAST if "Hz" in lacks else FLY_ZZ, 0.0)
    x, y, _ = inertia_of(e.fit.p, mass, arms)
    for name, per in (("inertia_zz", 1.0), ("yaw_drag_ratio", e.fit.p[AT[TORQUES[2]]] / mass)):
        if out[name].low is not None and not out[name].told:  # no body is beyond these
            out[name] = out[name]._replace(low=float(per * abs(x - y)), high=float(per * (x + y)))
    return out


def _effectiveness(e: Evidence) -> Parameter:
    found = [interval(e, lambda p, i=i: float(effectiveness(p)[i])) for i in range(4)]  # type: ignore[misc]
    values, halves = ([each[part] for each in found] for part in (0, 1))
    if e.motors_hz < ROTATION_RATE or max(halves) > 0.08 or min(e.fit.explained[3:5]) < MOVES:
        commands = [grid.command.reshape(-1, grid.per, 4).mean(axis=1)[grid.windows] for grid in e.model.grids]
        return trimmed(np.concatenate([each.reshape(-1, 4) for each in commands]).mean(axis=0))
    low, high = (np.add(values, sign * np.array(halves)).tolist() for sign in (-1.0, 1.0))
    return Parameter("", values, low, high, True, named(high) or "each rotor's share of the force")


def named(high: list[float]) -> str:
    """Return which rotors are weak beyond doubt, in words."""
    weak = [(number, 100 * (1.0 - top)) for number, top in enumerate(high, 1) if top <= WEAK]
    return ", ".join(f"rotor {number} gives at least {less:.0f} % less than the mean" for number, less in weak)


def trimmed(u: Floats) -> Parameter:
    """Return the effectiveness of the rotors from their mean commands ``u`` in level flight.

    Rotors that balance give equal thrusts, so a stronger command is a weaker rotor. The exponent of the thrust curve is
    between 1 and 2 and the centre of gravity within 5 % of an arm: both are in the interval.
    """
    ends = [u**-exponent / np.mean(u**-exponent) for exponent in (1.0, 1.5, 2.0)]
    off = CENTRE * np.sqrt(2.0)
    low, high = np.min(ends, axis=0) - off, np.max(ends, axis=0) + off
    why = "from the trim alone: thrust curve between linear and square, centre of gravity within 5 % of an arm"
    return Parameter("", ends[1].tolist(), low.tolist(), high.tolist(), True, named(high.tolist()) or why)
