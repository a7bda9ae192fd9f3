"""Large steps of one attitude axis within 5 degrees for good, torque limited: what preset ``agile`` is for."""

import math

import pytest

from quad_attitude_ctrl import abfnitsm, abfnitsm_so3
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle

DT, INERTIA, BAND = 0.002, 3.5e-3, math.radians(5.0)
VEHICLE = Vehicle(inertia_xx=INERTIA, inertia_yy=INERTIA, drag_torque_coefficient=0.0)


def arrival(law, preset, axis, step):
    """Return from when in s a turn about ``axis`` (0 roll, 1 pitch) stays within 5 degrees of ``step`` rad."""
    parameters = build(law.Parameters, law.PRESETS[preset])
    memory, angle, rate, late = law.init(parameters, VEHICLE), 0.0, 0.0, 0.0
    half = [0.0, 0.0, 0.0]
    half[axis] = math.sin(0.5 * step)
    angles = [0.0, 0.0, 0.0]
    angles[axis] = step
    goal = AttitudeThrust(Vec3(*angles), Vec3(), Vec3(), Quat(*half, math.cos(0.5 * step)), 5.0, 0.3)
    for k in range(500):
        q, w = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        q[axis], w[axis] = math.sin(0.5 * angle), rate
        state = VehicleState(Vec3(), Vec3(), Quat(*q, math.cos(0.5 * angle)), Vec3(*w))
        wrench, memory, _ = law.step(parameters, VEHICLE, memory, AttitudeInputs(state, goal, Actuation()), DT)
        acceleration = wrench.torque_b[axis] / INERTIA
        angle, rate = angle + DT * rate + 0.5 * DT * DT * acceleration, rate + DT * acceleration
        if abs(angle - step) > BAND:
            late = (k + 1) * DT
    return late


@pytest.mark.parametrize("step", [math.pi / 3.0, -math.pi / 3.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_sixty_degrees_in_a_quarter_of_a_second(axis, step):
    assert arrival(abfnitsm, "agile", axis, step) <= 0.25


def test_the_filter_and_not_the_surface_made_it_slow():
    """At 40 rad/s the filter asks for 2.7 times the torque limit; the way back from that costs 0.4 s."""
    assert arrival(abfnitsm, "tuned", 1, math.pi / 3.0) > 0.5


@pytest.mark.parametrize(("axis", "step"), [(0, math.pi), (1, 0.5 * math.pi), (1, math.pi / 3.0)])
def test_any_attitude_law_turns_half_round_in_four_tenths(axis, step):
    assert arrival(abfnitsm_so3, "agile", axis, step) <= 0.4
