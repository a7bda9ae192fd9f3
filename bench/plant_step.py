"""One step of plant rigid_body with rotors: interpreted beside a bare 13-state RK4 on plain floats, and compiled.

The bare one knows thrust, torque, gravity and nothing else: no limits, no drag, no rotors, no checks, plain tuples. The
figures are the medians of alternating rounds.

    python bench/plant_step.py [ROUNDS]
"""

import math
import statistics
import sys
import time

import numba

from quad_core.compilation import compiled
from quad_core.types import CALM, Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.parameters import PlantParameters

STEPS = 1000
LIMIT = 8.0
DT = 0.002
M, G, XX, YY, ZZ = 2.064, 9.81, 0.0236, 0.0240, 0.0439
IDEAL = Vehicle(M, G, 0.246, XX, YY, ZZ, 8.54858e-6, 1.36777e-7, 0.3, 1e-3, 1.7, Layout.X)
LAGGING = IDEAL._replace(rotor_time_constant=0.04)
FULL = LAGGING._replace(rotor_inertia=1.5e-5, rotor_drag_coefficient=8.06e-5, rotor_speed_min=100.0)


def bare_rate(s, thrust, tx, ty, tz):
    """Return the derivative of (p, v, q, omega) as a plain tuple."""
    _, _, _, vx, vy, vz, x, y, z, w, p, q, r = s
    lift = thrust / M
    return (
        vx,
        vy,
        vz,
        2.0 * (x * z + w * y) * lift,
        2.0 * (y * z - w * x) * lift,
        (1.0 - 2.0 * (x * x + y * y)) * lift - G,
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
        0.5 * (-x * p - y * q - z * r),
        ((YY - ZZ) * q * r + tx) / XX,
        ((ZZ - XX) * p * r + ty) / YY,
        ((XX - YY) * p * q + tz) / ZZ,
    )


def bare_step(s, thrust, tx, ty, tz, h):
    """Return the state a step of ``h`` s later, quaternion normalised."""
    k1 = bare_rate(s, thrust, tx, ty, tz)
    k2 = bare_rate([a + 0.5 * h * b for a, b in zip(s, k1, strict=True)], thrust, tx, ty, tz)
    k3 = bare_rate([a + 0.5 * h * b for a, b in zip(s, k2, strict=True)], thrust, tx, ty, tz)
    k4 = bare_rate([a + h * b for a, b in zip(s, k3, strict=True)], thrust, tx, ty, tz)
    g = h / 6.0
    n = [a + g * (b + 2.0 * (c + d) + e) for a, b, c, d, e in zip(s, k1, k2, k3, k4, strict=True)]
    scale = 1.0 / math.sqrt(n[6] * n[6] + n[7] * n[7] + n[8] * n[8] + n[9] * n[9])
    n[6:10] = [scale * n[6], scale * n[7], scale * n[8], scale * n[9]]
    return tuple(n)


def bare():
    """Fly the bare one."""
    s = (0.0,) * 9 + (1.0, 0.0, 0.0, 0.0)
    for _ in range(STEPS):
        s = bare_step(s, M * G, 1e-3, -1e-3, 1e-4, DT)


def full(vehicle):
    """Return a flight of plant rigid_body."""

    def fly():
        parameters = PlantParameters()
        state, wrench = rigid_body.init(parameters, vehicle), Wrench(M * G, Vec3(1e-3, -1e-3, 1e-4))
        for _ in range(STEPS):
            state, _ = rigid_body.step(parameters, vehicle, state, wrench, CALM, DT)

    return fly


def compiled_step(vehicle, rounds):
    """Return the seconds of one compiled step, the least of ``rounds`` rounds."""
    step = compiled(rigid_body.step)

    @numba.njit
    def fly(parameters, state, count):
        for k in range(count):
            wrench = Wrench(M * G + 0.1 * (k % 7), Vec3(1e-3 * (k % 3 - 1), 1e-3 * (k % 5 - 2), 1e-4))
            state, _ = step(parameters, vehicle, state, wrench, CALM, DT)
        return state

    parameters = PlantParameters()
    start = rigid_body.init(parameters, vehicle)
    fly(parameters, start, 1)
    least = math.inf
    for _ in range(rounds):
        began = time.process_time()
        fly(parameters, start, 50 * STEPS)
        least = min(least, (time.process_time() - began) / (50 * STEPS))
    return least


def main():
    """Print microseconds per step and the ratios; exit code 1 if rotors that lag cost more than the limit."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    kinds = {"bare RK4": bare, "ideal rotors": full(IDEAL), "rotors that lag": full(LAGGING), "all terms": full(FULL)}
    times: dict[str, list[float]] = {name: [] for name in kinds}
    for _ in range(rounds):
        for name, fly in kinds.items():
            began = time.process_time()
            fly()
            times[name].append((time.process_time() - began) / STEPS)
    found = {name: statistics.median(values) for name, values in times.items()}
    for name, value in found.items():
        print(f"{name:16} {value * 1e6:7.2f} us a step, {value / found['bare RK4']:.2f} times the bare one")
    for name, vehicle in {"ideal rotors": IDEAL, "all terms": FULL}.items():
        print(f"{name:16} {compiled_step(vehicle, rounds) * 1e9:7.0f} ns a step compiled")
    return 0 if found["rotors that lag"] <= LIMIT * found["bare RK4"] else 1


if __name__ == "__main__":
    sys.exit(main())
