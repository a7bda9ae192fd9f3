"""Waypoints as text: numbers, degrees, the short way round, and which text is refused."""

import math

import pytest

from quad_core.parameters import ParameterError
from quad_trajectory.waypoint_text import long_turns, read_points


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
