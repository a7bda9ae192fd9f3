"""What was told becomes a vehicle file that a flight takes as it is."""

import math

import numpy as np
import pytest
from samples import log_of
from simulated import Truth

from quad_autopilot.thrust import signal
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_flight.flight import fly, from_names
from quad_identify.cli import main
from quad_identify.identify import identify
from quad_identify.logs import of_ours
from quad_identify.record import RecordError
from quad_identify.vehicle_file import bridge_sections, vehicle_text, vehicle_values

TRUTH = Truth()
LEVER = TRUTH.arm * math.sqrt(0.5)


@pytest.fixture(scope="module")
def result():
    return identify([log_of(TRUTH)], TRUTH.mass, (LEVER, LEVER), judge=False)


def written(result, arms, path):
    values = vehicle_values(result, arms, "x", {})
    text = vehicle_text(values, result.told("command_delay"), "test") + bridge_sections(result, values, arms)
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("curve", [0.0, 0.8])
def test_the_file_flies_unedited_and_a_bridge_hovers_at_the_true_command(curve, tmp_path):
    truth = Truth(curve=curve)
    found = identify([log_of(truth)], truth.mass, (LEVER, LEVER), judge=False)
    path = written(found, (LEVER, LEVER), tmp_path / "mine.yaml")
    flown = from_names("hover", vehicle=path, duration=3.0)
    vehicle = flown.setup.vehicle
    assert vehicle.thrust_to_weight == pytest.approx(truth.specific_thrust / 9.81, rel=0.02)
    assert vehicle.arm_length == pytest.approx(truth.arm)
    assert vehicle.inertia_yy == pytest.approx(truth.inertia[1], rel=0.05)
    assert fly(flown).outcome == "ended"
    share = 9.81 / truth.specific_thrust
    for node, airframe in (("px4_bridge", "airframe."), ("mavlink_bridge", ""), ("crazyflie_bridge", "")):
        own = overrides_for([read_parameter_file(tmp_path / "mine.yaml")], node)
        assert own[f"{airframe}thrust_curve"] == pytest.approx(curve, abs=0.1)
        largest = own[f"{airframe}max_rotor_thrust"]
        command = signal(0.25 * truth.mass * 9.81 / largest, own[f"{airframe}thrust_curve"])
        assert curve * command**2 + (1.0 - curve) * command == pytest.approx(share, rel=0.03)


@pytest.fixture(scope="module")
def own_flight():
    """Return (name, value) of a vehicle and what a flight of ``identify`` tells of it, late and noisy as outdoors."""
    noise = ["position_noise=0.01", "velocity_noise=0.02", "attitude_noise=3.4907e-3", "rate_noise=8.7266e-3"]
    late = ["sensor.delay=0.01", "disturbance=timeline", "timeline.events=link delay=0.008"]
    settings = [f"simulator.{text}" for text in (*(f"sensor.{each}" for each in noise), *late)]
    flight = from_names(
        "identify",
        vehicle="x500",
        preset="x500",
        duration=15.0,
        settings=[*settings, "vehicle.rotor_time_constant=0.04"],
    )
    flown = fly(flight)
    assert flown.outcome == "ended"
    vehicle = flight.setup.vehicle
    lever = vehicle.arm_length * math.sqrt(0.5)
    state, command = flown.topics["state"], flown.topics["wrench_setpoint"]
    wrench = np.column_stack([command["thrust"], command["torque_b"]])
    log = of_ours(state, command["stamp_ns"] * 1e-9, wrench, vehicle)
    return vehicle, identify([log], vehicle.mass, (lever, lever), judge=False), lever


def test_a_flight_of_the_manoeuvre_tells_the_vehicle(own_flight):
    vehicle, result, _ = own_flight
    assert result.told("specific_thrust") == pytest.approx(vehicle.thrust_to_weight * 9.81, rel=0.02)
    assert result.told("rotor_time_constant") == pytest.approx(0.04, abs=0.003)
    assert result.told("command_delay") == pytest.approx(0.008, abs=0.002)
    for axis in ("xx", "yy", "zz"):
        assert result.told(f"inertia_{axis}") == pytest.approx(getattr(vehicle, f"inertia_{axis}"), rel=0.05)
    assert not result.parameters["velocity_age"].told


def test_the_identified_file_hovers_at_the_command_of_the_true_vehicle(own_flight, tmp_path):
    _, result, lever = own_flight
    shares = []
    for name in ("x500", written(result, (lever, lever), tmp_path / "mine.yaml")):
        flight = from_names("hover", vehicle=name, preset="x500", duration=2.0)
        vehicle = flight.setup.vehicle
        thrust = fly(flight).topics["wrench_setpoint"]["thrust"][-100:].mean()
        shares.append(math.sqrt(thrust / (vehicle.thrust_to_weight * vehicle.mass * vehicle.gravity)))
    assert shares[1] == pytest.approx(shares[0], rel=0.03)


def test_arms_of_two_lengths_keep_the_rotation(result):
    values = vehicle_values(result, (LEVER, 2.0 * LEVER), "x", {})
    arm = values["arm_length"][0] * math.sqrt(0.5)
    assert values["mass"][0] * arm / values["inertia_yy"][0] == pytest.approx(
        TRUTH.mass * LEVER / TRUTH.inertia[1], rel=0.05
    )


def test_what_is_not_told_is_named_or_taken_from_a_prior():
    slow = identify([log_of(TRUTH, every=10, motors_every=10)], TRUTH.mass, (LEVER, LEVER), judge=False)
    with pytest.raises(RecordError, match="inertia_xx: rotation needs motors and gyro at 250 Hz and more, found 100"):
        vehicle_values(slow, (LEVER, LEVER), "x", {})
    prior = {"inertia_xx": 2e-3, "inertia_yy": 2e-3, "thrust_to_weight": 2.0}
    prior |= {"lift_coefficient": 1e-8, "torque_coefficient": 2e-10}
    found = vehicle_values(slow, (LEVER, LEVER), "x", prior)
    assert found["inertia_xx"] == (2e-3, "prior")
    assert found["torque_coefficient"][0] / found["lift_coefficient"][0] == pytest.approx(0.02)


def test_the_manoeuvre_is_a_file_of_set_points_that_begins_at_rest(tmp_path):
    path = tmp_path / "manoeuvre.csv"
    assert main(["--set-points", str(path)]) == 0
    header, *lines = path.read_text().splitlines()
    assert header == "t,x,y,z,vx,vy,vz,ax,ay,az,yaw"
    rows = np.array([[float(part) for part in line.split(",")] for line in lines])
    assert rows[0, 1:10] == pytest.approx([0.0, 0.0, 2.0, *[0.0] * 6], abs=1e-6)
    moved, expected = np.diff(rows[:, 1:4], axis=0) / 0.02, 0.5 * (rows[1:, 4:7] + rows[:-1, 4:7])
    assert moved == pytest.approx(expected, abs=2e-3)
    assert rows[-1, 0] < 65.0


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ([], "LOG: found none, expected at least one log"),
        (["nothing.ulg"], "nothing.ulg: No such file"),
        (["x", "--mass", "0"], "--mass: found 0, expected 0.001 to 1000 kg"),
        (["x", "--arms", "1,2,3"], "--arms: found '1,2,3', expected one or two lengths"),
        (["x", "--curve", "2"], "--curve: found 2, expected 0 to 1"),
        (["x", "--prior", "no.yaml"], "no.yaml: cannot be read"),
    ],
)
def test_bad_usage_ends_in_one_line(arguments, problem, capsys):
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert problem in said
    assert said.count("\n") == 1
