"""How old attitude and velocity of a log are, compared with its gyro and accelerometer."""

import numpy as np
from scipy.signal import detrend
from scipy.spatial.transform import Rotation

from quad_identify.prediction import GRAVITY
from quad_identify.record import Floats, Grid
from quad_identify.verdict import Parameter, unknown

FLY = "roll, pitch and speed up and down, with attitude and velocity logged at 50 Hz and more"


def state_ages(grids: list[Grid]) -> dict[str, Parameter]:
    """Return attitude_age and velocity_age in s: by how much each lags behind what rates and force integrate to."""
    attitude = [_windows(grid, _attitude(grid)) for grid in grids if grid.attitude is not None]
    velocity = [
        _windows(grid, _velocity(grid)) for grid in grids if grid.attitude is not None and grid.velocity is not None
    ]
    return {f"{name}_age": _age(parts, name) for name, parts in (("attitude", attitude), ("velocity", velocity))}


def _attitude(grid: Grid) -> tuple[Floats, Floats]:
    """Return logged changes of attitude over two blocks and mean rates, rad/s, shape (n, 3)."""
    q = Rotation.from_quat(grid.attitude)
    turn = (q[:-2].inv() * q[2:]).as_rotvec() / (2.0 * grid.step)
    return np.pad(turn, ((1, 1), (0, 0))), grid.rates


def _velocity(grid: Grid) -> tuple[Floats, Floats]:
    """Return logged changes of velocity and accelerations of the accelerometer, m/s^2 (world), shape (n, 3)."""
    sensed = Rotation.from_quat(grid.attitude).apply(grid.force) - np.array([0.0, 0.0, GRAVITY])
    assert grid.velocity is not None
    return np.gradient(grid.velocity, grid.step, axis=0), sensed


def _windows(grid: Grid, both: tuple[Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """Return per window, less mean and drift: integrals of what was logged and sensed, the latter's derivative."""
    paths = (np.cumsum(each, axis=0) * grid.step for each in both)
    first, second, third = (detrend(values[grid.windows], axis=1) for values in (*paths, both[1]))
    return first, second, third


def _age(parts: list[tuple[Floats, Floats, Floats]], name: str) -> Parameter:
    """Return the age that makes the logged integral the sensed one: logged(t) = sensed(t - age), to first order."""
    if not parts:
        return unknown(f"{name}_age", f"no {name} in the log", FLY)
    logged, sensed, slope = (np.concatenate([part[i] for part in parts]) for i in range(3))
    top = np.einsum("wkc,wkc->w", slope, sensed - logged)
    bottom = np.einsum("wkc,wkc->w", slope, slope)
    age = float(top.sum() / max(bottom.sum(), 1e-12))
    half = 2.0 * float(np.sqrt(np.sum((top - age * bottom) ** 2)) / max(bottom.sum(), 1e-12))
    left = logged - sensed + age * slope
    share = 1.0 - float(np.sum(left**2) / max(np.sum(logged**2), 1e-12))
    if half > 0.01 or share < 0.5:
        agree = f"{100 * max(share, 0.0):.0f} % of its changes"
        why = f"{name} and inertial sensors agree in {agree}, interval {2e3 * half:.0f} ms"
        return Parameter("s", None, age - half, age + half, False, why, FLY)
    return Parameter("s", age, age - half, age + half, True, f"{100 * share:.0f} % of the changes agree")
