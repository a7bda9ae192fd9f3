"""Arming: a good vehicle is armed, and each thing that is wrong is refused by name."""

import math

import pytest

from quad_commander.arming import (
    ArmingLimits,
    Fence,
    FlightLimits,
    Observed,
    Stream,
    outside,
    refusals,
)
from quad_core.extent import Extent
from quad_core.types import Vec3

PLAN = Extent(Vec3(-1.0, -1.0, 0.0), Vec3(1.0, 1.0, 3.0), 2.0, 1.5, 0.2, 60.0)
GOOD = Observed(
    run_id="a1",
    run_ids=("a1",),
    interface_hashes=("f00d",),
    streams=(Stream("state", 1, 500.0, 498.0), Stream("wrench_setpoint", 1, 500.0, 501.0)),
    announced_spacing=0.002,
    state_spacing=0.0021,
    tilt=0.01,
    speed=0.01,
    drift=0.02,
    ground_z=0.0,
    body_rate=0.01,
    battery=0.9,
    disk=20.0,
    plan=PLAN,
    plans=1,
    faulty_nodes=(),
)


def reasons(**changes):
    return refusals(ArmingLimits(), Fence(), FlightLimits(), GOOD._replace(**changes))


def test_a_good_vehicle_is_armed():
    assert reasons() == []
    assert reasons(battery=None, disk=None) == []


def stream(publishers=1, rate=500.0):
    return {"streams": (Stream("reference", publishers, 500.0, rate),)}


@pytest.mark.parametrize(("changes", "reason"), [
    ({"run_id": "", "run_ids": ("",)}, "flight.run_id is empty"),
    ({"run_ids": ("a1", "b2")}, "run ids: found 'b2' too, expected 'a1' alone"),
    ({"interface_hashes": ("f00d", "beef")}, "interface hashes: found 2 different ones"),
    ({"faulty_nodes": ("trajectory",)}, "trajectory: found FAULT"),
    (stream(publishers=2), "reference: found 2 publishers, expected 1"),
    (stream(publishers=0), "reference: found 0 publishers, expected 1"),
    (stream(rate=399.0), "reference: found 399.0 Hz, expected 400.0 to 600.0 Hz"),
    (stream(rate=601.0), "reference: found 601.0 Hz"),
    (stream(rate=math.nan), "reference: found nan Hz"),
    ({"state_spacing": 0.0095}, "state: found samples 9.50 ms apart, expected 1.00 to 4.00 ms"),
    ({"state_spacing": 0.0009}, "state: found samples 0.90 ms apart"),
    ({"tilt": math.radians(15.1)}, "tilt: found 15.1 deg, expected less than 15.0 deg"),
    ({"tilt": math.nan}, "tilt: found nan deg"),
    ({"speed": 0.11}, "speed: found 0.11 m/s"),
    ({"drift": 0.11}, "state: found an estimate that moves at 0.11 m/s while the vehicle stands"),
    ({"drift": math.nan}, "state: found an estimate that moves at nan m/s"),
    ({"ground_z": 3.0}, "plan: found it outside the fence at (-1.0, -1.0, 0.0) m"),
    ({"body_rate": 0.11}, "body rate: found 0.11 rad/s"),
    ({"battery": 0.29}, "battery: found 29 %, expected at least 30 %"),
    ({"disk": 0.9}, "disk: found 0.90 GB free"),
    ({"plan": None}, "plan: found none"),
    ({"plans": 2}, "plan: found 2 different ones"),
    ({"plan": PLAN._replace(high=Vec3(0.0, 0.0, 121.0))}, "plan: found it outside the fence at (0.0, 0.0, 121.0) m"),
    ({"plan": PLAN._replace(speed=10.1)}, "plan: found a speed of 10.10 m/s, expected at most 10.00 m/s"),
    ({"plan": PLAN._replace(acceleration=math.inf)}, "plan: found a acceleration of inf m/s^2"),
    ({"plan": PLAN._replace(tilt=0.9)}, "plan: found a tilt of 0.90 rad"),
    ({"plan": PLAN._replace(duration=1e9)}, "plan: found a duration of 1000000000.00 s"),
    ({"plan": PLAN._replace(duration=-1.0)}, "plan: found a duration of -1.00 s"),
])  # fmt: skip
def test_each_fault_is_refused_by_name(changes, reason):
    found = reasons(**changes)
    assert len(found) == 1
    assert found[0].startswith(reason.replace("a acceleration", "an acceleration"))


def test_all_reasons_are_named_at_once():
    assert len(reasons(tilt=1.0, battery=0.0, disk=0.0, plan=None)) == 4


@pytest.mark.parametrize(("position", "is_outside"), [
    (Vec3(0.0, 0.0, 0.0), False),
    (Vec3(100.0, -100.0, 50.0), False),
    (Vec3(100.1, 0.0, 0.0), True),
    (Vec3(0.0, 0.0, -1.1), True),
    (Vec3(0.0, math.nan, 0.0), True),
])  # fmt: skip
def test_the_fence_is_a_box_and_what_is_not_a_number_is_outside(position, is_outside):
    assert outside(Fence(), position, 0.0) == is_outside


def test_the_height_of_the_fence_counts_from_the_ground():
    assert outside(Fence(), Vec3(0.0, 0.0, -13.0), 0.0)
    assert not outside(Fence(), Vec3(0.0, 0.0, -13.0), -13.2)
    assert outside(Fence(), Vec3(0.0, 0.0, 107.0), -13.2)
