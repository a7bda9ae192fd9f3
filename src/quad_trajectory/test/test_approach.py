"""The approach: joined to acceleration and jerk, within its limits, from anywhere, and the shortest of its kind."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import approach, case1, case2, hover, lemniscate
from quad_trajectory.approach import Start, plan_approach, sample_approach
from quad_trajectory.limits import MotionLimits
from quad_trajectory.polynomial import PEAK_ACCELERATION, PEAK_RATE, smooth_step

VEHICLE = Vehicle()
MODULES = (case1, case2, hover, lemniscate)


def vectors(bound):
    return st.builds(Vec3, *(st.floats(-bound, bound) for _ in range(3)))


states = st.builds(
    lambda p, v, yaw, tilt: VehicleState(p, v, quaternion_from_euler(Vec3(tilt, -tilt, yaw)), Vec3()),
    vectors(200.0),
    st.one_of(st.just(Vec3()), vectors(15.0)),
    st.floats(-math.pi, math.pi),
    st.floats(-0.5, 0.5),
)


def norm(v):
    return math.sqrt(sum(c * c for c in v))


def walk(module, parameters, plan, count=400):
    return [module.sample(parameters, plan, plan.duration * i / count) for i in range(count)]


def allowed_of(parameters, start, first):
    """What the limits and the ends of the approach allow: written anew, not taken from the code."""
    limits = parameters.limits
    end_tilt = math.atan2(math.hypot(first.a_w.x, first.a_w.y), VEHICLE.gravity + first.a_w.z)
    return (
        max(limits.speed, 1.25 * norm(first.v_w), 1.25 * norm(start.v_w)),
        max(limits.acceleration, 1.25 * norm(first.a_w)),
        max(limits.jerk, 1.25 * norm(first.jerk_w)),
        max(math.tan(limits.tilt), 1.25 * math.tan(end_tilt)),
    )


@pytest.mark.parametrize("module", MODULES)
@settings(max_examples=40, deadline=None)
@given(start=states)
def test_joint_and_limits_from_anywhere(module, start):
    parameters = module.Parameters()
    plan = module.plan(parameters, VEHICLE, start)
    first = module.sample(parameters, plan, plan.duration)
    assert first.trajectory_time == 0.0

    begin = module.sample(parameters, plan, 0.0)
    assert begin.p_w == pytest.approx(start.p_w, abs=1e-9)
    assert begin.v_w == pytest.approx(start.v_w, abs=1e-9)
    assert begin.a_w == (0.0, 0.0, 0.0)

    end = module.sample(parameters, plan, math.nextafter(plan.duration, 0.0))
    assert end.trajectory_time < 0.0
    assert end.p_w == pytest.approx(first.p_w, abs=1e-8)
    assert end.v_w == pytest.approx(first.v_w, abs=1e-8)
    assert end.a_w == pytest.approx(first.a_w, abs=1e-8)
    assert end.jerk_w == pytest.approx(first.jerk_w, abs=1e-7)
    assert math.cos(end.yaw - first.yaw) == pytest.approx(1.0, abs=1e-12)
    assert (end.yaw_rate, end.yaw_acceleration) == pytest.approx((0.0, 0.0), abs=1e-6)

    speed, acceleration, jerk, tangent = allowed_of(parameters, start, first)
    for point in walk(module, parameters, plan):
        assert norm(point.v_w) <= speed
        assert norm(point.a_w) <= acceleration
        assert norm(point.jerk_w) <= jerk
        assert math.hypot(point.a_w.x, point.a_w.y) <= tangent * (VEHICLE.gravity + point.a_w.z)
        assert abs(point.yaw_rate) <= parameters.limits.yaw_rate * (1 + 1e-9)
        assert abs(point.yaw_acceleration) <= parameters.limits.yaw_acceleration * (1 + 1e-9)


limit_values = {
    "limits.speed": st.floats(0.05, 50.0),
    "limits.acceleration": st.floats(0.05, 50.0),
    "limits.jerk": st.floats(0.05, 50.0),
    "limits.tilt": st.floats(0.02, 1.3),
}
scales = {"position_scale": st.floats(0.01, 10.0), "time_scale": st.floats(0.1, 20.0)}
figures = {"speed": st.floats(0.1, 20.0), "half_width": st.floats(0.5, 50.0)}


@pytest.mark.parametrize(("module", "values"), [(case1, scales), (case2, scales), (lemniscate, figures)])
@settings(max_examples=20, deadline=None)
@given(start=states, data=st.data())
def test_a_curve_of_any_scale_is_reached_within_limits_or_refused(module, values, start, data):
    parameters = build(module.Parameters, data.draw(st.fixed_dictionaries(limit_values | values)))
    try:
        plan = module.plan(parameters, VEHICLE, start)
    except ValueError as error:
        assert module is lemniscate
        assert "not reached within them" in str(error)
        return
    speed, acceleration, jerk, tangent = allowed_of(parameters, start, module.curve(parameters, 0.0))
    for point in walk(module, parameters, plan, 200):
        assert norm(point.v_w) <= speed
        assert norm(point.a_w) <= acceleration
        assert norm(point.jerk_w) <= jerk
        assert math.hypot(point.a_w.x, point.a_w.y) <= tangent * (VEHICLE.gravity + point.a_w.z)


WIDE = {"limits.speed": 50.0, "limits.acceleration": 50.0, "limits.jerk": 1e3}
TILT = {"position.x": 12.0, "position.z": 0.0, "limits.tilt": 0.1}
SHORTEST = {
    # from rest to rest the speed peaks at 35/16 of the mean: 12 m at 0.995 * 3 m/s take 8.79 s
    "speed": ({"position.z": 12.0, "limits.speed": 3.0}, 0.0, 9.0),
    # 84 sqrt(5) / 25 * 12 m / T^2 <= 0.995 * 2 m/s^2: T >= 6.731 s
    "acceleration": ({"position.z": 12.0, "limits.acceleration": 2.0}, 0.0, 6.75),
    # 84 sqrt(5) / 25 * 12 m / T^2 <= 0.995 * 9.8 tan(0.1) m/s^2: T >= 9.600 s
    "tilt": (TILT, 0.0, 9.75),
    # down at 45 deg both accelerations peak at a = 90.16 / T^2: a <= 0.995 tan(0.1) (9.8 - a): T >= 10.067 s
    "tilt while sinking": (TILT, 12.0, 10.25),
    # the jerk from rest to rest peaks at 52.5 times way / T^3: 52.5 * 12 / T^3 <= 0.995 * 1 m/s^3: T >= 8.588 s
    "jerk": ({"position.z": 12.0, "limits.jerk": 1.0}, 0.0, 8.75),
    # a turn by 3 rad at 0.5 rad/s takes 35/16 * 3 / 0.5 = 13.125 s
    "yaw alone": ({"yaw": 3.0, "limits.yaw_rate": 0.5}, 2.0, 13.25),
}


@pytest.mark.parametrize(("values", "height", "duration"), SHORTEST.values(), ids=SHORTEST)
def test_hover_is_reached_in_the_shortest_time_that_its_limits_allow(values, height, duration):
    start = VehicleState(p_w=Vec3(0.0, 0.0, height))
    assert hover.plan(build(hover.Parameters, WIDE | values), VEHICLE, start).duration == duration


def test_already_there_lasts_the_shortest_time():
    plan = hover.plan(hover.Parameters(), VEHICLE, VehicleState(p_w=Vec3(0.0, 0.0, 2.0)))
    assert approach.SHORTEST <= plan.duration <= approach.SHORTEST + approach.QUANTUM
    assert hover.sample(hover.Parameters(), plan, 0.5).p_w == pytest.approx((0.0, 0.0, 2.0), abs=1e-12)


def test_yaw_turns_the_short_way():
    start = VehicleState(q_wb=quaternion_from_euler(Vec3(0.0, 0.0, 3.0)))
    parameters = build(hover.Parameters, {"yaw": -3.0})
    plan = hover.plan(parameters, VEHICLE, start)
    yaws = [point.yaw for point in walk(hover, parameters, plan)]
    assert min(yaws) >= 3.0 - 1e-12
    assert max(yaws) <= 2 * math.pi - 3.0 + 1e-12


@pytest.mark.parametrize("module", MODULES)
def test_printed_start_has_no_approach(module):
    parameters = build(module.Parameters, {"start": "printed"})
    plan = module.plan(parameters, VEHICLE, VehicleState())
    assert plan.duration == 0.0
    assert module.sample(parameters, plan, 0.0).trajectory_time == 0.0


def test_peaks_of_the_smooth_step():
    motions = [smooth_step(0.0, 1.0, 1.0, i / 20000) for i in range(20001)]
    assert max(m.v for m in motions) == pytest.approx(PEAK_RATE, rel=1e-8)
    assert max(abs(m.a) for m in motions) == pytest.approx(PEAK_ACCELERATION, rel=1e-7)


GROUND_STATES = st.builds(
    lambda p, v, yaw: VehicleState(
        p, v, quaternion_from_euler(Vec3(0.02, -0.01, yaw)), Vec3(), ground_z=p.z, on_ground=True
    ),
    vectors(20.0),
    vectors(0.08),  # below AT_REST in every direction
    st.floats(-math.pi, math.pi),
)


@pytest.mark.parametrize("module", MODULES)
@settings(max_examples=20, deadline=None)
@given(start=GROUND_STATES)
def test_from_the_ground_it_begins_at_rest_and_goes_straight_up_until_clear(module, start):
    parameters = module.Parameters()
    plan = module.plan(parameters, VEHICLE, start)
    limits = parameters.limits
    points = [module.sample(parameters, plan, plan.lift.duration * i / 200) for i in range(201)]
    assert (points[0].p_w, points[0].v_w, points[0].a_w) == (start.p_w, Vec3(), Vec3())
    for before, after in itertools.pairwise(points):
        assert (after.p_w.x, after.p_w.y) == (start.p_w.x, start.p_w.y)
        assert after.p_w.z >= before.p_w.z
        assert (after.yaw, after.yaw_rate) == (points[0].yaw, 0.0)
        assert norm(after.v_w) <= limits.speed
        assert norm(after.a_w) <= limits.acceleration
        assert norm(after.jerk_w) <= 1.001 * limits.jerk
    assert points[-1].p_w.z - start.p_w.z == pytest.approx(1.5)
    # and from there as from any state at rest: no step, and the curve at the end
    whole = walk(module, parameters, plan, 2000)
    largest = max(math.dist(a.p_w, b.p_w) for a, b in itertools.pairwise(whole))
    fastest = max(limits.speed, 1.25 * norm(module.sample(parameters, plan, plan.duration).v_w))
    assert largest <= 1.05 * fastest * plan.duration / 2000
    assert module.sample(parameters, plan, plan.duration).trajectory_time == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("how", list(approach.Start))
def test_an_estimate_that_moves_on_the_ground_is_refused_by_name(how):
    moving = VehicleState(v_w=Vec3(0.0, 0.0, -0.25), on_ground=True)
    parameters = hover.Parameters(start=how)
    with pytest.raises(ValueError, match=r"the estimate moves faster than 0\.15 m/s while the vehicle stands"):
        hover.plan(parameters, VEHICLE, moving)
    hover.plan(parameters, VEHICLE, moving._replace(on_ground=False))


LIMITS = MotionLimits()
AT_REST = VehicleState()


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
