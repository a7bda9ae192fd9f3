"""What is doubtful about a log of others: frame, unit, clock, motor order, each with the number that raised it.

Nothing here is mended: a map says what a column is, and physics says whether that can be.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from quad_core.vehicle import ARRANGEMENTS
from quad_log_import.maps import Floats, Recording, Series, interpolated, turning

GRAVITY = 9.81
STEEPEST = 30.0  # deg between body z and thrust as the median of a flight: more is another frame or order
LEAST_HEIGHT, MOSTLY = 0.3, 0.5  # m, and the share of a log that a flight upside down is below its start
MOST = 200_000  # moments at which two signals are compared, so that a damaged time takes no memory


def doubts(recording: Recording) -> list[str]:
    """Return what speaks against a recording, one line each; nothing where all fits or cannot be compared."""
    signals, found = recording.signals, list[str]()
    for name, signal in signals.items():
        found += [] if name.startswith("reference_") else _clock(name, signal)  # time without a set point is no gap
    for check, names in _checks(recording).values():
        if signals.keys() >= {*names} and (check is not _upright or "specific_force" not in signals):
            found += check(*(signals[name] for name in names))
    return found


def unchecked(recording: Recording) -> list[str]:
    """Return what of the signals of a recording nothing can speak against, and the signals that this would take."""
    found = []
    for what, (_, names) in _checks(recording).items():
        if names[0] in recording.signals and (lacks := [name for name in names if name not in recording.signals]):
            found.append(f"{what} not checked: no {', no '.join(lacks)}")
    return found


def _checks(recording: Recording) -> dict[str, tuple[Callable[..., list[str]], tuple[str, ...]]]:
    """Return {what: (its check, the signals of it)}; the first signal is the one that is checked."""
    return {
        "gravity": (_gravity, ("specific_force",)),
        "body_rates": (_rates, ("body_rates", "attitude")),
        "height": (_height, ("position",)),
        "velocity": (_velocity, ("velocity", "position")),
        "specific_force": (_force, ("specific_force", "velocity", "attitude")),
        "attitude": (_upright, ("attitude", "position")),
        "range of motors": (_motor_range, ("motors",)),
        "order of motors": (partial(_motor_order, recording.rotors), ("motors", "body_rates")),
    }


def _clock(name: str, signal: Series) -> list[str]:
    steps = np.diff(signal.t)
    usual = float(np.median(steps))
    longest = float(steps.max())
    found = []
    if longest > max(20.0 * usual, 0.5):
        at = float(signal.t[int(steps.argmax())])
        found.append(f"{name}: a gap of {longest:.2f} s at {at:.2f} s, where samples come every {1e3 * usual:.1f} ms")
    if not 1e-4 <= usual <= 2.0:
        found.append(f"{name}: samples come every {usual:.3g} s: is the unit of its time right?")
    return found


def _gravity(force: Series) -> list[str]:
    mean = force.values.mean(axis=0)
    size = float(np.median(np.linalg.norm(force.values, axis=1)))
    if not 0.7 * GRAVITY < size < 1.5 * GRAVITY:
        guess = " (in g?)" if 0.5 < size < 2.0 else ""
        return [f"specific_force: found {size:.3g} m/s^2 as its median, expected about 9.8{guess}"]
    if mean[2] < 0.7 * size:
        text = ", ".join(f"{part:.2f}" for part in mean)
        return [f"specific_force: its mean is ({text}) m/s^2, expected +9.8 along body z (up): forward-right-down?"]
    return []


def _height(position: Series) -> list[str]:
    """Return a doubt where a flight is below the height at which it begins and ends."""
    up = position.values[:, 2] - position.values[0, 2]
    below = float((up < -LEAST_HEIGHT).mean())
    if below < MOSTLY or abs(up[-1]) > LEAST_HEIGHT:
        return []
    return [f"position: {100.0 * below:.0f} % of the time below where the flight begins and ends: z down (ned)?"]


def _derivative(signal: Series, t: Floats, span: float = 0.1) -> Floats:
    before, after = (interpolated(signal.t, signal.values, t + s * span) for s in (-0.5, 0.5))
    return (after - before) / span


def _both(one: Series, other: Series) -> Floats:
    begin, end = max(one.t[0], other.t[0]) + 1.0, min(one.t[-1], other.t[-1]) - 1.0
    return np.arange(begin, end, max(0.05, (end - begin) / MOST)) if end > begin + 3.0 else np.zeros(0)


def _rates(rates: Series, attitude: Series) -> list[str]:
    t = _both(rates, attitude)
    body = interpolated(attitude.t, turning(attitude.t, attitude.values), t)
    world = {"in the world frame": _level(attitude, t).apply(body)}
    return _compared("body_rates", "the change of attitude", rates, t, body, world)


def _level(attitude: Series, t: Floats) -> Rotation:
    return Slerp(attitude.t, Rotation.from_quat(attitude.values))(t)


def _upright(attitude: Series, position: Series) -> list[str]:
    """Return a doubt where body z is not along the thrust that the motion needs, as the median of the flight."""
    t = _both(position, attitude)
    if not len(t):
        return []
    speed = position._replace(t=t, values=_derivative(position, t, 0.2))
    needed = _derivative(speed, t, 0.2) + np.array([0.0, 0.0, GRAVITY])
    needed /= np.linalg.norm(needed, axis=1)[:, None]
    at = np.searchsorted(attitude.t, t)

    def off(quaternions: Floats) -> float:
        up = Rotation.from_quat(quaternions[at]).apply([0.0, 0.0, 1.0])
        return float(np.degrees(np.median(np.arccos(np.clip((up * needed).sum(axis=1), -1.0, 1.0)))))

    found, reordered = off(attitude.values), off(attitude.values[:, [1, 2, 3, 0]])
    if found < STEEPEST:
        return []
    hint = f"; read as w, x, y, z it is {reordered:.0f} deg" if reordered < STEEPEST else ""
    return [
        f"attitude: body z is {found:.0f} deg off the thrust that the motion needs, expected below {STEEPEST:.0f}{hint}"
    ]


def _velocity(velocity: Series, position: Series) -> list[str]:
    t = _both(velocity, position)
    change = _derivative(position, t)
    others = {"in NED": change[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0])}
    return _compared("velocity", "the change of position", velocity, t, change, others)


def _force(force: Series, velocity: Series, attitude: Series) -> list[str]:
    t = _both(force, velocity)
    t = t[(t > attitude.t[0]) & (t < attitude.t[-1])]
    needed = _level(attitude, t).apply(_derivative(velocity, t) + np.array([0.0, 0.0, GRAVITY]), inverse=True)
    return _compared("specific_force", "the change of velocity", force, t, needed, {}, 0.5)


def _fit(one: Floats, other: Floats) -> float:
    """Return the correlation of two signals without a mean, all axes together."""
    return float((one * other).sum() / max(np.sqrt((one * one).sum() * (other * other).sum()), 1e-12))


def _compared(
    name: str, against: str, signal: Series, t: Floats, expected: Floats, others: dict[str, Floats], still: float = 0.1
) -> list[str]:
    """Return doubts where 0.1 s of ``signal`` and ``expected``, both at ``t``, differ in size or sign.

    ``others``: what it may be instead; ``still``: too small to judge.
    """
    moving = expected.std(axis=0) > still if len(t) else np.zeros(3, dtype=bool)
    if not moving.any():
        return []
    found = np.mean([interpolated(signal.t, signal.values, t + s) for s in np.linspace(-0.05, 0.05, 11)], axis=0)
    a, b, *rest = (each[:, moving] - each[:, moving].mean(axis=0) for each in (found, expected, *others.values()))
    share, fit, out = float((a * b).sum() / max((b * b).sum(), 1e-12)), _fit(a, b), []
    better = {other: _fit(a, c) for other, c in zip(others, rest, strict=True)}
    best = max(better, key=better.__getitem__, default="")
    if best and better[best] > max(fit + 0.1, 0.6):
        out.append(
            f"{name}: agrees with {against} {best} (correlation {better[best]:.2f}), with that expected {fit:.2f}"
        )
    elif fit < 0.6:
        out.append(f"{name}: correlation with {against} {fit:.2f}, expected 0.6 or more: frame, sign or clock?")
    elif not 0.6 < share < 1.6:
        hints = {
            57.3: "degrees for radians",
            1.0 / 57.3: "radians for degrees",
            3.6: "km/h for m/s",
            9.81: "m/s^2 for g",
        }
        hint = next((text for factor, text in hints.items() if 0.8 < share / factor < 1.25), "which unit?")
        out.append(f"{name}: {share:.3g} times {against}, expected 1: {hint}")
    return out


def _motor_range(motors: Series) -> list[str]:
    low, high = motors.values.min(), motors.values.max()
    asked = f"expected commands in 0..1: which unit is {motors.source}?"
    return [] if low >= -0.001 and high <= 1.001 else [f"motors: found {low:.4g} to {high:.4g}, {asked}"]


def _motor_order(rotors: str, motors: Series, rates: Series) -> list[str]:
    t = _both(motors, rates)
    fast = min(len(motors.t) / np.ptp(motors.t), len(rates.t) / np.ptp(rates.t))
    if not len(t) or fast < 45.0:
        return []
    t = np.arange(t[0], t[-1], max(0.02, (t[-1] - t[0]) / MOST))
    alpha, out = _derivative(rates, t, 0.04), []
    best = {}
    for name, arrangement in ARRANGEMENTS.items():
        fits = []
        for shift in (0.0, 0.02, 0.04, 0.06):
            u = interpolated(motors.t, motors.values, t - shift)
            u = u - u.mean(axis=0)
            with np.errstate(invalid="ignore", divide="ignore"):  # motors that do not move
                pairs = zip(arrangement.levers, alpha.T, strict=True)
                fits.append([np.corrcoef(u @ np.array(turn), axis)[0, 1] for turn, axis in pairs])
        best[name] = np.nan_to_num(np.array(fits)).max(axis=0)
    mine = best[rotors]
    other = max(best, key=lambda name: float(best[name][:2].sum()))
    if best[other][:2].sum() > mine[:2].sum() + 0.4 and best[other][:2].min() > 0.2:
        text = ", ".join(f"{value:.2f}" for value in mine)
        out.append(
            f"motors: torque of order {rotors!r} correlates {text} with what followed about x, y, z; order {other!r} "
            f"does {', '.join(f'{value:.2f}' for value in best[other])}"
        )
    return out
