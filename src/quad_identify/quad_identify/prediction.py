"""How well parameters predict flights that they were not fitted to, against holding the last value.

From every half second of a flight the vehicle is predicted 0.1, 0.5 and 1 s (and one block) ahead: its rates, attitude,
velocity and position, from the measured ones and the commands.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from quad_identify.model import Model
from quad_identify.record import Floats, Grid

HORIZONS = (0.0, 0.1, 0.5, 1.0)  # s; 0: one block
GRAVITY = 9.81
Errors = dict[str, dict[str, float]]


def held_out(model: Model, parameters: dict[str, Floats]) -> Errors:
    """Return {quantity at horizon: {predictor: RMS error}} over the windows of ``model``.

    ``parameters``: {name of a predictor: its parameters}; "hold last" is always among the predictors. Quantities:
    body_rates rad/s, attitude rad, velocity m/s, position m; specific_force m/s^2 and its R2 have no horizon.
    """
    out: Errors = {}
    for name, p in parameters.items():
        _force(model, name, p, out)
    for horizon in HORIZONS:
        sums: dict[str, dict[str, list[Floats]]] = {}
        for number, grid in enumerate(model.grids):
            steps = max(1, round(horizon / grid.step))
            starts = _starts(grid, steps)
            for name, used in [("hold last", None), *parameters.items()]:
                for quantity, errors in ahead(model, number, used, starts, steps).items():
                    sums.setdefault(quantity, {}).setdefault(name, []).append(errors)
        label = f"{horizon:g} s" if horizon else "one step"
        for quantity, found in sums.items():
            rms = {name: float(np.sqrt(np.mean(np.concatenate(errors) ** 2))) for name, errors in found.items()}
            out[f"{quantity} at {label}"] = rms
    return out


def _force(model: Model, name: str, p: Floats, out: Errors) -> None:
    parts = [
        (grid.force[grid.windows], model.force_and_acceleration(p, i)[0][grid.windows])
        for i, grid in enumerate(model.grids)
    ]
    measured, predicted = (np.concatenate([each[side].reshape(-1, 3) for each in parts]) for side in (0, 1))
    along, left = measured[:, 2], measured[:, 2] - predicted[:, 2]
    steps = np.concatenate([np.diff(force[:, :, 2], axis=1).ravel() for force, _ in parts])
    force = out.setdefault("specific_force", {"hold last": float(np.sqrt(np.mean(steps**2)))})
    force[name] = float(np.sqrt(np.mean(left**2)))
    out.setdefault("specific_force R2", {})[name] = float(1.0 - np.mean(left**2) / np.var(along))


def _starts(grid: Grid, steps: int) -> NDArray[np.int64]:
    """Return the blocks from which to predict: every half second inside runs of windows, ``steps`` before their end."""
    good = np.zeros(len(grid.t) + 1, dtype=bool)
    good[grid.windows.ravel()] = True
    apart = max(1, round(0.5 / grid.step))
    starts = grid.windows[:, ::apart].ravel()
    inside = np.array([at + steps < len(good) and bool(good[at : at + steps + 1].all()) for at in starts])
    found: NDArray[np.int64] = starts[inside] if inside.any() else starts[:1] * 0
    return found


def ahead(model: Model, number: int, p: Floats | None, starts: NDArray[np.int64], steps: int) -> dict[str, Floats]:
    """Return {quantity: errors (starts, 3)} of a prediction over ``steps`` blocks; without ``p`` all is held."""
    grid = model.grids[number]
    rates, out = grid.rates[starts].copy(), {}
    turn = None if grid.attitude is None else Rotation.from_quat(grid.attitude[starts])
    velocity = None if grid.velocity is None else grid.velocity[starts].copy()
    position = None if grid.position is None or velocity is None else grid.position[starts].copy()
    force, alpha = (None, None) if p is None else model.force_and_acceleration(p, number)
    for k in range(steps):
        at = starts + k
        if alpha is not None and force is not None:
            change = 0.5 * grid.step * (alpha[at] + alpha[at + 1])
            if velocity is not None and turn is not None:
                middle = turn * Rotation.from_rotvec(0.5 * grid.step * rates)
                gain = middle.apply(0.5 * (force[at] + force[at + 1])) - np.array([0.0, 0.0, GRAVITY])
            turn = None if turn is None else turn * Rotation.from_rotvec(grid.step * (rates + 0.5 * change))
            rates = rates + change
            if velocity is not None and grid.attitude is not None:
                position = None if position is None else position + grid.step * (velocity + 0.5 * grid.step * gain)
                velocity = velocity + grid.step * gain
        elif position is not None and velocity is not None:
            position = position + grid.step * velocity
    end = starts + steps
    out["body_rates"] = grid.rates[end] - rates
    if turn is not None and grid.attitude is not None:
        out["attitude"] = (turn.inv() * Rotation.from_quat(grid.attitude[end])).as_rotvec()
    if velocity is not None and grid.velocity is not None:
        out["velocity"] = grid.velocity[end] - velocity
    if position is not None and grid.position is not None:
        out["position"] = grid.position[end] - position
    return out
