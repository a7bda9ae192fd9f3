"""check_plant: simulator, MuJoCo and the vehicle of the examples are kept, another vehicle is named, none ends it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from flying import ROOT

from quad_bringup.surroundings import reserved_domain

pytestmark = pytest.mark.flight

ROLES = ["--ros-args", "-p", "flight.roles:=simulator,attitude_controller"]
REAL_TIME = ["-p", "flight.mode:=realtime", "-p", "flight.plant_period:=10000000"]
PROGRAMS = Path(get_package_prefix("quad_dynamics"), "lib", "quad_dynamics")
CHECK = [PROGRAMS / "check_plant"]
EXAMPLE = [sys.executable, ROOT / "examples/own_nodes/vehicle.py", *ROLES]


def simulator(*words):
    return [PROGRAMS / "simulator", *ROLES, "-p", "disturbance:=none", *words]


def said(*words):
    return subprocess.run([*CHECK, *words], capture_output=True, text=True, timeout=120, check=False)


def checked(vehicle, *both):
    """Return how the check of the vehicle that a command starts ended; ``both``: words for either."""
    with reserved_domain(None) as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        process = subprocess.Popen([*vehicle, *both], env=dict(os.environ), stderr=subprocess.DEVNULL)
        try:
            return said(*ROLES[:1], *both)
        finally:
            process.kill()
            process.wait()


@pytest.mark.parametrize(("vehicle", "both"), [
    pytest.param(simulator(), ["-p", "flight.run_id:=check"], id="simulator"),
    pytest.param(simulator(), REAL_TIME, id="simulator_real_time", marks=pytest.mark.wall_clock),
    pytest.param(simulator("-p", "plant:=mujoco"), [], id="mujoco"),
    pytest.param(EXAMPLE, [], id="example"),
    pytest.param(EXAMPLE, REAL_TIME, id="example_real_time", marks=pytest.mark.wall_clock),
])  # fmt: skip
def test_a_vehicle_of_the_stack_is_kept(vehicle, both):
    done = checked(vehicle, *both)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "ok    a silent controller ends the flight as FAILED, named" in done.stdout
    assert done.stdout.splitlines()[-1] == "20 of 20 kept"


SLOW = """
import time
from quad_dynamics import check_plant
answer = check_plant.PlantCheck.step
check_plant.PlantCheck.step = lambda *given: (time.sleep(0.01), answer(*given))
check_plant._ANSWER = 0.9
check_plant.main()
"""


def test_a_vehicle_on_a_busy_machine_is_judged_by_the_clock_of_its_flight(monkeypatch):
    monkeypatch.setattr("test_check_plant.CHECK", [sys.executable, "-c", SLOW])  # 1.5 s for a climb
    done = checked(simulator())
    assert done.stdout.splitlines()[-1] == "20 of 20 kept", done.stdout + done.stderr


def test_a_plant_with_another_inertia_and_mass_is_found_out():
    done = checked(simulator("-p", "vehicle.inertia_zz:=0.0005", "-p", "vehicle.mass:=1.7"))
    assert done.returncode == 1, done.stdout + done.stderr
    broken = [line.split(":")[0] for line in done.stdout.splitlines() if line.startswith("FAIL")]
    assert "FAIL  climb" in broken
    assert "FAIL  torque +z" in broken
    assert "FAIL  torque +y" not in broken


def test_without_a_vehicle_the_check_ends():
    done = checked([sys.executable, "-c", ""], "-p", "flight.start_timeout:=3.0")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "FAIL  the vehicle sends its first state once all are READY: not within 3 s" in done.stdout


def test_help():
    shown = said("--help")
    assert shown.returncode == 0
    assert "usage: ros2 run quad_dynamics check_plant" in shown.stdout
