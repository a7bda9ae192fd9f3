"""The run-up: where one polynomial swings out, where the curve starts at rest with a jerk, where nothing will do."""

import itertools
import math

import pytest

from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import case1, case2
from quad_trajectory.approach import Start, plan_approach, sample_approach
from quad_trajectory.limits import MotionLimits

VEHICLE = Vehicle()
LIMITS = MotionLimits()
AT_REST = VehicleState()


def norm(v):
    return math.sqrt(sum(c * c for c in v))


def curve_point(v=(0.0, 0.0, 0.0), a=(0.0, 0.0, 0.0), jerk=(0.0, 0.0, 0.0)):
    return TrajectoryPoint(0.0, Vec3(4.0, -3.0, 6.0), Vec3(*v), Vec3(*a), Vec3(*jerk), Vec3(), 0.5, 0.0, 0.0)


def approach_to(first, start=AT_REST, limits=LIMITS):
    return plan_approach(Start.APPROACH, limits, VEHICLE.gravity, start, first)


FIRST_POINTS = {
    "lemniscate of 10 m/s: jerk without acceleration": curve_point((7.0, 7.0, 0.0), jerk=(-3.5, -14.0, 0.0)),
    "lemniscate of 15 m/s": curve_point((10.6, 10.6, 0.0), jerk=(-12.0, -48.0, 0.0)),
    "jerk at rest": curve_point(jerk=(1.0, -2.0, 8.0)),
    "acceleration at rest": curve_point(a=(1.0, 1.0, -0.5)),
    "jerk against acceleration": curve_point((0.1, 0.0, 0.0), (3.0, 0.0, 0.0), (-30.0, 0.0, 0.0)),
    "crawling": curve_point((1e-4, 0.0, 0.0)),
}


def assert_within(plan, first, limits, start_speed=0.0):
    """Compare 2000 samples with the limits, raised to 1.25 times what the ends ask for: written anew."""
    tilt = math.hypot(first.a_w.x, first.a_w.y) / (VEHICLE.gravity + first.a_w.z)
    tangent = max(math.tan(limits.tilt), 1.25 * tilt)
    for i in range(2000):
        now = sample_approach(plan, plan.duration * i / 2000)
        assert norm(now.v_w) <= max(limits.speed, 1.25 * norm(first.v_w), 1.25 * start_speed)
        assert norm(now.a_w) <= max(limits.acceleration, 1.25 * norm(first.a_w))
        assert norm(now.jerk_w) <= max(limits.jerk, 1.25 * norm(first.jerk_w))
        assert math.hypot(now.a_w.x, now.a_w.y) <= tangent * (VEHICLE.gravity + now.a_w.z)


@pytest.mark.parametrize("name", FIRST_POINTS)
def test_curve_is_reached_within_limits(name):
    first = FIRST_POINTS[name]
    plan = approach_to(first)
    assert plan.duration < 60.0
    assert_within(plan, first, LIMITS)
    end = sample_approach(plan, math.nextafter(plan.duration, 0.0))
    for field in ("p_w", "v_w", "a_w", "jerk_w"):
        assert getattr(end, field) == pytest.approx(getattr(first, field), abs=1e-6), field


@pytest.mark.parametrize("name", FIRST_POINTS)
def test_segments_of_an_approach_meet_in_acceleration_and_jerk(name):
    plan = approach_to(FIRST_POINTS[name], VehicleState(Vec3(30.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0)))
    gate = plan.transit.duration
    for joint in (gate, gate + plan.run_up.duration)[: 2 if plan.settle.duration > 0.0 else 1]:
        before, after = (sample_approach(plan, joint + d) for d in (-1e-9, 1e-9))
        for field in ("p_w", "v_w", "a_w", "jerk_w"):
            assert getattr(before, field) == pytest.approx(getattr(after, field), abs=1e-5), field


def test_each_derivative_is_the_slope_of_the_one_below():
    plan = approach_to(FIRST_POINTS["lemniscate of 10 m/s: jerk without acceleration"])
    assert plan.settle.duration > 0.0
    joints = (0.0, plan.transit.duration, plan.transit.duration + plan.run_up.duration, plan.duration)
    h = 1e-4
    for begin, end in itertools.pairwise(joints):
        for i in range(1, 20):
            time = begin + (end - begin) * i / 20
            before, now, after = (sample_approach(plan, time + d) for d in (-h, 0.0, h))
            for lower, higher in itertools.pairwise(("p_w", "v_w", "a_w", "jerk_w", "snap_w")):
                slope = [(b - a) / (2 * h) for a, b in zip(getattr(before, lower), getattr(after, lower), strict=True)]
                assert slope == pytest.approx(getattr(now, higher), rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(
    ("module", "length", "time", "limits"),
    [
        (case1, 0.071, 0.309, MotionLimits(1.37, 41.6, 0.0605, 0.826)),
        (case2, 0.0309, 14.6, MotionLimits(0.129, 34.7, 1.24, 0.593)),
    ],
)
def test_small_curve_is_reached_within_a_small_jerk(module, length, time, limits):
    """The search once ended after 300 durations and returned the last: 8.2 and 2.7 times the jerk limit."""
    parameters = module.Parameters(position_scale=length, time_scale=time, limits=limits)
    plan = module.plan(parameters, VEHICLE, VehicleState())
    first = module.curve(parameters, 0.0)
    assert_within(plan, first, limits)
    assert max(norm(sample_approach(plan, plan.duration - 1e-4 * i).jerk_w) for i in range(1, 10000)) <= max(
        limits.jerk, 1.25 * norm(first.jerk_w)
    )


def test_what_cannot_be_built_up_is_refused_with_the_reason():
    """From rest to 2.5 m/s^2 at 5 m/s^3 gains 2.5^2 / (2 * 5) = 0.6 m/s: not within 0.05 m/s either way."""
    first = curve_point((0.01, 0.0, 0.0), (2.5, 0.0, 0.0), (1e-3, 0.0, 0.0))
    with pytest.raises(
        ValueError, match=r"no approach within limits\.speed.*not reached within them; raise the limits"
    ):
        approach_to(first, limits=MotionLimits(speed=0.05))


def test_a_start_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="no duration of lift-off or transit"):
        approach_to(curve_point(), VehicleState(v_w=Vec3(0.0, math.nan, 0.0)))
