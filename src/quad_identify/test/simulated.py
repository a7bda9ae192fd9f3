"""A quadrotor's log from an independent simulation, whose parameters are known; it shares nothing with the package.

The vehicle flies multisines in tilt, thrust and yaw under its own cascaded PD control, at 1 kHz. Layout x, rotors as in
``quad_dynamics.rotors``: 1 rear right, 2 front right, 3 front left, 4 rear left; 1 and 3 turn it to +yaw.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

GRAVITY = 9.81
ROLL = np.array([-1.0, -1.0, 1.0, 1.0])
PITCH = np.array([1.0, -1.0, -1.0, 1.0])
YAW = np.array([1.0, -1.0, 1.0, -1.0])


class Truth(NamedTuple):
    """One vehicle, SI units; ``curve`` 0: thrust is linear in the command, 1: its square; ``sag``: power of voltage."""

    mass: float = 0.5
    arm: float = 0.13
    inertia: tuple[float, float, float] = (2.3e-3, 2.5e-3, 4.0e-3)
    specific_thrust: float = 24.0
    curve: float = 0.8
    lag: float = 0.03
    delay: float = 0.01
    yaw_arm: float = 0.015
    drag: float = 0.2
    sag: float = 1.5
    effectiveness: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    centre: tuple[float, float] = (0.0, 0.0)
    seed: int = 1


class Manoeuvre(NamedTuple):
    """What is flown: s, and amplitudes of tilt (rad), yaw rate (rad/s) and thrust (over hover)."""

    duration: float = 70.0
    roll: float = 0.25
    pitch: float = 0.25
    yaw: float = 0.6
    thrust: float = 0.25


class Noise(NamedTuple):
    """Standard deviations per sample at 1 kHz: rad/s, m/s^2, m/s, rad; that of scenario ``flight`` where it has one.

    ``push``: of forces in m/s^2 (and torques in rad/s^2) along each axis, each held for 2 s.
    """

    rate: float = 8.7266e-3
    acceleration: float = 0.3
    velocity: float = 0.02
    attitude: float = 3.4907e-3
    push: float = 0.0


def drawn(seed: int) -> Truth:
    """Return a random vehicle: 0.03 to 5 kg, lag 0 to 80 ms, delay 0 to 40 ms, a battery that sags."""
    rng = np.random.default_rng(seed)
    mass = float(np.exp(rng.uniform(math.log(0.03), math.log(5.0))))
    arm = 0.16 * mass ** (1 / 3) * rng.uniform(0.8, 1.25)
    x = mass * arm * arm * rng.uniform(0.15, 0.4)
    y = x * rng.uniform(0.8, 1.3)
    z = (x + y) * rng.uniform(0.75, 0.98)
    working = 1.0 + 0.06 * rng.standard_normal(4)
    return Truth(
        mass, arm, (x, y, z),
        specific_thrust=rng.uniform(18.0, 35.0), curve=rng.uniform(0.0, 1.0),
        lag=rng.uniform(0.0, 0.08), delay=rng.uniform(0.0, 0.04),
        yaw_arm=arm * rng.uniform(0.07, 0.15), drag=rng.uniform(0.05, 0.5), sag=rng.uniform(1.0, 2.0),
        effectiveness=tuple((working / working.mean()).tolist()),
        centre=tuple((0.02 * arm * rng.standard_normal(2)).tolist()),
        seed=seed,
    )  # fmt: skip


def multisine(rng, t, low, high, lines):
    """Return a signal of unit peak with ``lines`` frequencies between ``low`` and ``high`` Hz."""
    frequencies = np.exp(np.linspace(math.log(low), math.log(high), lines)) * rng.uniform(0.97, 1.03, lines)
    wave = np.sin(2.0 * np.pi * np.outer(t, frequencies) + rng.uniform(0.0, 2.0 * np.pi, lines)).sum(axis=1)
    return wave / np.abs(wave).max()


def flown(truth: Truth = Truth(), manoeuvre: Manoeuvre = Manoeuvre(), noise: Noise = Noise()):  # noqa: B008
    """Return {signal: array at 1 kHz} of a flight of ``truth``: t, specific_force, ..."""
    rng = np.random.default_rng(1000 + truth.seed)
    t = np.arange(int(1000 * manoeuvre.duration)) * 1e-3
    slow = truth.lag + truth.delay
    top = min(6.0, 0.35 / (slow + 0.02))
    waves = np.stack(
        [multisine(rng, t, 0.2, 0.8, 6) * peak for peak in (manoeuvre.roll, manoeuvre.pitch, manoeuvre.yaw)]
        + [multisine(rng, t, 0.3, top, 8) * manoeuvre.thrust]
        + [multisine(rng, t, 0.8, 2.5 * top, 10) * peak for peak in (manoeuvre.roll, manoeuvre.pitch, manoeuvre.yaw)],
        axis=1,
    )  # fmt: skip
    voltage = 12.6 - 1.9 * t / 75.0
    normals = rng.standard_normal((len(t), 12))
    pushes = noise.push * np.repeat(rng.standard_normal((len(t) // 2000 + 1, 6)), 2000, axis=0)
    out = _fly(
        truth.mass, truth.arm, np.array(truth.inertia), truth.specific_thrust, truth.curve, truth.lag, truth.delay,
        truth.yaw_arm, truth.drag, truth.sag, np.array(truth.effectiveness), np.array(truth.centre), waves, voltage,
        float(voltage.mean()), normals, np.array(noise), pushes,
    )  # fmt: skip
    signals = {"t": t, "voltage": voltage + 0.02 * rng.standard_normal(len(t))}
    parts = {"specific_force": 3, "body_rates": 3, "velocity": 3, "attitude": 4, "motors": 4}
    for (name, _), columns in zip(
        parts.items(), np.split(out, np.cumsum(list(parts.values()))[:-1], axis=1), strict=True
    ):
        signals[name] = columns
    assert np.abs(signals["velocity"]).max() < 40.0, "the simulated vehicle was lost"
    return signals


@numba.njit(cache=True)
def _fly(
    m,
    arm,
    J,
    top,
    curve,
    lag,
    delay,
    yaw_arm,
    drag,
    sag,
    working,
    centre,
    waves,
    voltage,
    mean_voltage,
    normals,
    noise,
    pushes,
):
    steps, h = len(waves), 1e-3
    out = np.zeros((steps, 17))
    line = np.zeros((steps, 4))
    lever = arm * math.sqrt(0.5)
    q, w, v, p = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3), np.zeros(3)
    root = math.sqrt((1.0 - curve) ** 2 + 4.0 * curve * GRAVITY / top)
    hover = GRAVITY / top if curve < 1e-6 else (root - (1.0 - curve)) / (2.0 * curve)
    trim = np.empty(4)
    for i in range(4):  # at rest in the air: no torque about the centre of gravity
        share = (1.0 + (ROLL[i] * centre[1] - PITCH[i] * centre[0]) / lever) / working[i] * GRAVITY / top
        trim[i] = (
            share
            if curve < 1e-6
            else (math.sqrt((1.0 - curve) ** 2 + 4.0 * curve * share) - (1.0 - curve)) / (2.0 * curve)
        )
    slope = top * ((1.0 - curve) + 2.0 * curve * hover)
    u, y = trim.copy(), trim.copy()
    slow = lag + delay + 0.01
    rate_gain, angle_gain = 0.35 / slow, 0.1 / slow
    speed_gain = min(0.8, 0.03 / slow)
    place_gain = 0.2 * speed_gain
    integral = np.zeros(4)
    whole = math.floor(delay / h)
    part = delay / h - whole
    for k in range(steps):
        gain = (voltage[k] / mean_voltage) ** sag
        f = np.empty(4)
        for i in range(4):
            f[i] = working[i] * gain * 0.25 * m * top * ((1.0 - curve) * y[i] + curve * y[i] * y[i])
        R = _matrix(q)
        vb = R.T @ v
        force = R.T @ pushes[k, :3] - drag * vb
        force[2] += f.sum() / m
        tau = np.array(
            [
                lever * (-f[0] - f[1] + f[2] + f[3]) - centre[1] * f.sum(),
                lever * (f[0] - f[1] - f[2] + f[3]) + centre[0] * f.sum(),
                yaw_arm * (f[0] - f[1] + f[2] - f[3]),
            ]
        )
        n = normals[k]
        seen_w, seen_v = w + noise[0] * n[0:3], v + noise[2] * n[6:9]
        seen_q = _turned(q, noise[3] * n[9:12])
        out[k, 0:3] = force + noise[1] * n[3:6]
        out[k, 3:6], out[k, 6:9], out[k, 9:13] = seen_w, seen_v, seen_q
        # control: place and speed to tilt, tilt to rates, rates to torque
        Rs = _matrix(seen_q)
        ax = np.array([waves[k, 4 - 3], -waves[k, 0]]) * GRAVITY
        ax[0] -= place_gain * p[0] + speed_gain * seen_v[0]
        ax[1] -= place_gain * p[1] + speed_gain * seen_v[1]
        z_wish = np.array([ax[0] / GRAVITY, ax[1] / GRAVITY, 1.0])
        z_wish /= math.sqrt(z_wish @ z_wish)
        zb = Rs.T @ z_wish
        integral[0] += h * (-zb[1])
        integral[1] += h * zb[0]
        wish = np.array(
            [
                angle_gain * (-zb[1] + 0.1 * rate_gain * integral[0]) + waves[k, 4] * angle_gain,
                angle_gain * (zb[0] + 0.1 * rate_gain * integral[1]) + waves[k, 5] * angle_gain,
                waves[k, 2] + waves[k, 6],
            ]
        )
        alpha = rate_gain * (wish - seen_w)
        integral[3] += h * (wish[2] - seen_w[2])
        alpha[2] += 0.1 * rate_gain * rate_gain * integral[3]
        up = -2.0 * place_gain * p[2] - speed_gain * seen_v[2]
        integral[2] += h * (-0.2 * speed_gain * (p[2] * place_gain + seen_v[2] * 0.5))
        collective = (up + integral[2]) / slope + waves[k, 3] * min(hover, 0.8 * (1.0 - hover))
        mixed = np.array([J[0] * alpha[0] / lever, J[1] * alpha[1] / lever, J[2] * alpha[2] / yaw_arm]) / (m * slope)
        for i in range(4):
            value = trim[i] + collective + ROLL[i] * mixed[0] + PITCH[i] * mixed[1] + YAW[i] * mixed[2]
            u[i] = min(1.0, max(0.02, value))
        line[k] = u
        out[k, 13:17] = u
        a, b = max(0, k - whole), max(0, k - whole - 1)
        # motion over [k, k + 1): the delayed command changes within the step where the delay is no whole step
        for s in range(4):
            long = 0.5 * h * (part if s < 2 else 1.0 - part)
            from_line = line[b] if s < 2 else line[a]
            for i in range(4):  # exact in the middle and at the end of the sub-step
                keep = math.exp(-0.5 * long / lag) if lag > 1e-6 else 0.0
                middle = from_line[i] + (y[i] - from_line[i]) * keep
                y[i] = from_line[i] + (middle - from_line[i]) * keep
                f[i] = working[i] * gain * 0.25 * m * top * ((1.0 - curve) * middle + curve * middle * middle)
            tau[0] = lever * (-f[0] - f[1] + f[2] + f[3]) - centre[1] * f.sum()
            tau[1] = lever * (f[0] - f[1] - f[2] + f[3]) + centre[0] * f.sum()
            tau[2] = yaw_arm * (f[0] - f[1] + f[2] - f[3])
            turn = np.array(
                [
                    (tau[0] - (J[2] - J[1]) * w[1] * w[2]) / J[0],
                    (tau[1] - (J[0] - J[2]) * w[0] * w[2]) / J[1],
                    (tau[2] - (J[1] - J[0]) * w[0] * w[1]) / J[2],
                ]
            )
            q = _turned(q, long * (w + 0.5 * long * turn))
            w = w + long * (turn + pushes[k, 3:])
            acceleration = _matrix(q)[:, 2] * (f.sum() / m) - drag * v + pushes[k, :3]
            acceleration[2] -= GRAVITY
            v = v + long * acceleration
            p = p + long * v
    return out


@numba.njit(cache=True)
def _matrix(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@numba.njit(cache=True)
def _turned(q, turn):
    x, y, z, w = q
    a, b, c = 0.5 * turn
    out = np.array(
        [x + w * a + y * c - z * b, y + w * b + z * a - x * c, z + w * c + x * b - y * a, w - x * a - y * b - z * c]
    )
    return out / math.sqrt(out @ out)
