r"""The model that is fitted: four rotors with lag and delay, a thrust curve, a rigid body.

::

    y_i' = (u_i(t - delay) - y_i) / rotor_time_constant
    phi_i = effectiveness_i (linear y_i + square y_i^2) / 4 (V / V_mean)^battery    exp(drift t) without V
    force = (bias_x - drag v_x, bias_y - drag v_y, offset + sum phi_i - drag_z v_z)     what an accelerometer reads
    omega' = B (levers phi) + trim sum phi + damping omega + gyroscopic + (0, 0, reaction sum yaw_i y_i')
    gyroscopic: that of the body, and of the rotors' angular momentum -J_zz reaction sum yaw_i y_i

B is the torque of a rotor's thrust over the inertia: m arm / J, in 1/m. Trim is the offset of the centre of gravity.
The rates are compared over windows of 0.25 s, each with its own mean, so that no error lives longer.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from quad_identify.record import Floats, Grid

NAMES = (
    "thrust_offset", "thrust_linear", "thrust_square", "thrust_battery", "strength_1", "strength_2", "strength_3",
    "rotor_time_constant", "command_delay", "linear_drag", "vertical_drag", "force_bias_x", "force_bias_y",
    "roll_torque_per_inertia", "pitch_torque_per_inertia", "yaw_torque_per_inertia", "trim_x", "trim_y", "trim_z",
    "damping_x", "damping_y", "damping_z", "reaction", "flatness", "thrust_drift",
)  # fmt: skip
"""Parameters of the fit; ``strength``: effectiveness - 1 of rotors 1 to 3, the fourth makes the mean 1; ``flatness``:
J_zz / (J_xx + J_yy), 1 for a flat body; ``thrust_drift``: 1/s, of the thrust where a battery sags unseen."""
AT = {name: index for index, name in enumerate(NAMES)}
BOUNDS = {
    "rotor_time_constant": (1e-4, 0.5),
    "command_delay": (0.0, 0.25),
    "flatness": (0.2, 1.2),
    **{f"damping_{axis}": (-20.0, 0.1) for axis in "xyz"},  # air turns no body faster
}

STILL = 1e-9  # 1/m: torque per inertia of an axis that no motor explains; its rate stays what it is


class Lagged(NamedTuple):
    """Lagged commands of a block, shape (n, 4): mean, mean square, rate of change in 1/s.

    ``mean`` and ``square`` are of what sensors read at the samples; ``turning`` ones of what acts around the samples,
    which is what rates integrate.
    """

    mean: Floats
    square: Floats
    turning_mean: Floats
    turning_square: Floats
    change: Floats


def lagged(grid: Grid, lag: float, delay: float) -> Lagged:
    """Return the commands of ``grid`` behind a first-order ``lag`` s and a ``delay`` s; a command is held."""
    h, keep = grid.fine_step, float(np.exp(-grid.fine_step / max(lag, 1e-6)))
    start = grid.command[:1]
    y = start + lfilter([0.0, 1.0 - keep], [1.0, -keep], grid.command - start, axis=0)

    def earlier(time: float) -> Floats:
        """Return y so long before each sample; between samples it falls towards the command in force."""
        whole = int(np.floor(-time / h))
        decay = float(np.exp((time / h + whole) * h / max(lag, 1e-6)))
        index = np.clip(np.arange(len(y)) + whole, 0, None)
        command: Floats = grid.command[index]
        late: Floats = command + (y[index] - command) * decay
        return late

    out: list[Floats] = []
    for each in (earlier(delay), 0.5 * (earlier(delay - 0.5 * h) + earlier(delay + 0.5 * h))):
        parts = each.reshape(-1, grid.per, 4)
        out += [parts.mean(axis=1), np.square(parts).mean(axis=1)]
    mean, square, turning, turning_square = out
    return Lagged(mean, square, turning, turning_square, np.gradient(turning, grid.step, axis=0))


class Model:
    """The model over the windows of several flights. ``arms``: forward and left arm over each other, for J alone."""

    def __init__(
        self,
        grids: list[Grid],
        arms: tuple[float, float] = (1.0, 1.0),
        curve: float | None = None,
        delay: float | None = None,
    ) -> None:
        """Prepare ``grids``. Known, if not None: ``curve``, the share of the square term (offset 0); ``delay`` in s."""
        self.grids, self.arms, self.curve, self.delay = grids, arms, curve, delay
        volts = [grid.voltage[grid.windows].ravel() for grid in grids if grid.voltage is not None]
        self.mean_voltage = float(np.mean(np.concatenate(volts))) if len(volts) == len(grids) else 0.0
        self.has_velocity = all(grid.velocity_b is not None for grid in grids)
        self.scale, self.lasting = np.ones(6), np.zeros(3)
        self._lagged: dict[tuple[int, float, float], Lagged] = {}
        measured = [np.concatenate([grid.force, grid.rates], axis=1)[grid.windows] for grid in grids]
        self.measured = [windowed(each) for each in measured]

    def free(self) -> NDArray[np.int64]:
        """Return which parameters these flights have anything to say about."""
        fixed = set()
        if self.curve is not None:
            fixed |= {"thrust_offset", "thrust_square" if self.curve < 0.5 else "thrust_linear"}
        if self.delay is not None:
            fixed.add("command_delay")
        fixed.add("thrust_drift" if self.mean_voltage else "thrust_battery")
        if self.voltage_range() < 0.01:
            fixed.add("thrust_battery")
        if not self.has_velocity:
            fixed |= {"linear_drag", "vertical_drag"}
        return np.array([index for name, index in AT.items() if name not in fixed])

    def voltage_range(self) -> float:
        """Return the largest over the smallest voltage - 1."""
        if not self.mean_voltage:
            return 0.0
        volts = np.concatenate([grid.voltage[grid.windows].ravel() for grid in self.grids if grid.voltage is not None])
        return float(np.percentile(volts, 99) / np.percentile(volts, 1) - 1.0)

    def lagged(self, number: int, lag: float, delay: float) -> Lagged:
        """Return the lagged commands of flight ``number``; the last few are kept, for a fit asks again."""
        key = (number, lag, delay)
        if key not in self._lagged:
            if len(self._lagged) > 6 * len(self.grids):
                self._lagged.clear()
            self._lagged[key] = lagged(self.grids[number], lag, delay)
        return self._lagged[key]

    def thrusts(self, p: Floats, number: int, *, turning: bool = False) -> Floats:
        """Return phi in m/s^2 of each rotor at each block of flight ``number``, shape (n, 4): as sensed, or turning."""
        grid, y = self.grids[number], self.lagged(number, p[AT["rotor_time_constant"]], p[AT["command_delay"]])
        linear, square = self.curve_of(p)
        if turning:
            phi = 0.25 * (linear * y.turning_mean + square * y.turning_square) * effectiveness(p)
        else:
            phi = 0.25 * (linear * y.mean + square * y.square) * effectiveness(p)
        if grid.voltage is not None and self.mean_voltage:
            phi = phi * ((grid.voltage / self.mean_voltage) ** p[AT["thrust_battery"]])[:, None]
        elif p[AT["thrust_drift"]]:
            phi = phi * np.exp(p[AT["thrust_drift"]] * grid.t)[:, None]
        return phi

    def curve_of(self, p: Floats) -> tuple[float, float]:
        """Return the linear and square coefficient in m/s^2."""
        linear, square = float(p[AT["thrust_linear"]]), float(p[AT["thrust_square"]])
        if self.curve is None:
            return linear, square
        full = linear / (1.0 - self.curve) if self.curve < 0.5 else square / self.curve
        return (1.0 - self.curve) * full, self.curve * full

    def force_and_acceleration(self, p: Floats, number: int) -> tuple[Floats, Floats]:
        """Return specific force m/s^2 and angular acceleration rad/s^2 at each block, shape (n, 3) each."""
        grid, phi = self.grids[number], self.thrusts(p, number)
        turning = self.thrusts(p, number, turning=True)
        total = phi.sum(axis=1)
        force = np.zeros((len(phi), 3))
        force[:, :2] = p[AT["force_bias_x"] : AT["force_bias_y"] + 1]
        force[:, 2] = p[AT["thrust_offset"]] + total
        if grid.velocity_b is not None:
            force -= grid.velocity_b * p[[AT["linear_drag"], AT["linear_drag"], AT["vertical_drag"]]]
        b = p[AT["roll_torque_per_inertia"] : AT["yaw_torque_per_inertia"] + 1]
        w = grid.rates
        alpha = (
            b * (turning @ np.transpose(grid.rotors.levers))
            + turning.sum(axis=1)[:, None] * p[AT["trim_x"] : AT["trim_z"] + 1]
        )
        alpha += w * p[AT["damping_x"] : AT["damping_z"] + 1]
        alpha += self.gyroscopic(p) * np.stack([w[:, 1] * w[:, 2], w[:, 0] * w[:, 2], w[:, 0] * w[:, 1]], axis=1)
        y, turns = self.lagged(number, p[AT["rotor_time_constant"]], p[AT["command_delay"]]), np.array(grid.rotors.yaw)
        alpha[:, 2] += p[AT["reaction"]] * (y.change @ turns)
        spin = -p[AT["reaction"]] * (y.turning_mean @ turns)  # over J_zz
        j_x, j_y, j_z = self.inertias(p)
        alpha[:, 0] -= j_z / j_x * spin * w[:, 1]
        alpha[:, 1] += j_z / j_y * spin * w[:, 0]
        alpha[:, np.abs(b) <= STILL] = 0.0
        return force, alpha

    def inertias(self, p: Floats) -> tuple[float, float, float]:
        """Return the moments of inertia over the mass and the unit of the arms."""
        forward, left = self.arms
        x = left / _away_from_zero(p[AT["roll_torque_per_inertia"]])
        y = forward / _away_from_zero(p[AT["pitch_torque_per_inertia"]])
        return x, y, float(p[AT["flatness"]]) * (x + y)

    def gyroscopic(self, p: Floats) -> Floats:
        """Return the coefficients of the products of rates: (J_yy - J_zz) / J_xx and so on."""
        x, y, z = self.inertias(p)
        out: Floats = np.clip(np.array([(y - z) / x, (z - x) / y, (x - y) / z]), -2.0, 2.0)
        return out

    def predicted(self, p: Floats) -> list[Floats]:
        """Return force and rates over the windows of each flight, shape (w, blocks, 6), rates less their mean."""
        out = []
        for number, grid in enumerate(self.grids):
            force, alpha = self.force_and_acceleration(p, number)
            rates = np.cumsum(increments(alpha, grid.step), axis=0)[grid.windows]
            out.append(windowed(np.concatenate([force[grid.windows], rates], axis=2)))
        return out

    def residuals(self, p: Floats) -> Floats:
        """Return measured less predicted over ``scale``, shape (windows of all flights, blocks, 6).

        Of the force the share ``lasting`` of each window's mean is taken off: random effects, as pushes and gusts are.
        """
        pairs = zip(self.measured, self.predicted(p), strict=True)
        left = np.concatenate([measured - predicted for measured, predicted in pairs])
        left[:, :, :3] -= self.lasting * left[:, :, :3].mean(axis=1, keepdims=True)
        return left / self.scale


def increments(alpha: Floats, step: float) -> Floats:
    """Return the change of a rate from the block before to each block, from block means ``alpha``; of fourth order."""
    padded = np.concatenate([alpha[:2], alpha, alpha[-1:]])
    change: Floats = step * (13.0 * (padded[1:-2] + padded[2:-1]) - padded[:-3] - padded[3:]) / 24.0
    return change


def windowed(values: Floats) -> Floats:
    """Return (w, blocks, 6) with the mean of each window taken off the rates, the last three."""
    out = values.copy()
    out[:, :, 3:] -= out[:, :, 3:].mean(axis=1, keepdims=True)
    return out


def effectiveness(p: Floats) -> Floats:
    """Return the effectiveness of the four rotors, whose mean is 1."""
    first = p[AT["strength_1"] : AT["strength_3"] + 1]
    return 1.0 + np.append(first, -first.sum())


def _away_from_zero(value: float) -> float:
    return float(np.copysign(max(abs(value), 1e-3), value))
