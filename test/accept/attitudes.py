"""Recovery of abfnitsm_so3 from 1,000 attitudes at up to 15 rad/s, and steps of pitch 90 and roll 180 deg."""

import sys

import numpy as np
from figures import Figures

from quad_attitude_ctrl import abfnitsm, abfnitsm_so3, se3
from quad_core.compilation import compiled
from quad_core.cycle import pushed
from quad_core.geometry import ZERO, body_z, quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Quat, Rotors, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body

ATTITUDES, FASTEST, SECONDS, DT = 1000, 15.0, 4.0, 0.002
CLOSE, SLOW = 0.087, 0.5
"""5 degrees; rad/s."""
NOTHING = Actuation(
    Rotors(0.0, 0.0, 0.0, 0.0), Rotors(0.0, 0.0, 0.0, 0.0), 0.0, ZERO, False, False, False, False, False
)


def flown(law, step, preset="tuned"):
    """Return the compiled flight of a law: from attitude and rates to (angle, rate, arrival, torque variation)."""
    plant_step, plant, law_init, parameters = (
        rigid_body.step,
        rigid_body.Parameters(),
        law.init,
        build(law.Parameters, law.PRESETS[preset] if preset != "tuned" else {}),
    )
    vehicle, speed = Vehicle(), 18.0
    state_class, first = rigid_body.State, law_init(parameters, vehicle)
    machine, plant_machine, turned, calm, up = (
        compiled(function) for function in (law.step, plant_step, quaternion_from_euler, pushed, body_z)
    )

    def fly(q, omega, goal, steps):
        state = state_class(VehicleState(ZERO, ZERO, q, omega), Rotors(speed, speed, speed, speed))
        memory, actuation, conditions = first, NOTHING, calm(ZERO, ZERO)
        setpoint = AttitudeThrust(goal, ZERO, ZERO, turned(goal), 5.488, 0.33)
        wanted = up(turned(goal))
        arrival, before, variation, angle = 0.0, ZERO, 0.0, 0.0
        for k in range(steps):
            wrench, memory, _ = machine(
                parameters, vehicle, memory, AttitudeInputs(state.motion, setpoint, actuation), DT
            )
            torque = wrench.torque_b
            variation += abs(torque.x - before.x) + abs(torque.y - before.y) + abs(torque.z - before.z)
            before = torque
            state, actuation = plant_machine(plant, vehicle, state, wrench, conditions, DT)
            axis = up(state.motion.q_wb)
            cosine = axis.x * wanted.x + axis.y * wanted.y + axis.z * wanted.z
            angle = np.arccos(min(max(cosine, -1.0), 1.0))
            if not angle < CLOSE:
                arrival = (k + 1) * DT
        w = state.motion.omega_b
        return angle, np.sqrt(w.x * w.x + w.y * w.y + w.z * w.z), arrival, variation

    return step(fly)


def starts():
    """Return attitudes and body rates: any at all, the first ones exactly upside down about several axes."""
    rng = np.random.default_rng(2026)
    sides = [(1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.6, 0.8, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0)]
    for number in range(ATTITUDES):
        q = np.array(sides[number]) if number < len(sides) else rng.normal(size=4)
        direction = rng.normal(size=3)
        rate = 0.0 if number < len(sides) else FASTEST * rng.random()
        omega = rate * direction / np.linalg.norm(direction)
        yield Quat(*map(float, q / np.linalg.norm(q))), Vec3(*map(float, omega))


def main():
    import numba

    figures = Figures()
    flights = {law.__name__.rpartition(".")[2]: flown(law, numba.njit) for law in (abfnitsm_so3, abfnitsm, se3)}
    level = Vec3(0.0, 0.0, 0.0)
    for name, fly in flights.items():
        ends = [fly(q, omega, level, round(SECONDS / DT)) for q, omega in starts()]
        good = sum(angle < CLOSE and rate < SLOW for angle, rate, _, _ in ends)
        finite = all(np.isfinite(end).all() for end in ends)
        slowest = max(arrival for _, _, arrival, _ in ends)
        text = f"{name}: {good} of {ATTITUDES} level within {SECONDS:g} s, the slowest after {slowest:.2f} s"
        if name == "abfnitsm_so3":
            figures.check(good == ATTITUDES and finite, text)
        else:
            print(f"     {text}")
    upright, still = Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0)
    for law in (abfnitsm_so3, abfnitsm):
        flights[f"{law.__name__.rpartition('.')[2]}, agile"] = flown(law, numba.njit, "agile")
    for what, goal in (
        ("pitch 90", Vec3(0.0, np.pi / 2, 0.0)),
        ("roll 180", Vec3(np.pi, 0.0, 0.0)),
        ("pitch 60", Vec3(0.0, np.pi / 3, 0.0)),
    ):
        for name, fly in flights.items():
            angle, _, arrival, variation = fly(upright, still, goal, 1000)
            text = (
                f"step to {what} deg, {name}: within 5 deg after {arrival:.3f} s, torque variation {variation:.1f} N m"
            )
            limit = {("abfnitsm_so3, agile", "roll 180"): 0.4, ("abfnitsm, agile", "pitch 60"): 0.25}.get(
                (name, what), 1.0
            )
            if name.startswith("abfnitsm_so3") or limit < 1.0:
                figures.check(angle < CLOSE and arrival <= limit, text)
            else:
                print(f"     {text}")
    return figures.code()


if __name__ == "__main__":
    sys.exit(main())
