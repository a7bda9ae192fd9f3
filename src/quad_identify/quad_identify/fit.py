"""The fit: a grid over lag and delay with linear least squares inside, then Gauss-Newton on the output error.

The covariance is that of the scores of whole windows (a sandwich), so noise that is not white widens the intervals.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import approx_fprime, least_squares
from scipy.stats import t as student

from quad_identify.model import AT, BOUNDS, NAMES, STILL, Model
from quad_identify.record import WINDOW, Floats

LAGS = np.array([0.002, 0.01, 0.02, 0.035, 0.05, 0.07, 0.1])  # s
DELAYS = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.06])  # s
OFFSET_BELIEF = 0.5  # m/s^2: standard deviation of the specific thrust at command 0, assumed before any flight
STRENGTH_BELIEF = 0.15  # the same of a rotor's effectiveness
FLATNESS_BELIEF = (0.88, 0.1)  # mean and standard deviation of J_zz / (J_xx + J_yy)
OUTLIER = 6.0  # times the median error of a window
OUTLIVED = 8  # windows after which errors are counted as independent, at least
MOST_ROUNDS = 40  # of Gauss-Newton; a fit that is stopped before its end is wrong by more than its interval
SILENT = 0.25  # share of an axis' motion below which the fit leaves it alone
MOVES = 0.95  # share of an axis' motion that the motors must explain: what is left, fed back by control, is the bias
DOUBT = 10.0  # one part in so many that an axis counts whose motion the motors do not explain
OF_AXIS: dict[int, tuple[str, ...]] = {
    3: ("roll_torque_per_inertia", "trim_x", "damping_x", "flatness"),
    4: ("pitch_torque_per_inertia", "trim_y", "damping_y", "flatness"),
    5: ("yaw_torque_per_inertia", "trim_z", "damping_z", "reaction", "flatness"),
}
"""Parameters that an axis of rotation tells."""
TIMING = (AT["rotor_time_constant"], AT["command_delay"])
Report = Callable[[str], None]


class Fit(NamedTuple):
    """Parameters in the order of NAMES, their covariance, and what is left.

    ``residual`` (3 + 3): RMS of force m/s^2 and of rates rad/s; ``explained``: share of the variance of each that the
    motors explain; ``quantile``: of Student's t, for 95 %; ``lasting`` (3): RMS of force errors that outlast a window.
    """

    p: Floats
    covariance: Floats
    residual: Floats
    explained: Floats
    quantile: float
    windows: int
    left_out: int
    lasting: Floats


def start(model: Model) -> Floats:
    """Return the best of a grid over lag and delay, the rest by linear least squares."""
    best: float = np.inf
    found: Floats | None = None
    for lag in LAGS:
        for delay in DELAYS if model.delay is None else [model.delay]:
            p = np.zeros(len(NAMES))
            p[AT["rotor_time_constant"]], p[AT["command_delay"]], p[AT["flatness"]] = lag, delay, 0.9
            cost = _linear(model, p)
            if cost < best:
                best, found = cost, p
    assert found is not None
    return found


def _linear(model: Model, p: Floats) -> float:
    """Write curve and torque per inertia into ``p`` by linear least squares at its lag and delay; return the cost."""
    first, forces, rates = [], [], []
    lag, delay = p[AT["rotor_time_constant"]], p[AT["command_delay"]]
    for number, grid in enumerate(model.grids):
        y = model.lagged(number, lag, delay)
        mean, square = 0.25 * y.mean.sum(axis=1), 0.25 * y.square.sum(axis=1)
        columns = [mean, square] if model.curve is None else [(1.0 - model.curve) * mean + model.curve * square]
        first.append(np.stack([each[grid.windows].ravel() for each in columns], axis=1))
        forces.append(grid.force[grid.windows][:, :, 2].ravel())
        level = y.mean @ np.transpose(grid.rotors.levers)  # torque of small differences
        angle = np.concatenate([level, y.mean.sum(axis=1)[:, None]], axis=1)[grid.windows]
        path = np.cumsum(angle, axis=1) * grid.step
        rates.append((path - path.mean(axis=1, keepdims=True)).reshape(-1, 4))
    matrix, force = np.concatenate(first), np.concatenate(forces)
    weights = np.concatenate([matrix, np.ones((len(matrix), 1))], axis=1) if model.curve is None else matrix
    regular = np.diag([0.3, 0.3, 3.0][: weights.shape[1]])
    found, *_ = np.linalg.lstsq(np.vstack([weights, regular]), np.append(force, np.zeros(len(regular))), rcond=None)
    cost = float(np.mean((force - weights @ found) ** 2) / np.var(force))
    if model.curve is None:
        p[AT["thrust_linear"]], p[AT["thrust_square"]], p[AT["thrust_offset"]] = found
    else:
        p[AT["thrust_linear"]], p[AT["thrust_square"]] = (1.0 - model.curve) * found[0], model.curve * found[0]
    first_order, second_order = model.curve_of(p)
    hover = float(np.mean([grid.command.mean() for grid in model.grids]))
    slope = 0.25 * max(first_order + 2.0 * second_order * hover, 1.0)
    both = np.concatenate(rates)
    measured = np.concatenate([each[:, :, 3:].reshape(-1, 3) for each in model.measured])
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        pair = both[:, [axis, 3]]
        gains, *_ = np.linalg.lstsq(pair, measured[:, axis], rcond=None)
        p[AT[f"{name}_torque_per_inertia"]] = gains[0] / slope
        p[AT[f"trim_{'xyz'[axis]}"]] = gains[1] / slope
        cost += float(np.mean((measured[:, axis] - pair @ gains) ** 2) / max(np.var(measured[:, axis]), 1e-12))
    return cost


def fitted(model: Model, begin: Floats | None = None, report: Report = lambda _: None) -> Fit:
    """Return the fit of ``model``, from ``begin`` or from the grid. Progress goes to ``report`` in words."""
    if begin is None:
        report("grid over lag and delay")
    p = start(model) if begin is None else begin.copy()
    free, silent, weight = model.free(), np.zeros(6, dtype=bool), np.ones(6)
    keep = np.ones(len(model.residuals(p)), dtype=bool)
    for turn in range(2):
        report(f"Gauss-Newton, pass {turn + 1} of 2, {int(keep.sum())} windows of {WINDOW:g} s")
        model.scale, model.lasting = np.ones(6), np.zeros(3)
        left = model.residuals(p)
        if turn:
            explained = _explained(model, keep, p)
            model.lasting, _ = _lasting(left[keep][:, :, :3])
            silent[3:], weight[3:] = explained[3:] < SILENT, np.where(explained[3:] < MOVES, DOUBT, 1.0)
            for axis in np.flatnonzero(silent).tolist():
                p[AT[OF_AXIS[axis][0]]] = STILL
            gone = {name for axis in np.flatnonzero(silent).tolist() for name in OF_AXIS[axis]}
            free = np.array([index for index in free if NAMES[index] not in gone])
        scale = np.maximum(np.sqrt(np.mean(model.residuals(p)[keep] ** 2, axis=(0, 1))), 1e-6)
        model.scale = np.where(silent, 1e9, scale * weight)  # a bad model of an axis tells no timing
        repeats = _repeats(model, p, keep) if turn else 1.0
        p = _descended(model, p, free, keep, repeats)
        error = np.sqrt(np.mean(model.residuals(p) ** 2, axis=(1, 2)))
        keep = error < OUTLIER * np.median(error)
    model.scale = np.where(silent, 1e9, weight * np.maximum(_left(model, p)[keep].std(axis=(0, 1)), 1e-6))
    covariance, quantile = covariance_of(model, p, free, keep, repeats)
    model.scale, model.lasting = np.ones(6), np.zeros(3)
    left = _left(model, p)[keep]
    model.scale = np.maximum(left.std(axis=(0, 1)), 1e-6)
    explained, (_, lasting) = _explained(model, keep, p), _lasting(left[:, :, :3])
    count = int(keep.sum())
    return Fit(p, covariance, model.scale.copy(), explained, quantile, count, len(keep) - count, lasting)


def _left(model: Model, p: Floats) -> Floats:
    """Return what is left in m/s^2 and rad/s, shape (windows, blocks, 6)."""
    return model.residuals(p) * model.scale


def _lasting(left: Floats) -> tuple[Floats, Floats]:
    """Return per column: the share of a window's mean to take off (0: errors are white, 1: they last), RMS of lasting.

    Of white errors the mean of a window has a variance of that within windows over the blocks.
    """
    mean, blocks = left.mean(axis=1), left.shape[1]
    white = ((left - mean[:, None]) ** 2).sum(axis=(0, 1)) / (len(left) * (blocks - 1) * blocks)
    square = np.mean(mean**2, axis=0)
    share: Floats = 1.0 - np.sqrt(np.minimum(white / np.maximum(square, 1e-12 / blocks), 1.0))
    return share, np.sqrt(np.maximum(square - white, 0.0))


def _explained(model: Model, keep: NDArray[np.bool_], p: Floats) -> Floats:
    """Return the share of the variance of each of the six outputs that the model explains."""
    measured = np.concatenate(model.measured)[keep].reshape(-1, 6)
    share: Floats = 1.0 - np.mean(_left(model, p)[keep].reshape(-1, 6) ** 2, axis=0) / np.maximum(
        measured.var(axis=0), 1e-12
    )
    return share


def _outputs(
    model: Model, p: Floats, free: NDArray[np.int64], keep: NDArray[np.bool_], belief: float
) -> Callable[[Floats], Floats]:
    """Return what is squared, as a function of the ``free`` parameters: errors in the windows to ``keep``, beliefs."""

    def of(x: Floats) -> Floats:
        full = p.copy()
        full[free] = x
        return np.append(model.residuals(full)[keep].ravel(), _belief(full, belief))

    return of


def _slopes(of: Callable[[Floats], Floats], x: Floats, free: NDArray[np.int64]) -> Floats:
    steps = np.where(np.isin(free, TIMING), 3e-4, 1e-4 * np.maximum(np.abs(x), 0.1))
    slopes: Floats = approx_fprime(x, of, steps)
    return slopes


def _descended(model: Model, p: Floats, free: NDArray[np.int64], keep: NDArray[np.bool_], belief: float) -> Floats:
    low, high = np.transpose([BOUNDS.get(NAMES[index], (-np.inf, np.inf)) for index in free])
    of, inside = _outputs(model, p, free, keep, belief), np.clip(p[free], low + 1e-9, high - 1e-9)
    known: dict[str, Any] = {"x_scale": "jac", "max_nfev": MOST_ROUNDS, "ftol": 1e-7, "xtol": 1e-6}
    done = least_squares(of, inside, lambda x: _slopes(of, x, free), (low, high), **known)
    out = p.copy()
    out[free] = done.x
    return out


def _belief(p: Floats, weight: float) -> Floats:
    """Return pseudo-measurements: no command gives no thrust, rotors are alike, a body is about as flat as most.

    ``weight``: how many samples tell as much as one would if errors were white.
    """
    flat, spread = FLATNESS_BELIEF
    alike = p[AT["strength_1"] : AT["strength_3"] + 1] / STRENGTH_BELIEF
    believed = [p[AT["thrust_offset"]] / OFFSET_BELIEF, (p[AT["flatness"]] - flat) / spread, *alike]
    out: Floats = np.sqrt(weight) * np.array(believed)
    return out


BELIEFS = 5


def _repeats(model: Model, p: Floats, keep: NDArray[np.bool_]) -> float:
    """Return how many samples of the force tell as much as one would if its errors were white, within a second."""
    left = _left(model, p)[keep][:, :, 2]
    span = round(1.0 / WINDOW)
    spans = left[: len(left) // span * span].reshape(-1, span * left.shape[1])
    return max(1.0, float(spans.mean(axis=1).var() * spans.shape[1] / max(spans.var(), 1e-12)))


def covariance_of(
    model: Model, p: Floats, free: NDArray[np.int64], keep: NDArray[np.bool_], belief: float
) -> tuple[Floats, float]:
    """Return the covariance of all parameters (0 where fixed) and the quantile of 95 %."""
    of, at = _outputs(model, p, free, keep, belief), p.copy()
    at[TIMING[0]] = max(p[TIMING[0]], *(grid.fine_step for grid in model.grids))  # a lag within a sample has no slope
    slopes, left = _slopes(of, at[free], free), of(p[free])
    believed = slopes[-BELIEFS:].T @ slopes[-BELIEFS:]
    windows = int(keep.sum())
    rows, errors = slopes[:-BELIEFS].reshape(windows, -1, len(free)), left[:-BELIEFS].reshape(windows, -1)
    scores = np.einsum("wkp,wk->wp", rows, errors)
    bread = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    freedom = max(windows - len(free) / 3, 2.0)
    meat, widened = scatter(scores)
    out = np.zeros((len(NAMES), len(NAMES)))
    out[np.ix_(free, free)] = bread @ (meat * windows / freedom + believed) @ bread
    return out, widened * float(student.ppf(0.975, freedom))


def scatter(scores: Floats) -> tuple[Floats, float]:
    """Return the covariance of the sum of ``scores`` (windows, n), which may last, and by how much to widen intervals.

    Weighted as by Newey and West; widened as by Kiefer and Vogelsang (2005), for so few sums tell a covariance badly.
    """
    out, outlived = scores.T @ scores, _outlived(scores)
    for apart in range(1, outlived):
        both = scores[apart:].T @ scores[:-apart]
        out = out + (1.0 - apart / outlived) * (both + both.T)
    share = outlived / len(scores)
    return out, 1.0 + (2.9694 * share + 0.416 * share**2 - 0.5324 * share**3) / 1.96


def _outlived(scores: Floats) -> int:
    """Return the windows after which errors count as independent, OUTLIVED and more.

    More where they last longer (pushes, gusts): Andrews' (1991) choice for an autoregression of the slowest score.
    """
    last = np.sum(scores[1:] * scores[:-1], axis=0) / np.maximum(np.sum(scores**2, axis=0), 1e-300)
    rho = float(np.clip(last.max(), 0.0, 0.97))
    growth = 4.0 * rho**2 / ((1.0 - rho) * (1.0 + rho)) ** 2
    return int(
        np.clip(np.ceil(1.1447 * (growth * len(scores)) ** (1.0 / 3.0)), OUTLIVED, max(len(scores) // 4, OUTLIVED))
    )
