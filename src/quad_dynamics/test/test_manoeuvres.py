"""What check_plant expects of a plant, found on states written by hand."""

import math

import pytest

from quad_core.types import Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_dynamics.manoeuvres import manoeuvres, report

VEHICLE = Vehicle(mass=2.0, gravity=10.0, inertia_xx=0.01, inertia_yy=0.02, inertia_zz=0.03)
BY_NAME = {part.name: part for part in manoeuvres(VEHICLE)}


def tilted(axis, angle, v=(0.0, 0.0, 0.0)):
    parts = [0.0, 0.0, 0.0, math.cos(angle / 2)]
    parts[axis] = math.sin(angle / 2)
    return VehicleState(v_w=Vec3(*v), q_wb=Quat(*parts))


def test_wrenches_are_those_of_the_nominal_vehicle():
    assert BY_NAME["hover"].wrench == (20.0, (0.0, 0.0, 0.0))
    assert BY_NAME["climb"].wrench.thrust == pytest.approx(24.0)
    assert BY_NAME["torque +z"].wrench.torque_b == pytest.approx((0.0, 0.0, 0.03 * 0.4 / 0.12))
    impulse = [sum(part.duration * part.wrench.torque_b[axis] for part in BY_NAME.values()) for axis in range(3)]
    assert impulse == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)


@pytest.mark.parametrize(("climb", "kept"), [(0.6, True), (-0.6, False), (1.8, False), (0.0, False)])
def test_thrust_must_lift(climb, kept):
    # 0.2 g over 0.3 s is 0.6 m/s
    found = BY_NAME["climb"].problem(VehicleState(), VehicleState(v_w=Vec3(0.0, 0.0, climb)))
    assert (found == "") is kept
    assert kept or "z up" in found


def test_a_broken_rule_says_what_was_found_and_expected():
    still = VehicleState()
    assert BY_NAME["climb"].problem(still, still) == "change of v_w.z in m/s (z up): found 0, expected 0.18 to 1.02"
    assert BY_NAME["hover"].problem(still, still) == ""


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("factor", "kept"), [(1.0, True), (0.5, True), (-1.0, False), (10.0, False)])
def test_torque_must_turn_the_right_way(axis, factor, kept):
    rates = [0.0, 0.0, 0.0]
    rates[axis] = factor * 0.4
    found = BY_NAME[f"torque +{'xyz'[axis]}"].problem(VehicleState(), VehicleState(omega_b=Vec3(*rates)))
    assert (found == "") is kept


@pytest.mark.parametrize(("axis", "right", "wrong"), [(0, (0, -0.1, 0), (0, 0.1, 0)), (1, (0.1, 0, 0), (-0.1, 0, 0))])
def test_tilt_must_carry_the_vehicle_as_in_flu(axis, right, wrong):
    part = BY_NAME[f"tilted by +{'xyz'[axis]}"]
    assert part.problem(tilted(axis, 0.048), tilted(axis, 0.048, right)) == ""
    assert "FLU" in part.problem(tilted(axis, 0.048), tilted(axis, 0.048, wrong))
    assert "rad" in part.problem(tilted(axis, -0.048), tilted(axis, -0.048, right))


def test_the_last_line_counts_what_is_kept():
    lines = report({"climb": "", "brake": "found 0"}).splitlines()
    assert lines == ["ok    climb", "FAIL  brake: found 0", "1 of 2 kept, 1 broken"]
