"""What gains lose that are tuned on an identified file: three vehicles, six sampler seeds each, held-out seeds.

Each vehicle flies the manoeuvre and is identified. The tutorial's plan tunes on the identified file and on the true
one, by the same sampler seeds. Gains and file of both are flown on the true vehicle: a law knows the file alone.
"""

import math
import re
import sys
from pathlib import Path

import numpy as np
import yaml
from scipy.stats import t as student

from quad_flight.flight import fly, from_names
from quad_identify.identify import identify
from quad_identify.logs import of_ours
from quad_identify.vehicle_file import vehicle_text, vehicle_values

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "studies"))
from study_plan import read_plan  # noqa: E402
from tune import cost, tune  # noqa: E402

TUTORIAL = ROOT / "docs" / "tutorials" / "your_vehicle.md"
MOST_LOST = 0.10
HELD_OUT = tuple(range(1001, 1011))
CALM = ["disturbance=none"]
NOISE = [
    "sensor.delay=0.01",
    "sensor.position_noise=0.01",
    "sensor.velocity_noise=0.02",
    "sensor.attitude_noise=3.4907e-3",
    "sensor.rate_noise=8.7266e-3",
]
HEAVY = {"mass": 2.6, "inertia_xx": 0.035, "inertia_yy": 0.03, "inertia_zz": 0.055, "rotor_time_constant": 0.04}
VEHICLES = {
    "x500 of the tutorial": ("x500", "x500", {}, CALM),
    "x500 with load and slow rotors, late and noisy log": ("x500", "x500", HEAVY, CALM + NOISE),
    "Crazyflie 2.1, late and noisy log": ("crazyflie21", "crazyflie21_real", {}, CALM + NOISE),
}
REFERENCE_INERTIA = 0.02362  # kg m^2: of the vehicle that the tutorial's plan is for


def run(figures):
    """Identify, tune and judge."""
    for name, (shipped, preset, changed, settings) in VEHICLES.items():
        if figures.wants(name):
            judge(figures, name, shipped, preset, changed, settings)


def judge(figures, name, shipped, preset, changed, settings):
    """Print what gains and file of the identified vehicle lose on the true one."""
    vehicle = {f"vehicle.{key}": value for key, value in changed.items()}
    asked = [f"simulator.{text}" for text in settings] + [f"{key}={value}" for key, value in vehicle.items()]
    path = figures.folder / f"{shipped}{len(changed)}.yaml"
    truth, found = identified(path, from_names("identify", vehicle=shipped, preset=preset, settings=asked))
    true = {"vehicle": shipped, "/**": vehicle}
    behind = {"vehicle": str(path), "/**": unseen(truth, found), "simulator": errors(truth, found)}
    costs, scale = {}, truth.inertia_xx / REFERENCE_INERTIA
    for kind, tuned_on, flown_on in (("true", true, true), ("identified", {"vehicle": str(path)}, behind)):
        plan = plan_of(figures.folder / f"{path.stem}-{kind}.yaml", tuned_on, scale)
        judged = plan_of(figures.folder / f"{path.stem}-{kind}-judged.yaml", flown_on, scale)
        (body,) = plan.controllers
        held_out = judged.tuning._replace(seeds=HELD_OUT)
        for number in range(1, figures.each(6) + 1):
            best = tune(body, plan.tuning, number, figures.folder / f"{path.stem}-{kind}.{number}", threads=1).best
            costs.setdefault(kind, []).append(cost(body, best.values, held_out, threads=1).cost)
    mine, theirs = np.array(costs["identified"]), np.array(costs["true"])
    lost = mine / theirs - 1.0
    half = student.ppf(0.975, len(lost) - 1) * lost.std(ddof=1) / math.sqrt(len(lost))
    low, high = 100.0 * (lost.mean() - half), 100.0 * (lost.mean() + half)
    luck = 100.0 * (theirs.max() / theirs.min() - 1.0)
    line = f"{name}: {len(lost)} tunings lose {100.0 * lost.mean():.2f} % [{low:.2f}, {high:.2f}] on the true vehicle"
    figures.check(high <= 100.0 * MOST_LOST, f"{line}, at most {100.0 * MOST_LOST:g} %")
    apart = f"best and worst on the true file are {luck:.2f} % apart"
    figures.show(f"cost {mine.mean():.4f} for {theirs.mean():.4f}; {apart}")


def identified(path, flight):
    """Fly the manoeuvre and write the file at ``path``; return the true vehicle and the one that the file means."""
    flown, vehicle = fly(flight), flight.setup.vehicle
    lever = vehicle.arm_length * math.sqrt(0.5)
    command = flown.topics["wrench_setpoint"]
    wrench = np.column_stack([command["thrust"], command["torque_b"]])
    log = of_ours(flown.topics["state"], command["stamp_ns"] * 1e-9, wrench, vehicle)
    result = identify([log], vehicle.mass, (lever, lever), judge=False)
    path.write_text(vehicle_text(vehicle_values(result, (lever, lever), "x", {}), None, "identified"))
    return vehicle, from_names("hover", vehicle=str(path)).setup.vehicle


def unseen(truth, found):
    """Return the vehicle's parameters that no file has and no law takes, at the speeds that the file assumes."""
    faster = math.sqrt(truth.lift_coefficient / found.lift_coefficient)
    powers = {"rotor_speed_min": 1, "rotor_inertia": -1, "rotor_drag_coefficient": -1, "drag_torque_coefficient": 0}
    return {f"vehicle.{key}": getattr(truth, key) * faster**power for key, power in powers.items()}


def errors(truth, found):
    """Return the plant's parameters that make it the true vehicle behind a law that knows the file."""
    thrust = truth.thrust_to_weight / found.thrust_to_weight
    turn = [one.torque_coefficient / one.lift_coefficient for one in (truth, found)]
    off = {f"inertia_error.{axis}": f"inertia_{axis}" for axis in ("xx", "yy", "zz")}
    off |= {"drag_error": "drag_coefficient", "lag_error": "rotor_time_constant"}
    out = {name: getattr(truth, key) - getattr(found, key) for name, key in off.items()}
    out |= {f"effectiveness.{each}": thrust for each in ("thrust", "roll", "pitch")}
    out["effectiveness.yaw"] = thrust * turn[0] / turn[1]
    return {f"rigid_body.{name}": value for name, value in out.items()}


def plan_of(path, condition, inertia):
    """Return the tutorial's plan under ``condition``, its torques times ``inertia`` over that of its vehicle."""
    content = yaml.safe_load(re.search(r"```yaml\n(.*?)```", TUTORIAL.read_text(encoding="utf-8"), re.DOTALL)[1])
    content["tuning"]["conditions"] = {"mine": condition}
    content["tuning"]["objective"]["variation_scale"] *= inertia
    fixed = content["controllers"]["pid"]["fixed"]["attitude_controller"]
    fixed.update({key: value * inertia for key, value in fixed.items()})
    path.write_text(yaml.safe_dump(content))
    return read_plan(path)
