"""How old a memory that began in flight must be to fly: errors and steps of the wrench after it takes over.

``scripts/accept warm --each N``: in the loop without ROS, at N random moments of Case 2 (by default 6), one law goes on
with a memory that has computed along for 0 to 8 s. Shown is the worst moment; the limit holds from ``WARM`` on.
"""

import os
import random
from types import ModuleType

import numpy as np
from figures import Figures

from quad_core.cascade import STAGES
from quad_flight.flight import fly, from_names
from quad_node.hot_standby import WARM

EACH = int(os.environ.get("QUAD_ACCEPT_EACH", "6"))
AGES = (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 8.0)  # s
AFTER = 2.0  # s
PERIOD = 2_000_000  # ns
DURATION = 20.0  # s of Case 2 after its approach
PRESETS = ("tuned", "minimal")
LIMIT = 0.5  # m, position_max of a good flight


def exchanged(law, period_steps, moment, age):
    """Return ``law`` as it is after ``moment`` s with a memory that began ``age`` s before."""
    changed = ModuleType(f"{law.__name__}_{moment}_{age}")
    vars(changed).update(vars(law))
    begin, end = (round(time / (PERIOD * 1e-9) / period_steps) for time in (moment - age, moment))
    count, young = 0, None

    def step(parameters, vehicle, memory, inputs, dt):
        nonlocal count, young
        if count == begin:
            young = law.init(parameters, vehicle)
        count += 1
        if young is None:
            return law.step(parameters, vehicle, memory, inputs, dt)
        output, young, internals = law.step(parameters, vehicle, young, inputs, dt)
        if count > end:
            return output, young, internals
        return law.step(parameters, vehicle, memory, inputs, dt)

    changed.step = step
    return changed


def flown(flight, role="", moment=0.0, age=0.0):
    """Return distances m from the reference and torques N m by plant step, with the law of ``role`` exchanged."""
    if role:
        stages = flight.modules.stages
        law = exchanged(getattr(stages, role), flight.resolved[role].node.period_steps, moment, age)
        flight = flight._replace(modules=flight.modules._replace(stages=stages._replace(**{role: law})))
    topics = fly(flight).topics
    truth, reference = topics["truth"], topics["reference"]
    _, ours, theirs = np.intersect1d(truth["stamp_ns"], reference["stamp_ns"], return_indices=True)
    distance = np.linalg.norm(truth["p_w"][ours] - reference["p_w"][theirs], axis=1)
    return truth["stamp_ns"][ours] * 1e-9, distance, topics["wrench_setpoint"]["torque_b"]


def after(times, distance, moment):
    """Return RMSE and largest distance in m of the ``AFTER`` s from ``moment`` on."""
    found = distance[(times >= moment) & (times < moment + AFTER)]
    return float(np.sqrt(np.mean(found**2))), float(found.max())


def torque_step(torque, moment):
    """Return the largest change of torque in N m between two steps within 50 ms of ``moment``."""
    at = round(moment / (PERIOD * 1e-9))
    return float(np.abs(np.diff(torque[at - 25 : at + 25], axis=0)).max())


def main():
    figures = Figures()
    for preset in PRESETS:
        flight = from_names("case2", preset=preset, seed=1, duration=DURATION)
        times, distance, torque = flown(flight)
        draw = random.Random(1)
        moments = [round(draw.uniform(max(AGES) + 1.0, times[-1] - AFTER), 2) for _ in range(EACH)]
        still = max(after(times, distance, moment)[0] for moment in moments)
        largest = float(np.abs(np.diff(torque, axis=0)).max())
        for role in (stage.role for stage in STAGES):
            for age in AGES:
                changed = [(moment, *flown(flight, role, moment, age)) for moment in moments]
                found = [after(when, distances, moment) for moment, when, distances, _ in changed]
                rmse, most = (max(each) for each in zip(*found, strict=True))
                step = max(torque_step(torques, moment) for moment, _, _, torques in changed)
                line = f"{preset}, {role}, memory of {age:g} s: RMSE of the 2 s after it {1e3 * rmse:.1f} mm "
                line += (
                    f"(undisturbed {1e3 * still:.1f}), at most {1e3 * most:.0f} mm, largest torque step {step:.4f} N m "
                )
                figures.check(age < WARM or most < LIMIT, f"{line} (undisturbed {largest:.4f})")
    return figures.code()
