"""What was told becomes a vehicle file that a flight takes as it is."""

import math

import pytest
from samples import log_of
from simulated import Truth

from quad_flight.flight import fly, from_names
from quad_identify.cli import main
from quad_identify.identify import identify
from quad_identify.record import RecordError
from quad_identify.vehicle_file import vehicle_text, vehicle_values

TRUTH = Truth()
LEVER = TRUTH.arm * math.sqrt(0.5)


@pytest.fixture(scope="module")
def result():
    return identify([log_of(TRUTH)], TRUTH.mass, (LEVER, LEVER), judge=False)


def test_the_file_flies_and_hovers_at_the_true_command(result, tmp_path):
    values = vehicle_values(result, (LEVER, LEVER), "x", {})
    path = tmp_path / "mine.yaml"
    path.write_text(vehicle_text(values, result.told("command_delay"), "test"))
    flown = from_names("hover", vehicle=str(path), duration=3.0)
    vehicle = flown.setup.vehicle
    assert vehicle.thrust_to_weight == pytest.approx(TRUTH.specific_thrust / 9.81, rel=0.02)
    assert vehicle.arm_length == pytest.approx(TRUTH.arm)
    assert vehicle.inertia_yy == pytest.approx(TRUTH.inertia[1], rel=0.05)
    assert fly(flown).outcome == "ended"


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
    assert vehicle_values(slow, (LEVER, LEVER), "x", prior)["inertia_xx"] == (2e-3, "prior")


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["nothing.ulg"], "nothing.ulg: No such file"),
        (["x", "--mass", "0"], "--mass: found 0, expected 0.001 to 1000 kg"),
        (["x", "--arms", "1,2,3"], "--arms: found '1,2,3', expected one or two lengths"),
        (["x", "--curve", "2"], "--curve: found 2, expected 0 to 1"),
    ],
)
def test_bad_usage_ends_in_one_line(arguments, problem, capsys):
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert problem in said
    assert said.count("\n") == 1
