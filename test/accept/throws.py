"""Recovery from 10,000 throws of each vehicle with AIBS and each attitude law: ``--only 'x500 se3'`` names one.

A throw has any attitude, up to 15 rad/s about any axis and up to 5 m/s in any direction, high in the air. The reference
is 2 m above the place of the throw; a throw is caught that is within 0.1 m of the reference 10 s later.
The bound on how far it gets is that of its thrust and torque, used one after the other:

    T = max_i |omega_i| J_i / tau_i + 2 sqrt(pi J_x / tau_x)      rotation stopped, then turned upright from upside down
    D = |v| T + g T^2 / 2 + (|v| + g T)^2 / (2 a)                 falling meanwhile, then braking

with a what thrust leaves beyond weight, at most what the position law asks for. The law may take 1.25 T + 0.2 s, its
command filter being 0.075 s long three times over. Nothing of the law enters the bound but its limits. Distances are
those from the reference.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.spatial.transform import Rotation

from quad_core import plugins
from quad_flight.flight import fly, from_names
from quad_flight.variation import Variation

SECONDS, FASTEST, SPIN = 10.0, 5.0, 15.0
FLOWN = {"ended", "infeasible"}
"""Outcomes of a flight to its end; whoever is thrown far off its reference is behind it for a while."""
BACK = 0.1
"""m from the reference, at the end."""
STEEPEST, TURNED = 1.49, 3.14
"""rad: the plant's first attitude is given by Euler angles, whose parameters end there."""
INITIAL = "simulator.rigid_body.initial"
NAMES = [f"{INITIAL}.{name}" for name in ("angles.phi", "angles.theta", "angles.psi")]
NAMES += [f"{INITIAL}.{vector}.{axis}" for vector in ("omega", "v") for axis in "xyz"]
CATCHES_ALL = ("abfnitsm_so3", "indi", "se3")
"""Laws that have to catch every throw; of the others the figures are shown."""
TORQUE = {"paper": (0.5, 0.5), "x500": (2.0, 0.3)}
"""Largest torque in N m about x and y, and about z: that of ``tuned``; what the rotors of an x500 have at hover."""


def throws(count):
    """Return angles in rad, body rates in rad/s and velocities in m/s, shape (count, 9); four first are upside down."""
    rng = np.random.default_rng(2026)
    found = [[TURNED, 0.0, yaw, *np.zeros(6)] for yaw in (0.0, 1.0, 2.0, 3.0)]
    while len(found) < count:
        yaw, pitch, roll = Rotation.random(random_state=rng).as_euler("ZYX")
        rates, velocity = (
            size * rng.random() * axis / np.linalg.norm(axis)
            for size, axis in zip((SPIN, FASTEST), rng.normal(size=(2, 3)), strict=True)
        )
        if abs(pitch) < STEEPEST:
            found.append([np.clip(roll, -TURNED, TURNED), pitch, np.clip(yaw, -TURNED, TURNED), *rates, *velocity])
    return np.array(found[:count])


def bound(vehicle, torque, acceleration, thrown, stretch=1.25, more=0.2):
    """Return the distance in m that each of ``thrown`` may get away: the text above."""
    inertia = np.array([vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz])
    stop = (np.abs(thrown[:, 3:6]) * inertia / [torque[0], torque[0], torque[1]]).max(axis=1)
    time = stretch * (stop + 2.0 * np.sqrt(np.pi * inertia[0] / torque[0])) + more
    speed = np.linalg.norm(thrown[:, 6:9], axis=1)
    braking = min(acceleration, (vehicle.thrust_to_weight - 1.0) * vehicle.gravity)
    return speed * time + vehicle.gravity * time**2 / 2.0 + (speed + vehicle.gravity * time) ** 2 / (2.0 * braking)


def recover(name, law, thrown):
    """Return outcomes, largest and last distances in m from the reference, and the flight thrown."""
    torque, sliding = TORQUE[name], law.startswith("abfnitsm")
    largest = {"roll": torque[0], "pitch": torque[0], "yaw": torque[1]}
    names = {axis: f"{axis}.max_torque" if sliding else f"torque.{axis}" for axis in largest}
    settings = [f"attitude_controller.{law}.{names[axis]}={value}" for axis, value in largest.items()]
    settings += ["simulator.guard.enabled=false", "simulator.disturbance=none", "trajectory.hover.start=printed"]
    settings += ["vehicle.rotor_time_constant=0.0"]
    flight = from_names("hover", attitude=law, vehicle=name, duration=SECONDS, settings=settings)
    varied = Variation(flight, NAMES)
    flights = [varied.apply(dict(zip(NAMES, map(float, row), strict=True))) for row in thrown]
    first = fly(flights[0], compiled=True, logging=False)
    with ThreadPoolExecutor(2) as pool:
        results = [first, *pool.map(lambda one: fly(one, compiled=True, logging=False), flights[1:])]
    score = np.array([[one.score.largest_error, one.score.last_error] for one in results])
    return [one.outcome for one in results], *score.T, flight


def run(figures):
    thrown = throws(figures.each(10_000))
    for name in TORQUE:
        for law in sorted(plugins.names(plugins.ATTITUDE_LAW)):
            if figures.wants(f"{name} {law}"):
                judge(figures, name, law, thrown)


def judge(figures, name, law, thrown):
    """Throw vehicle ``name`` with the attitude law ``law``."""
    outcomes, far, last, flight = recover(name, law, thrown)
    acceleration = flight.setup.stages.position_controller.limits.acceleration_z
    limits = flight.setup.vehicle, TORQUE[name], acceleration, thrown
    allowed, shortest = bound(*limits), bound(*limits, stretch=1.0, more=0.0)
    is_back, is_within = last < BACK, far <= allowed
    worst = int(np.argmax(far / allowed))
    line = (
        f"{name} {law}: {is_back.sum()} of {len(thrown)} caught, {is_within.sum()} within the bound, "
        f"{(far <= shortest).sum()} within 1.0 T + 0; the farthest {far.max():.1f} m of "
        f"{allowed[np.argmax(far)]:.1f}; worst: {far[worst]:.2f} m of {allowed[worst]:.2f}, number {worst}, "
        f"{' '.join(f'{value:.2f}' for value in thrown[worst])}"
    )
    if law in CATCHES_ALL:
        figures.check({*outcomes} <= FLOWN and is_back.all(), line)
    else:
        figures.show(line)
