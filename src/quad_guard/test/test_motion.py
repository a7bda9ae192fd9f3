"""What the motion says of the heading and of the thrust, on paper: thrust and acceleration are given, not flown."""

import cmath
import math

import pytest
from guard_cases import VEHICLE

from quad_core.geometry import quaternion_from_euler
from quad_core.types import Vec3
from quad_guard.motion import LOST, NO_EVIDENCE, about_z, gathered, turn_found, unexplained

PERIOD = 2_000_000
EVERY = 10  # steps between two samples


def seen(heading=0.0, wind=0j, push=lambda t: 0j, seconds=2.0, gain=1.0, rises=0.0):
    """Return the evidence of a vehicle that leans by up to 0.3 rad to all sides, its true heading ``heading`` off."""
    evidence, v, climb, dt = NO_EVIDENCE, 0j, 0.0, EVERY * PERIOD / 1e9
    for step in range(0, round(seconds / dt) * EVERY, EVERY):
        t = step * PERIOD / 1e9
        pitch, roll = 0.3 * math.sin(3.0 * t), 0.2 * math.cos(2.0 * t)
        thrust = 1.1 * VEHICLE.mass * VEHICLE.gravity
        q = quaternion_from_euler(Vec3(roll, pitch, 0.0))
        evidence = gathered(evidence, VEHICLE, Vec3(v.real, v.imag, climb), q, thrust, step, PERIOD)
        # body z of Z-Y-X angles without yaw: sin theta cos phi, -sin phi, cos theta cos phi
        across = 1.1 * VEHICLE.gravity * complex(math.sin(pitch) * math.cos(roll), -math.sin(roll))
        v += dt * (gain * cmath.exp(1j * heading) * across + wind + push(t))
        climb += dt * (gain * 1.1 * VEHICLE.gravity * math.cos(pitch) * math.cos(roll) - VEHICLE.gravity)
    return evidence


@pytest.mark.parametrize("heading", [0.65, -0.65, 1.2, 2.5, -3.0])
@pytest.mark.parametrize("wind", [0j, 1.5 - 1.0j])
def test_a_wrong_heading_is_found_and_by_how_much(heading, wind):
    assert turn_found(seen(heading, wind)) == pytest.approx(heading, abs=0.1)


@pytest.mark.parametrize("gain", [0.7, 1.0, 1.3])
def test_a_right_heading_is_left_alone_whatever_the_mass_the_wind_and_the_gusts(gain):
    assert turn_found(seen(gain=gain)) == 0.0
    assert turn_found(seen(wind=2.0 + 1.0j, gain=gain)) == 0.0
    assert turn_found(seen(push=lambda t: 7.0 if int(2.0 * t) % 2 else 0.0, gain=gain)) == 0.0
    assert turn_found(seen(heading=0.45, gain=gain)) == 0.0


@pytest.mark.parametrize(("motion", "found"), [(4.4, 1.0), (10.0, 0.0)])
def test_a_heading_that_leaves_much_of_the_motion_unexplained_is_not_used(motion, found):
    # left 4.1 and 9.7 with the present heading, 0.4 and 6.0 with one that is 1 rad away
    along, across = 4.0 * math.cos(1.0), 4.0 * math.sin(1.0)
    evidence = NO_EVIDENCE._replace(along=along, across=across, thrust=4.0, motion=motion)
    assert turn_found(evidence) == pytest.approx(found)


def test_what_no_heading_explains_is_left_over():
    # mirrored: as if x pointed the other way, so a push of twice the thrust's own against it
    mirrored = seen(push=lambda t: -2.2 * VEHICLE.gravity * math.sin(0.3 * math.sin(3.0 * t)))
    assert unexplained(seen()) < 0.5
    assert unexplained(mirrored) > LOST


@pytest.mark.parametrize(("gain", "expected"), [(0.9, 0.9), (1.05, 1.05), (2.0, 1.3), (0.2, 0.7)])
def test_the_strength_is_what_a_thrust_gives_over_what_it_should_give(gain, expected):
    assert seen(gain=gain, seconds=5.0).strength == pytest.approx(expected, abs=0.01)


def test_a_long_gap_tells_nothing():
    before = seen(1.0)
    after = gathered(
        before, VEHICLE, Vec3(50.0, 0.0, 0.0), quaternion_from_euler(Vec3()), 5.0, before.step + 200, PERIOD
    )
    assert (after.along, after.motion, after.strength) == (before.along, before.motion, before.strength)


def test_a_turn_about_z_adds_to_the_heading():
    assert about_z(0.7, quaternion_from_euler(Vec3(0.1, 0.2, 0.5))) == pytest.approx(
        quaternion_from_euler(Vec3(0.1, 0.2, 1.2))
    )
