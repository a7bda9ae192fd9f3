"""Plant ``rigid_body`` beside real flights: 0.5 s ahead, open loop, from measured rotor speed.

The protocol is that of the nanodrone benchmark (Busetto et al., Control Engineering Practice 172, 2026; arXiv
2512.14450; repository idsia-robotics/nanodrone-sysid-benchmark, which has no licence: none of it is here). A Crazyflie
2.1 Brushless flies `melon`, 100 Hz. From each measured state the model goes 50 samples ahead with the rotor speeds
that were measured meanwhile; the error is the mean distance 1, 10 and 50 samples ahead: position, velocity, angle of
the attitude, body rates. Mass, inertia, arm and rotor coefficients are those of the benchmark's own physics model.

DIR holds its flights as Parquet or CSV files with x..z, qx..qw, vx..vz, wx..wz and m1_rads.. or m1_erpm...

  python bench/nanodrone.py DIR --figure docs/images/nanodrone.png
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from quad_core.compilation import compiled
from quad_core.types import Conditions, Rotors, Vec3
from quad_core.vehicle import Layout, Vehicle
from quad_dynamics.newton_euler import rk4
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.rigid_body import derivative, surroundings, with_unit_quaternion
from quad_dynamics.rotors import RotorWrench, rotor_thrusts, wrench_from_rotors

PERIOD, AHEAD, LONGEST = 0.01, (1, 10, 50), 50
ERPM = 2.0 * np.pi / (6 * 60.0)
"""rad/s of one electrical revolution per minute of this motor."""
LEFT_TO_RIGHT = [1, 0, 3, 2]
"""Columns of the motors (front right, rear right, rear left, front left) in this project's order of layout ``x``."""
VEHICLE = Vehicle(
    mass=0.045,
    gravity=9.81,
    arm_length=0.0353 * np.sqrt(2.0),
    inertia_xx=2.3951e-5,
    inertia_yy=2.3951e-5,
    inertia_zz=3.2347e-6,
    lift_coefficient=3.72e-8,
    torque_coefficient=7.74e-12,
    drag_coefficient=0.0,
    drag_torque_coefficient=0.0,
    layout=Layout.X.value,
)
DRAG = 9.1785e-7
"""N s^2/m: that of vehicle crazyflie21."""
MODELS = {
    "naive: nothing changes": None,
    "rigid_body": (VEHICLE, Vec3(1.0, 1.0, -1.0)),  # its rotors turn the other way round
    "rigid_body without torque": (VEHICLE, Vec3(0.0, 0.0, 0.0)),
    "and with the rotors' drag": (VEHICLE._replace(rotor_drag_coefficient=DRAG), Vec3(0.0, 0.0, 0.0)),
}
QUANTITIES = ("p, m", "v, m/s", "R, rad", "omega, rad/s")
PUBLISHED = """
published: naive 0.0143 0.1430 0.6797 0.0329 0.3182 1.4749 0.0071 0.0692 0.3041 0.0796 0.3596 0.8837
published: physics 0.0013 0.0126 0.1269 0.0080 0.0570 0.5781 0.0011 0.0205 0.2544 0.0796 0.3596 0.8837
published: best learned 0.0016 0.0166 0.1119 0.0092 0.0613 0.5556 0.0022 0.0331 0.2268 0.0912 0.4292 0.5979
"""
"""Of the benchmark's repository; its physics model has no torque, and the best learned one is that of each column."""


def go_ahead(vehicle, around, share, speeds, s, found):
    """Write into ``found`` (steps, 13) the states after ``s`` under rotor ``speeds`` (steps, 4) in rad/s.

    ``share``: of the torque of the rotors that acts, by axis.
    """
    for i in range(len(found)):
        now = Rotors(speeds[i, 0], speeds[i, 1], speeds[i, 2], speeds[i, 3])
        made, sum_of_speeds = (
            wrench_from_rotors(vehicle, rotor_thrusts(vehicle, now)),
            now.r1 + now.r2 + now.r3 + now.r4,
        )
        torque = Vec3(share.x * made.torque_b.x, share.y * made.torque_b.y, share.z * made.torque_b.z)
        rotors = RotorWrench(made.thrust, torque, 0.0, vehicle.rotor_drag_coefficient * sum_of_speeds)
        s = with_unit_quaternion(rk4(derivative, around, rotors, rotors, rotors, s, PERIOD))
        for j in range(13):
            found[i, j] = s[j]


def read(path):
    """Return states (p, v, q, omega), shape (samples, 13), and rotor speeds in rad/s, shape (samples, 4)."""
    frame = pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)
    columns = [f"{group}{axis}" for group in ("", "v", "q", "w") for axis in ("xyzw" if group == "q" else "xyz")]
    state = frame[columns].to_numpy(float, copy=True)
    state[:, 6:10] /= np.linalg.norm(state[:, 6:10], axis=1)[:, None]
    measured = "m1_rads" in frame
    motors = frame[[f"m{n}_{'rads' if measured else 'erpm'}" for n in range(1, 5)]].to_numpy(float)
    return state, np.ascontiguousarray((motors if measured else ERPM * motors)[:, LEFT_TO_RIGHT])


def errors(true, predicted):
    """Return the mean distances of position, velocity, attitude (rad) and body rates."""
    angle = (Rotation.from_quat(true[:, 6:10]).inv() * Rotation.from_quat(predicted[:, 6:10])).magnitude()
    parts = [np.linalg.norm((true - predicted)[:, part], axis=1) for part in (slice(3), slice(3, 6), slice(10, 13))]
    return np.mean([parts[0], parts[1], angle, parts[2]], axis=1)


def errors_ahead(flights, model):
    """Return the errors of ``model`` (vehicle, share of the torque) 1 to LONGEST samples ahead, shape (LONGEST, 4).

    None for ``model``: that of a vehicle whose state does not change.
    """
    step, found = compiled(go_ahead), []
    for state, speeds in flights:
        paths = np.repeat(state[:-LONGEST, None], LONGEST, axis=1)
        if model is not None:
            vehicle, share = model
            around = surroundings(PlantParameters(), vehicle, Conditions())
            for i, path in enumerate(paths):
                step(vehicle, around, share, speeds[i : i + LONGEST], tuple(map(float, state[i])), path)
        found.append([errors(state[h : h + len(paths)], paths[:, h - 1]) for h in range(1, LONGEST + 1)])
    return np.mean(found, axis=0)


def row(name, cells):
    """Return a row of the table: ``cells`` of p, v, R, omega, each 1, 10 and 50 samples ahead."""
    return f"| {name} | " + " | ".join(cells) + " |"


def draw(found, path):
    """Draw the errors of {model: (LONGEST, 4)} over the time ahead, published ones as dots."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(11.0, 3.0), layout="constrained")
    for place, (axis, label) in enumerate(zip(axes, QUANTITIES, strict=True)):
        for name, values in found.items():
            axis.plot(PERIOD * np.arange(1, LONGEST + 1), values[:, place], label=name)
        for mark, line in zip("xo+", PUBLISHED.strip().splitlines(), strict=True):
            name, *cells = line.rsplit(" ", 12)
            times, dots = PERIOD * np.array(AHEAD), [float(cell) for cell in cells[3 * place : 3 * place + 3]]
            axis.plot(times, dots, mark, color="0.3", label=name)
        axis.set(xlabel="s ahead", ylabel=label, yscale="log")
    axes[0].legend(fontsize=6)
    figure.savefig(path)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, metavar="DIR", help="flights of the benchmark")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw the errors over the time ahead")
    options = parser.parse_args()
    flights = [read(path) for path in sorted(options.directory.glob("*")) if path.suffix in (".parquet", ".csv")]
    if not flights:
        sys.stderr.write(f"nanodrone: {options.directory}: found no flights, expected Parquet or CSV files\n")
        return 2
    print(
        row(f"{len(flights)} flights", [f"{what} +{h}" for what in QUANTITIES for h in AHEAD])
        + "\n"
        + "|---" * 13
        + "|"
    )
    found = {name: errors_ahead(flights, model) for name, model in MODELS.items()}
    for name, values in found.items():
        print(row(name, [f"{value:.4f}" for value in values[np.array(AHEAD) - 1].T.flat]))
    for line in PUBLISHED.strip().splitlines():
        name, *cells = line.rsplit(" ", 12)
        print(row(name, cells))
    if options.figure:
        draw(found, options.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
