"""A package that is not ours adds a position law by entry point; it flies by name without ROS and over ROS."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

ROOT = Path(__file__).resolve().parents[1]
SETUP = """
from setuptools import setup

setup(
    name="kite-control",
    version="1.0",
    py_modules=["kite_control"],
    entry_points={"quad.position_law": ["kite = kite_control"]},
)
"""
LAW = '''
"""A PD law: what a researcher's first law looks like."""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.geometry import quaternion_from_euler
from quad_core.types import AttitudeThrust, Vec3
from quad_core.vehicle import max_thrust


class Parameters(NamedTuple):
    stiffness: Annotated[float, Real("1/s^2", "pull towards the reference", 0.1, 50.0)] = 4.0
    damping: Annotated[float, Real("1/s", "pull towards its velocity", 0.1, 50.0)] = 3.0


class Memory(NamedTuple):
    calls: float = 0.0


class Internals(NamedTuple):
    position_error: Vec3 = Vec3()
    calls: float = 0.0


def init(parameters, vehicle):
    return Memory(0.0)


def step(parameters, vehicle, memory, inputs, dt):
    state, reference = inputs.state, inputs.reference
    error = Vec3(
        state.p_w.x - reference.p_w.x, state.p_w.y - reference.p_w.y, state.p_w.z - reference.p_w.z
    )
    x = -parameters.stiffness * error.x - parameters.damping * (state.v_w.x - reference.v_w.x)
    y = -parameters.stiffness * error.y - parameters.damping * (state.v_w.y - reference.v_w.y)
    z = -parameters.stiffness * error.z - parameters.damping * (state.v_w.z - reference.v_w.z)
    g = vehicle.gravity
    thrust = vehicle.mass * (g + z)
    angles = Vec3(-y / g, x / g, 0.0)
    zero = Vec3(0.0, 0.0, 0.0)
    setpoint = AttitudeThrust(
        angles, zero, zero, quaternion_from_euler(angles), thrust, thrust / max_thrust(vehicle)
    )
    return setpoint, Memory(memory.calls + 1.0), Internals(error, memory.calls)
'''
WITHOUT_ROS = """
from quad_flight.flight import flight_from_parameters, fly

result = fly(flight_from_parameters({
    "trajectory": {"trajectory": "hover", "hover.duration": 1.0},
    "position_controller": {"law": "kite", "kite.stiffness": 5.0},
}))
calls = result.topics["position_controller/internals"]["calls"]
print(result.outcome, result.rmse < 0.3, len(calls), calls[-1])
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Install the package into a directory of its own with pip and return the environment that sees it."""
    source, target = tmp_path_factory.mktemp("kite"), tmp_path_factory.mktemp("site")
    (source / "setup.py").write_text(SETUP, encoding="utf-8")
    (source / "kite_control.py").write_text(LAW, encoding="utf-8")
    options = ["--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--target", str(target)]
    command = [sys.executable, "-m", "pip", "install", *options, str(source)]
    subprocess.run(command, check=True, timeout=120, capture_output=True)
    assert list(target.glob("kite_control*.dist-info")), "pip installed no metadata"
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(target), os.environ.get("PYTHONPATH", "")])}


def test_it_flies_by_name_without_ros(installed):
    run = subprocess.run(
        [sys.executable, "-c", WITHOUT_ROS], env=installed, capture_output=True, text=True, timeout=120, check=False
    )
    assert run.returncode == 0, run.stderr
    outcome, close, count, last = run.stdout.split()
    assert (outcome, close) == ("ended", "True")
    assert float(last) == float(count) - 1.0


def test_it_flies_by_name_over_ros(installed, tmp_path):
    bag = tmp_path / "bag"
    command = [str(ROOT / "scripts" / "fly"), "hover", "--position", "kite", "--duration", "1", "--out", str(bag)]
    # so weak a pull that the disturbance carries the vehicle metres away; its internals name no limits to be at
    command += [
        "--set",
        "position_controller.kite.stiffness=0.3",
        "--set",
        "position_controller.kite.damping=0.3",
        "--limits",
        "position_rmse=8",
    ]
    run = subprocess.run(command, env=installed, capture_output=True, text=True, timeout=240, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    flight = open_flight(bag)
    assert "kite.stiffness: 0.3" in flight.parameters_text
    internals = flight.array("position_controller/internals")
    assert np.linalg.norm(internals["position_error"], axis=1).max() > 1.0
    assert [list(extra) for extra in internals["extra"][:3]] == [[0.0], [1.0], [2.0]]
