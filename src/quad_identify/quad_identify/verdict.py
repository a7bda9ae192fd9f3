"""What a log tells: each parameter with its 95 % interval, told or not, why, and what to fly to learn it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quad_identify.fit import OF_AXIS, Fit
from quad_identify.model import AT, BOUNDS, NAMES, Model, effectiveness
from quad_identify.record import Flight, Floats

ROTATION_RATE = 225.0  # Hz of motors and gyro: 250 less what clocks are off
TIMING_RATE = 225.0  # Hz below which the moment of a command is known to its period alone
GRID = 0.12  # of a period: standard deviation of a timing by the grid alone
SAG = 0.02  # of the thrust: standard deviation where a battery sags unseen
CURVE_RATE = 90.0  # Hz below which commands between the logged ones make the curve wrong
HARDLY = 0.02  # standard deviation over mean of the command: less is a hover
MOVES = 0.5  # share of an axis' motion that the motors must explain
WEAK = 0.85  # effectiveness below which a rotor is named
CENTRE = 0.05  # arms: how far the centre of gravity may be off where only the trim tells


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


UNFITTED_MATTERS = {name for names in OF_AXIS.values() for name in names}
FLY_THRUST = "climbs and descents: thrust 20 % up and down, a second each, for 30 s"
FLY_FAST = "log motors and gyro at 250 Hz or more"
FLY_AXIS = {
    "roll": "roll to 15 degrees and back, a second each, for 20 s",
    "pitch": "pitch to 15 degrees and back, a second each, for 20 s",
    "yaw": "turns of 1 rad/s to both sides, for 20 s",
}
TORQUES = ("roll_torque_per_inertia", "pitch_torque_per_inertia", "yaw_torque_per_inertia")


class Evidence(NamedTuple):
    """A fit with what its verdict needs: given mass kg and arms m, slowest rates Hz, variation of the command."""

    model: Model
    fit: Fit
    mass: float | None
    arms: tuple[float, float] | None
    motors_hz: float
    gyro_hz: float
    variation: float
    speeds: bool


def evidence(
    model: Model, fit: Fit, flights: list[Flight], mass: float | None, arms: tuple[float, float] | None
) -> Evidence:
    """Return the fit with what its verdict needs."""
    motors = min(grid.rates_hz["motors"] for grid in model.grids)
    gyro = min(grid.rates_hz["body_rates"] for grid in model.grids)
    lag, delay = fit.p[AT["rotor_time_constant"]], fit.p[AT["command_delay"]]
    late = [model.lagged(i, lag, delay).mean[grid.windows] for i, grid in enumerate(model.grids)]
    commands = np.concatenate([each.sum(axis=2).ravel() for each in late])
    return Evidence(
        model,
        fit,
        mass,
        arms,
        motors,
        gyro,
        float(commands.std() / commands.mean()),
        any(one.speeds for one in flights),
    )


def interval(e: Evidence, of: Callable[[Floats], float], more: float = 0.0) -> tuple[float, float]:
    """Return the value of a function of the parameters and the half width of its 95 % interval.

    ``more``: a further standard deviation, in the unit of the value.
    """
    p, slope = e.fit.p, np.zeros(len(NAMES))
    value = of(p)
    known = np.diag(e.fit.covariance) > 0.0
    for index in np.flatnonzero(~known):  # not fitted: what depends on it has no interval
        if NAMES[index] in UNFITTED_MATTERS:
            moved = p.copy()
            moved[index] += 0.01 * max(abs(p[index]), 0.1)
            if of(moved) != value:
                return float(value), np.inf
    for index in np.flatnonzero(known):
        step = 1e-4 * max(abs(p[index]), 1e-2)
        moved = p.copy()
        moved[index] += step
        slope[index] = (of(moved) - value) / step
    variance = float(slope @ e.fit.covariance @ slope) + more * more
    return float(value), e.fit.quantile * float(np.sqrt(max(variance, 0.0)))


def judged(e: Evidence) -> dict[str, Parameter]:
    """Return all parameters of a fit."""
    out = {"mass": _mass(e)}
    out |= _curve(e)
    out |= _timing(e)
    out["linear_drag"] = _drag(e)
    out |= _rotation(e)
    out |= _inertia(e)
    out["rotor_effectiveness"] = _effectiveness(e)
    return out


def _one(
    unit: str, found: tuple[float, float], limit: float, against: str, why: str, fly: str, low: float = -np.inf
) -> Parameter:
    """Return a parameter: not told for the reason ``against``, or where its half width is beyond ``limit``."""
    value, half = found
    if not np.isfinite(half):
        return Parameter(unit, None, None, None, False, against or "the fit says nothing of it", fly)
    ends = max(low, value - half), max(low, value + half)
    if against:
        return Parameter(unit, None, *ends, False, against, fly)
    if half > limit:
        return Parameter(unit, None, *ends, False, f"its interval of {2 * half:.3g} {unit} is too wide to use", fly)
    return Parameter(unit, value, *ends, True, why)


def _mass(e: Evidence) -> Parameter:
    if e.mass is None:
        return Parameter("kg", None, None, None, False, "no flight tells a mass: forces are known per mass", "weigh it")
    return Parameter("kg", e.mass, e.mass, e.mass, True, "given")


def _curve(e: Evidence) -> dict[str, Parameter]:
    """Return the thrust curve: of total specific thrust over the command of all rotors."""
    wide = 3.0 if e.motors_hz < CURVE_RATE else 1.0
    hover = e.variation < HARDLY
    against = ""
    if hover and e.model.curve is None:
        against = f"hover alone: square term and lag cannot be told apart (command varies by {100 * e.variation:.1f} %)"
    why = f"command varied by {100 * e.variation:.0f} %, {100 * e.fit.explained[2]:.0f} % of the force explained"
    if e.fit.explained[2] < 0.0:
        against = against or f"the motors explain nothing of the force ({100 * e.fit.explained[2]:.0f} %)"

    def full(p: Floats) -> float:
        return float(p[AT["thrust_offset"]] + sum(e.model.curve_of(p)))

    def found(of: Callable[[Floats], float]) -> tuple[float, float]:
        value, half = interval(e, of, 0.0 if e.model.mean_voltage or e.model.curve is not None else SAG * top)
        return value, wide * half

    top = max(abs(full(e.fit.p)), 1.0)
    out = {"specific_thrust": _one("m/s^2", found(full), 0.05 * top, against, why, FLY_THRUST, 0.0)}
    out["thrust_offset"] = _one("m/s^2", found(lambda p: float(p[AT["thrust_offset"]])), 1.0, against, why, FLY_THRUST)
    for index, name in enumerate(("thrust_linear", "thrust_square")):
        of = found(lambda p, index=index: e.model.curve_of(p)[index])  # type: ignore[misc]
        out[name] = _one("m/s^2", of, 0.15 * top, against, why, FLY_THRUST)
    sag = e.model.voltage_range()
    if "thrust_battery" in {NAMES[index] for index in e.model.free()}:
        battery = found(lambda p: float(p[AT["thrust_battery"]]))
        out["thrust_battery"] = _one("", battery, 0.5, against, f"voltage fell by {100 * sag:.0f} %", "fly longer")
    else:
        lacks = "no voltage in the log" if not sag else f"the voltage varied by {100 * sag:.1f} % alone"
        out["thrust_battery"] = Parameter(
            "", None, None, None, False, lacks, "log the voltage and fly until it has sagged"
        )
    return out


def _timing(e: Evidence) -> dict[str, Parameter]:
    period = 1.0 / e.motors_hz
    rough = period / np.sqrt(12.0) if e.motors_hz < TIMING_RATE else GRID * period
    against = ""
    if e.motors_hz < CURVE_RATE:
        against = f"timing needs motors at 100 Hz and more, found {e.motors_hz:.0f}"
    elif e.variation < HARDLY and e.fit.explained[3:5].max() < MOVES:
        against = "hover alone: square term and lag cannot be told apart"
    out = {}
    for name, limit in (("rotor_time_constant", 0.008), ("command_delay", 0.006)):
        found = interval(e, lambda p, name=name: float(p[AT[name]]), rough)  # type: ignore[misc]
        given = e.model.delay
        if name == "command_delay" and given is not None:
            out[name] = Parameter("s", given, given, given, True, "given")
            continue
        if found[1] > BOUNDS[name][1]:
            found = (found[0], np.inf)
        widest = max(limit, 0.15 * e.fit.p[AT[name]])
        why = f"motors at {e.motors_hz:.0f} Hz"
        out[name] = _one("s", found, widest, against, why, f"{FLY_FAST}; {FLY_THRUST}", 0.0)
    return out


def _drag(e: Evidence) -> Parameter:
    if not e.model.has_velocity:
        return Parameter(
            "1/s", None, None, None, False, "no velocity or attitude in the log", "log velocity and attitude"
        )
    found = interval(e, lambda p: float(p[AT["linear_drag"]]))
    fastest = max(
        float(np.abs(grid.velocity_b[grid.windows][:, :, :2]).max())
        for grid in e.model.grids
        if grid.velocity_b is not None
    )
    return _one("1/s", found, max(0.05, 0.25 * abs(found[0])), "", f"up to {fastest:.1f} m/s", "fly at 3 m/s and more")


def _against_rotation(e: Evidence, axis: int) -> str:
    slowest = min(e.motors_hz, e.gyro_hz)
    if slowest < ROTATION_RATE:
        return f"rotation needs motors and gyro at 250 Hz and more, found {slowest:.0f}"
    if e.fit.explained[3 + axis] < MOVES:
        name = ("roll", "pitch", "yaw")[axis]
        return f"{name} was hardly excited: the motors explain {100 * max(e.fit.explained[3 + axis], 0.0):.0f} % of it"
    return ""


def _rotation(e: Evidence) -> dict[str, Parameter]:
    out = {}
    for axis, name in enumerate(TORQUES):
        found = interval(e, lambda p, name=name: float(p[AT[name]]))  # type: ignore[misc]
        why = f"{100 * e.fit.explained[3 + axis]:.0f} % of the motion explained"
        against = _against_rotation(e, axis)
        if not against and e.variation < HARDLY and e.model.curve is None:
            against = "hover alone: torque is known per slope of the thrust curve, which is not"
        fly = FLY_FAST if "Hz" in against else FLY_AXIS[("roll", "pitch", "yaw")[axis]]
        out[name] = _one("1/m", found, 0.1 * abs(found[0]), against, why, fly)
    return out


def inertia_of(p: Floats, mass: float, arms: tuple[float, float]) -> Floats:
    """Return the moments of inertia in kg m^2 about x, y and z."""
    x = mass * arms[1] / p[AT["roll_torque_per_inertia"]]
    y = mass * arms[0] / p[AT["pitch_torque_per_inertia"]]
    return np.array([x, y, p[AT["flatness"]] * (x + y)])


def _inertia(e: Evidence) -> dict[str, Parameter]:
    names = ("inertia_xx", "inertia_yy", "inertia_zz")
    units = dict.fromkeys(names, "kg m^2") | {"yaw_drag_ratio": "m"}
    if e.mass is None or e.arms is None:
        lacks = "mass" if e.mass is None else "arms"
        return {
            name: Parameter(
                unit, None, None, None, False, f"needs the {lacks}, which no flight tells", f"give --{lacks}"
            )
            for name, unit in units.items()
        }
    mass, arms, out = e.mass, e.arms, {}
    for axis, name in enumerate(names[:2]):
        found = interval(e, lambda p, axis=axis: float(inertia_of(p, mass, arms)[axis]))  # type: ignore[misc]
        against = _against_rotation(e, axis)
        out[name] = _one(
            units[name], found, 0.1 * found[0], against, "from torque per inertia, mass and arms", FLY_AXIS["roll"], 0.0
        )
    against = next(filter(None, (_against_rotation(e, axis) for axis in range(3))), "")
    zz = interval(e, lambda p: float(inertia_of(p, mass, arms)[2]))
    ratio = interval(e, lambda p: float(p[AT["yaw_torque_per_inertia"]] * inertia_of(p, mass, arms)[2] / mass))
    why, fly = "from the gyroscopic coupling of the axes", "roll and pitch to and fro while turning at 1 rad/s or more"
    for name, found in (("inertia_zz", zz), ("yaw_drag_ratio", ratio)):
        out[name] = _one(units[name], found, 0.1 * abs(found[0]), against, why, fly, 0.0)
    bodies = inertia_of(e.fit.p, mass, arms)
    if out["inertia_zz"].low is not None and not out["inertia_zz"].told and not against:
        flat = float(bodies[0] + bodies[1])
        out["inertia_zz"] = out["inertia_zz"]._replace(low=float(abs(bodies[0] - bodies[1])), high=flat)
    return out


def _effectiveness(e: Evidence) -> Parameter:
    found = [interval(e, lambda p, i=i: float(effectiveness(p)[i])) for i in range(4)]  # type: ignore[misc]
    half = max(each[1] for each in found)
    slow = e.motors_hz < ROTATION_RATE
    if slow or half > 0.08 or min(e.fit.explained[2:5]) < MOVES:
        commands = [grid.command.reshape(-1, grid.per, 4).mean(axis=1)[grid.windows] for grid in e.model.grids]
        return trimmed(np.concatenate([each.reshape(-1, 4) for each in commands]).mean(axis=0))
    low, high = ([value + sign * half for value, half in found] for sign in (-1.0, 1.0))
    return Parameter(
        "", [value for value, _ in found], low, high, True, named(high) or "each rotor's share of the force"
    )


def named(high: list[float]) -> str:
    """Return which rotors are weak beyond doubt, in words."""
    weak = [
        f"rotor {i + 1} gives at least {100 * (1.0 - top):.0f} % less than the mean"
        for i, top in enumerate(high)
        if top <= WEAK
    ]
    return ", ".join(weak)


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


LACKING = {
    "mass": "kg",
    "specific_thrust": "m/s^2",
    "thrust_offset": "m/s^2",
    "thrust_linear": "m/s^2",
    "thrust_square": "m/s^2",
    "thrust_battery": "",
    "rotor_time_constant": "s",
    "command_delay": "s",
    "linear_drag": "1/s",
    **dict.fromkeys(TORQUES, "1/m"),
    **dict.fromkeys(("inertia_xx", "inertia_yy", "inertia_zz"), "kg m^2"),
    "yaw_drag_ratio": "m",
    "attitude_age": "s",
    "velocity_age": "s",
}
"""Units of all parameters but the effectiveness of the rotors."""
