"""check_plant against the simulator: kept in both modes, broken when the plant is another vehicle."""

import os
import subprocess
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

from quad_bringup.domains import reserved_domain

pytestmark = pytest.mark.flight

ROLES = "simulator,attitude_controller"


def check(plant, *both, package="quad_dynamics"):
    with reserved_domain(None) as domain:
        return check_in(domain, package, plant, *both)


def check_in(domain, package, plant, *both):
    folder = Path(get_package_prefix("quad_dynamics"), "lib", "quad_dynamics")
    simulator = Path(get_package_prefix(package), "lib", package, "simulator")
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    start = [simulator, "--ros-args", "-p", f"flight.roles:={ROLES}", "-p", "disturbance:=none"]
    process = subprocess.Popen([*start, *plant, *both], env=environment, stderr=subprocess.DEVNULL)
    try:
        return subprocess.run(
            [f"{folder}/check_plant", "--ros-args", *both],
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    finally:
        process.kill()
        process.wait()


def test_the_simulator_keeps_the_contract_in_lockstep():
    done = check([], "-p", "flight.run_id:=check")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "ok    run of state and actuation is the CRC-32 of flight.run_id" in done.stdout
    assert not [line for line in done.stdout.splitlines() if line.startswith("FAIL")]
    assert "a command that is not finite is ignored" in done.stdout


def test_mujoco_started_in_its_place_keeps_it_too():
    done = check([], package="quad_mujoco")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.wall_clock
def test_the_simulator_keeps_the_contract_in_real_time():
    done = check([], "-p", "flight.mode:=realtime", "-p", "flight.plant_period:=10000000")
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_plant_with_another_inertia_and_mass_is_found_out():
    done = check(["-p", "vehicle.inertia_zz:=0.0005", "-p", "vehicle.mass:=1.7"])
    assert done.returncode == 1, done.stdout + done.stderr
    broken = [line.split(":")[0] for line in done.stdout.splitlines() if line.startswith("FAIL")]
    assert "FAIL  climb" in broken
    assert "FAIL  torque +z" in broken
    assert "FAIL  torque +y" not in broken


def test_help_and_bad_usage():
    folder = Path(get_package_prefix("quad_dynamics"), "lib", "quad_dynamics")
    shown = subprocess.run([f"{folder}/check_plant", "--help"], capture_output=True, text=True, check=False)
    assert shown.returncode == 0
    assert "usage: ros2 run quad_dynamics check_plant" in shown.stdout
    wrong = subprocess.run(
        [f"{folder}/check_plant", "--ros-args", "-p", "wings:=2"], capture_output=True, text=True, check=False
    )
    assert wrong.returncode == 2
    assert "wings" in wrong.stderr
