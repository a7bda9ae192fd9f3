"""100,000 random plans of all trajectories: none outside its limits, none over 1 s, none refused without need.

Compiled code plans them; every 20th is planned by CPython as well, which has to say the same to the bit and is timed.
"""

import math
import os
import random
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
from figures import Figures

from quad_core.compilation import compiled
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Vec3, VehicleState
from quad_core.vehicle import Vehicle, max_thrust
from quad_trajectory import case1, case2, hover, lemniscate, waypoints
from quad_trajectory.approach import Approach, sample_approach
from quad_trajectory.limits import MotionLimits
from quad_trajectory.waypoints import along

PLANS = 100_000
BLOCK = 500
MODULES = (case1, case2, hover, lemniscate, waypoints)
SAMPLES, EVERY = 600, 20
SLOWEST, BEYOND = 1.0, 5.0
TOLERANCE = 1.0 + 1e-9
VEHICLE = Vehicle()
MIN_THRUST = 0.2
PLANT_PERIOD = 0.002  # s


class Report(NamedTuple):
    """Of a block: seeds outside limits, largest ratio to one, slowest s, reasons of refusal, seeds that differ."""

    outside: list[int]
    worst: float
    slowest: float
    refused: Counter
    different: list[int]


def main():
    figures = Figures()
    outside, worst, slowest, refused, different = [], 0.0, 0.0, Counter(), []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for report in pool.map(block, range(0, PLANS, BLOCK)):
            outside += report.outside
            worst, slowest = max(worst, report.worst), max(slowest, report.slowest)
            refused += report.refused
            different += report.different
    figures.check(not outside, f"{len(outside)} of {PLANS} plans outside their limits, seeds {outside[:10]}")
    print(f"     largest share of a limit in use: {worst:.6f}")
    figures.check(not different, f"{len(different)} plans differ between CPython and compiled {different[:10]}")
    figures.at_most("slowest plan, CPU time in CPython", slowest, SLOWEST, "s")
    for reason, count in refused.items():
        print(f"     {count} refused: {reason}")
    needless = sum(count for reason, count in refused.items() if reason.startswith("WITHOUT NEED"))
    figures.check(
        not needless,
        f"{needless} refused whose curve begins within {BEYOND:g} times its limit of jerk and stays "
        "within that of acceleration for a plant step",
    )
    return figures.code()


def block(first):
    """Plan BLOCK flights from seed ``first`` on."""
    approach_ratio, path_ratio = compiled(approach_use), compiled(path_use)
    outside, worst, slowest, refused, different = [], 0.0, 0.0, Counter(), []
    for seed in range(first, first + BLOCK):
        module, parameters, start = flight(seed)
        plan, refusal = planned(compiled(module.plan), parameters, start)
        if seed % EVERY == seed // EVERY % EVERY:
            began = time.process_time()
            other, other_refusal = planned(module.plan, parameters, start)
            slowest = max(slowest, time.process_time() - began)
            if refusal != other_refusal or not same(plan, other):
                different.append(seed)
        if refusal:
            refused[refusal if needs_refusal(module, parameters) else f"WITHOUT NEED: {refusal}"] += 1
            continue
        approach = plan.approach if module is waypoints else plan
        onto = module.sample(parameters, plan, approach.duration)
        used = approach_ratio(approach, parameters.limits, start, onto.v_w, onto.a_w, onto.jerk_w)
        if module is waypoints:
            max_lift = parameters.thrust * max_thrust(VEHICLE) / VEHICLE.mass
            tangent = math.tan(parameters.tilt)
            used = max(
                used, path_ratio(plan.path, plan.duration, parameters.speed, max_lift, tangent, parameters.body_rate)
            )
        if not used <= TOLERANCE:
            outside.append(seed)
        worst = max(worst, used)
    return Report(outside, worst, slowest, refused, different)


def planned(plan, parameters, start):
    """Return the plan and the reason why there is none; one of them is empty."""
    try:
        return plan(parameters, VEHICLE, start), ""
    except ValueError as error:
        return None, str(error)


def needs_refusal(module, parameters):
    """Return whether a curve begins far outside its limits: lemniscates of any speed and size are drawn.

    Its first jerk is far beyond the limit of jerk, or leaves the limit of acceleration within one plant step.
    """
    if module is not lemniscate:
        return False
    jerk, limits = length(lemniscate.curve(parameters, 0.0).jerk_w), parameters.limits
    return jerk > BEYOND * limits.jerk or jerk * PLANT_PERIOD > limits.acceleration


def same(plan, other):
    """Return whether two plans, or parts of them, are equal to the bit."""
    if isinstance(plan, tuple):
        return all(same(mine, theirs) for mine, theirs in zip(plan, other, strict=True))
    return bool(np.all(plan == other))


def flight(seed):
    """Return trajectory, parameters and start of a random flight."""
    rng = random.Random(seed)

    def spread(low, high):
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    def vector(size):
        return Vec3(*(rng.uniform(-size, size) for _ in range(3)))

    module = MODULES[seed % len(MODULES)]
    limits = MotionLimits(
        spread(0.05, 50.0),
        spread(0.05, 50.0),
        spread(0.05, 50.0),
        spread(0.02, 1.3),
        spread(0.1, 5.0),
        spread(0.1, 9.0),
    )
    fields = {"limits": limits}
    if module in (case1, case2):
        fields |= {"position_scale": spread(0.01, 10.0), "time_scale": spread(0.1, 20.0)}
    elif module is hover:
        fields |= {"position": hover.Position(*vector(100.0)), "yaw": rng.uniform(-6.0, 6.0)}
    elif module is lemniscate:
        fields |= {"speed": spread(0.1, 20.0), "half_width": spread(0.5, 50.0), "inclination": rng.uniform(-1.5, 1.5)}
    else:
        extent = spread(0.5, 100.0)
        points = [vector(extent) for _ in range(rng.randint(2, 12))]
        text = ";".join(f"{p.x:.4f} {p.y:.4f} {p.z:.4f} {rng.uniform(-3.0, 3.0):.4f}" for p in points)
        fields |= {"points": text, "speed": spread(0.2, 30.0), "thrust": rng.uniform(0.4, 1.0)}
        fields |= {"tilt": rng.uniform(0.05, 1.3), "body_rate": spread(0.1, 20.0)}
    if rng.random() < 0.1:
        fields.pop("limits")
    velocity = Vec3() if rng.random() < 0.5 else vector(15.0)
    angles = Vec3(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(-math.pi, math.pi))
    start = VehicleState(vector(200.0), velocity, quaternion_from_euler(angles), Vec3(0.0, 0.0, 0.0))
    return module, module.Parameters(**fields), start


def length(v: Vec3) -> float:
    return math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z)


def approach_use(
    approach: Approach, limits: MotionLimits, start: VehicleState, v_w: Vec3, a_w: Vec3, jerk_w: Vec3
) -> float:
    """Return the largest share of a limit that an approach onto (v, a, jerk) uses: sampled in each of its segments."""
    gravity = 9.8
    speed = max(limits.speed, 1.25 * length(start.v_w), 1.25 * length(v_w))
    acceleration = max(limits.acceleration, 1.25 * length(a_w))
    jerk = max(limits.jerk, 1.25 * length(jerk_w))
    tangent = math.sqrt(a_w.x * a_w.x + a_w.y * a_w.y) / max(gravity + a_w.z, 0.1 * gravity)
    tangent = max(math.tan(limits.tilt), 1.25 * tangent)
    used = 0.0
    begin = 0.0
    for duration in (approach.transit.duration, approach.run_up.duration, approach.settle.duration):
        for i in range(SAMPLES):
            point = sample_approach(approach, begin + duration * i / SAMPLES)
            used = max(used, length(point.v_w) / speed)
            used = max(used, length(point.a_w) / acceleration)
            used = max(used, length(point.jerk_w) / jerk)
            force = max(gravity + point.a_w.z, 1e-9)
            used = max(used, math.sqrt(point.a_w.x * point.a_w.x + point.a_w.y * point.a_w.y) / (tangent * force))
            used = max(used, abs(point.yaw_rate) / limits.yaw_rate)
            used = max(used, abs(point.yaw_acceleration) / limits.yaw_acceleration)
        begin += duration
    return used


def path_use(path, duration, speed, max_lift, tangent, rate):
    """Return the largest share of a limit that the path of waypoints uses."""
    gravity = 9.8
    used = 0.0
    for segment in range(len(path)):
        for i in range(SAMPLES):
            point = along(path, path[segment, 0] + path[segment, 1] * i / SAMPLES)
            a, jerk = point.a_w, point.jerk_w
            up = a.z + gravity
            cross = Vec3(a.y * jerk.z - up * jerk.y, up * jerk.x - a.x * jerk.z, a.x * jerk.y - a.y * jerk.x)
            force2 = a.x * a.x + a.y * a.y + up * up
            used = max(used, length(point.v_w) / speed)
            used = max(used, math.sqrt(force2) / max_lift)
            used = max(used, math.sqrt(a.x * a.x + a.y * a.y) / (tangent * max(up, 1e-9)))
            used = max(used, length(cross) / force2 / rate)
            used = max(used, MIN_THRUST * gravity / max(up, 1e-9))
    return used
