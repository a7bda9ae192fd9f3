"""Waypoints: the path against SciPy's spline, its limits and its heading."""

import itertools
import math

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from quad_core.parameters import ParameterError, build
from quad_core.types import Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import waypoints
from quad_trajectory.minimum_snap import axis_at, solved_path
from quad_trajectory.waypoints import long_turns, read_points

VEHICLE = Vehicle()
REST = [(order, np.zeros(3)) for order in (1, 2, 3)]
TEXTS = {
    "square": "0 0 2; 6 0 3; 6 6 4; 0 6 3; 0 0 2",
    "two": "0 0 1\n0 0 30",
    "uneven": "0 0 2; 0.05 0 2; 40 0 2; 40 0.1 2.5; -20 5 12",
    "there and back": "0 0 2; 5 0 2; 0 0 2; 5 0 2",
    "turning": "0 0 2 0; 1 0 2 3.1; 2 0 2 -3.1; 8 0 2 0.5",
    "falling": "0 0 60; 0 0 2; 1 0 40",
}


def planned(text, **values):
    parameters = build(waypoints.Parameters, {"points": text, "start": "printed", **values})
    waypoints.check(parameters)
    return parameters, waypoints.plan(parameters, VEHICLE, VehicleState())


def samples(parameters, plan, per_segment=200):
    for begin, length in plan.path[:, :2]:
        for i in range(per_segment):
            yield waypoints.sample(parameters, plan, float(begin + length * i / per_segment))


@pytest.mark.parametrize("seed", range(5))
def test_path_is_the_clamped_spline_of_degree_7(seed):
    """SciPy's interpolating spline of degree 7 at rest at its ends is the path of least snap at given times."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 20))
    points = np.column_stack([rng.uniform(-20.0, 20.0, (count, 3)), np.zeros(count)])
    times = rng.uniform(0.3, 4.0, count - 1)
    ends = np.concatenate([[0.0], np.cumsum(times)])
    spline = make_interp_spline(ends, points[:, :3], k=7, bc_type=(REST, REST))
    path = solved_path(points, times)
    for segment, u, axis in itertools.product(range(count - 1), (0.0, 0.3, 0.7, 0.99), range(3)):
        time = ends[segment] + u * times[segment]
        found = axis_at(path, segment, axis, u * times[segment])
        for order in range(5):
            scale = max(1.0, np.abs(spline(ends, order)).max())
            assert found[order] == pytest.approx(float(spline(time, order)[axis]), abs=1e-6 * scale), order


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_waypoints_are_met_in_order_and_the_ends_at_rest(text):
    parameters, plan = planned(text)
    points = np.array([[float(word) for word in line.split()[:3]] for line in text.replace("\n", ";").split(";")])
    times = [*plan.path[:, 0], plan.duration]
    for time, point in zip(times, points, strict=True):
        assert waypoints.sample(parameters, plan, float(time)).p_w == pytest.approx(point, abs=1e-9)
    for time in (0.0, math.nextafter(plan.duration, 0.0)):
        end = waypoints.sample(parameters, plan, time)
        for name in ("v_w", "a_w", "jerk_w"):
            assert getattr(end, name) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert waypoints.duration(parameters, plan) == plan.duration + 2.0
    assert waypoints.sample(parameters, plan, plan.duration + 1.0).v_w == Vec3()


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize(
    "limits",
    [
        {},
        {"speed": 1.5},
        {"speed": 60.0, "thrust": 0.4, "body_rate": 20.0, "tilt": 1.3},
        {"speed": 60.0, "thrust": 1.0, "body_rate": 0.5, "tilt": 1.3},
        {"speed": 60.0, "thrust": 1.0, "body_rate": 20.0, "tilt": 0.1},
    ],
)
def test_limits_are_kept(text, limits):
    parameters, plan = planned(text, **limits)
    max_acceleration = parameters.thrust * VEHICLE.thrust_to_weight * VEHICLE.gravity
    used = [0.0]
    for point in samples(parameters, plan):
        force = np.add(point.a_w, (0.0, 0.0, VEHICLE.gravity))
        thrust = np.linalg.norm(force)
        direction_rate = np.linalg.norm(np.cross(force, point.jerk_w)) / thrust**2
        tilt = math.atan2(math.hypot(force[0], force[1]), force[2])
        used.append(np.linalg.norm(point.v_w) / parameters.speed)
        used.append(thrust / max_acceleration)
        used.append(tilt / parameters.tilt)
        used.append(direction_rate / parameters.body_rate)
        used.append(abs(point.yaw_rate) / parameters.limits.yaw_rate)
        used.append(abs(point.yaw_acceleration) / parameters.limits.yaw_acceleration)
        assert force[2] >= 0.2 * VEHICLE.gravity * (1.0 - 1e-9)
    assert max(used) <= 1.0 + 1e-9


def test_a_straight_way_uses_its_speed_limit():
    """From rest to rest along 100 m the minimum-snap path peaks at 35/16 of its mean speed."""
    _, plan = planned("0 0 2; 100 0 2", speed=2.0)
    assert plan.duration == pytest.approx(100.0 * 35.0 / 16.0 / 2.0, rel=8e-3)


def test_each_derivative_is_the_slope_of_the_one_below():
    parameters, plan = planned(TEXTS["turning"])
    h = 1e-4
    for begin, length in plan.path[:, :2]:
        for i in range(1, 40):
            time = float(begin + length * i / 40)
            before, now, after = (waypoints.sample(parameters, plan, time + d) for d in (-h, 0.0, h))
            for lower, higher in itertools.pairwise(("p_w", "v_w", "a_w", "jerk_w", "snap_w")):
                slope = [(b - a) / (2 * h) for a, b in zip(getattr(before, lower), getattr(after, lower), strict=True)]
                assert slope == pytest.approx(getattr(now, higher), rel=1e-5, abs=1e-4), (lower, time)
            assert (after.yaw - before.yaw) / (2 * h) == pytest.approx(now.yaw_rate, abs=1e-5)
            assert (after.yaw_rate - before.yaw_rate) / (2 * h) == pytest.approx(now.yaw_acceleration, abs=1e-4)


def test_heading_turns_between_waypoints_and_holds_until_it_is_given_anew():
    parameters, plan = planned("0 0 2 1; 5 0 2; 5 5 2 -1; 0 5 2")
    yaws = [waypoints.sample(parameters, plan, float(time)).yaw for time in (*plan.path[:, 0], plan.duration)]
    assert yaws == pytest.approx([1.0, 1.0, -1.0, -1.0])


def test_first_waypoint_is_reached_from_elsewhere():
    parameters = build(waypoints.Parameters, {"points": "3 0 2 0.7; 6 0 3"})
    plan = waypoints.plan(parameters, VEHICLE, VehicleState())
    begin, joint = (waypoints.sample(parameters, plan, time) for time in (0.0, plan.approach.duration))
    assert begin.p_w == (0.0, 0.0, 0.0)
    assert joint.trajectory_time == 0.0
    assert joint.p_w == pytest.approx((3.0, 0.0, 2.0), abs=1e-12)
    assert joint.yaw == pytest.approx(0.7)


def test_a_thrust_limit_below_the_weight_is_refused():
    parameters = build(waypoints.Parameters, {"thrust": 0.3})
    with pytest.raises(ValueError, match=r"waypoints\.thrust.*weight"):
        waypoints.plan(parameters, VEHICLE, VehicleState())


@pytest.mark.parametrize(
    "number", ["0", "-0", "+1.5", "-12.25", ".5", "0.1", "8765.01234567891", "9999.9999999999", "3.00000000000001"]
)
def test_numbers_are_read_to_the_bit(number):
    text = f"0 0 2 # a comment\n {number} -{number.strip('+-')} 3 # end\n\n"
    row = read_points(text)[-1]
    assert row[0].hex() == float(number).hex()
    assert row[1].hex() == float("-" + number.strip("+-")).hex()


def test_points_are_read_as_written():
    table = read_points("1 2 3; 4 5 6 0.5 # turn\n\n  7 8\t9;")
    assert table.tolist() == [[1.0, 2.0, 3.0, 0.0], [4.0, 5.0, 6.0, 0.5], [7.0, 8.0, 9.0, 0.5]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ["found 0 waypoints", "2 to 32"]),
        ("0 0 2", ["found 1 waypoints"]),
        ("0 0 2\n1 0", ["waypoint 2", "line 2", "'1 0'", "x y z"]),
        ("0 0 2\n\n1 0 2 0 0", ["line 3", "x y z"]),
        ("0 0 2; 1 1e3 2", ["waypoint 2", "1e3", "12.5"]),
        ("0 0 2; 1 nan 2", ["nan"]),
        ("0 0 2; ٣ 0 2", ["waypoint 2", "٣", "12.5"]),
        ("0 0 2; 1 10000.1 2", ["10000"]),
        ("0 0 2 0; 4 0 2 90", ["waypoint 2", "at most one turn", "90deg"]),
        ("0 0 2; 4 0 2 -6.3", ["at most one turn", "-6.3deg"]),
        ("0 0 2; 4 0 2 361deg", ["at most one turn"]),
        ("0 0 2; 4 0 2 90 deg", ["x y z"]),
        ("0 0 2; 4 0 2deg", ["2deg", "12.5"]),
        ("0 0 2; 4 0 2 90degrees", ["90degrees", "12.5"]),
        ("0 0 2; 0 0.001 2", ["0.01 m"]),
        (";".join(f"{i} 0 2" for i in range(33)), ["found 33 waypoints"]),
    ],
)
def test_what_is_no_waypoint_is_refused_by_line(text, said):
    with pytest.raises(ParameterError) as caught:
        read_points(text)
    for words in ["points", *said]:
        assert words in str(caught.value)


def test_degrees_are_read_as_radians():
    assert read_points("0 0 2 0; 5 0 2 360deg")[1, 3] == 0.0
    found = read_points("0 0 2 -90deg; 4 0 2 .5deg; 5 0 2 180deg # half a turn")[:, 3]
    assert found == pytest.approx([-math.pi / 2, math.pi / 360, math.pi], rel=1e-15)


@pytest.mark.parametrize(
    ("yaws", "short"),
    [
        (["3.1", "-3.1"], [3.1, 2 * math.pi - 3.1]),
        (["-3.1", "3.1"], [-3.1, 3.1 - 2 * math.pi]),
        (["0", "3.1", "-3.1", "0"], [0.0, 3.1, 2 * math.pi - 3.1, 2 * math.pi]),
        (["0", "360deg"], [0.0, 0.0]),
        (["350deg", "10deg"], [math.radians(350), math.radians(370)]),
        (["0.5", "-0.5"], [0.5, -0.5]),
    ],
)
def test_the_heading_turns_the_short_way(yaws, short):
    text = "; ".join(f"{index} 0 2 {yaw}" for index, yaw in enumerate(yaws))
    assert read_points(text)[:, 3] == pytest.approx(short, abs=1e-12)


def test_a_turn_flown_the_short_way_is_said_with_both_angles():
    assert long_turns("0 0 2 3.1; 4 0 2 -3.1; 5 0 2 -3") == [
        "waypoint 2: the heading turns 5 deg, not -355 deg (for the long way write a waypoint between)"
    ]
    assert long_turns("0 0 2 0; 4 0 2 1; 5 0 2 -1") == []
