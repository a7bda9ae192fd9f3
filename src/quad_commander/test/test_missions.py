"""Missions: what can be written, and what is refused in which words."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_commander.missions import Item, parse, read_mission
from quad_commander.references import Place
from quad_core.enumerations import Request
from quad_core.parameters import ParameterError

NAMES = {"case1", "case2", "hover"}


def test_a_mission_is_read_in_order():
    assert parse("takeoff:2, case2,hold:5,land", NAMES) == (
        Item(Request.TAKEOFF, value=2.0),
        Item(Request.MISSION, "case2"),
        Item(Request.HOLD, value=5.0),
        Item(Request.LAND),
    )


@pytest.mark.parametrize(("text", "place"), [
    ("goto:1 -2.5 3", Place(1.0, -2.5, 3.0)),
    ("goto:1 2 3 0", Place(1.0, 2.0, 3.0, 0.0)),
    ("goto: 1 2 3  -90deg", Place(1.0, 2.0, 3.0, -math.pi / 2.0)),
])  # fmt: skip
def test_a_place_has_three_coordinates_and_may_have_a_heading(text, place):
    (_, item, _) = parse(f"takeoff,{text}", NAMES)
    assert item == Item(Request.GOTO, place=place)
    assert parse(f"takeoff,goto:{item.place}", NAMES)[1].place == pytest.approx(place)


def test_every_mission_ends_with_a_landing():
    assert parse("takeoff", NAMES) == (Item(Request.TAKEOFF), Item(Request.LAND))


@pytest.mark.parametrize(("text", "found", "expected"), [
    ("", "''", "takeoff[:height], hold:seconds, goto:x y z [yaw], land, case1, case2, hover"),
    ("takeoff,case3", "'case3' as item 2", "case1, case2, hover"),
    ("takeoff,,land", "'' as item 2", "takeoff[:height]"),
    ("case2,land", "item 1 'case2'", "takeoff first"),
    ("takeoff,takeoff,land", "item 2 'takeoff'", "takeoff only as the first item"),
    ("takeoff,land,case2", "'case2' after land", "land as the last item"),
    ("takeoff,hold", "'hold' as item 2", "hold:seconds"),
    ("takeoff,hold:x", "'hold:x'", "a time in s above 0"),
    ("takeoff,hold:nan", "'hold:nan'", "a time in s above 0"),
    ("takeoff,hold:-1", "'hold:-1'", "a time in s above 0"),
    ("takeoff:1e9", "'takeoff:1e9'", "a height in m above 0 and at most 1000"),
    ("takeoff:", "'takeoff:'", "a height in m"),
    ("takeoff,case2:3", "'case2:3' as item 2", "case2"),
    ("takeoff,goto", "'goto' as item 2", "goto:x y z [yaw]"),
    ("takeoff,goto:1 2", "'goto:1 2'", "x y z in m and, if it changes, yaw in rad (or 90deg)"),
    ("takeoff,goto:1 2 3 4 5", "'goto:1 2 3 4 5'", "x y z in m"),
    ("takeoff,goto:1 two 3", "'goto:1 two 3'", "x y z in m"),
    ("takeoff,goto:1 2 nan", "'goto:1 2 nan'", "[-10000, 10000] m"),
    ("takeoff,goto:1 2 3 90", "'goto:1 2 3 90'", "for degrees, as 90deg"),
    ("takeoff,goto:1 2 3 400deg", "'goto:1 2 3 400deg'", "at most one turn, in rad or, for degrees, as 90deg"),
    ("takeoff," + "hold:1," * 100 + "land", "102 items", "at most 100"),
])  # fmt: skip
def test_what_cannot_be_flown_is_named(text, found, expected):
    with pytest.raises(ParameterError) as error:
        parse(text, NAMES)
    assert f"found {found}" in str(error.value)
    assert expected in str(error.value)


@given(st.text(alphabet="takeofldcs2hg:,15. ", max_size=40))
def test_no_text_raises_anything_else(text):
    try:
        items = parse(text, NAMES)
    except ParameterError:
        return
    assert items[0].request == Request.TAKEOFF
    assert items[-1].request == Request.LAND


FILE = """
items: [takeoff:2, waypoints, hold:5, land]
waypoints:
  points: [0 0 2, 4 0 2 90deg]
  speed: 1.5
"""


def written(folder, text):
    path = folder / "mission.yaml"
    path.write_text(text, "utf-8")
    return str(path)


def test_items_and_waypoints_come_from_the_file(tmp_path):
    assert read_mission(written(tmp_path, FILE)) == (
        "takeoff:2,waypoints,hold:5,land",
        "waypoints",
        ["trajectory.waypoints.points=0 0 2; 4 0 2 90deg", "trajectory.waypoints.speed=1.5"],
    )


def test_items_may_be_written_as_yaml_has_them(tmp_path):
    text = "items: [takeoff: 2, goto: [4, 0, 2, 90deg], 'goto:4 4 2', hold: 5, land]"
    items = "takeoff:2,goto:4 0 2 90deg,goto:4 4 2,hold:5,land"
    assert read_mission(written(tmp_path, text)) == (items, None, [])


@pytest.mark.parametrize(("text", "words"), [
    ("points: [1]", "no list items"),
    ("items: takeoff", "no list items"),
    ("items: [takeoff]\ncase1: {speed: 1}", "found case1"),
    ("items: [takeoff]\nitems: [land]", "items"),
    ("items: [takeof]", "found 'takeof' as item 1"),
    ("items: [takeoff, case1, case2]", "found case1, case2, expected one trajectory"),
    (FILE.replace("speed: 1.5", "sped: 1.5"), r"waypoints\.sped: .*did you mean waypoints\.speed"),
    (FILE.replace("speed: 1.5", "speed: -1"), r"waypoints\.speed: found -1, expected"),
    (FILE.replace("0 0 2,", "0 0,"), r"points: waypoint 1 .*found '0 0'"),
    ("items: [", "line 2"),
])  # fmt: skip
def test_what_is_no_mission_is_refused_by_file_and_key(tmp_path, text, words):
    with pytest.raises(ParameterError, match=rf"--mission: .*mission\.yaml: .*{words}"):
        read_mission(written(tmp_path, text))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ParameterError, match=r"none\.yaml"):
        read_mission(str(tmp_path / "none.yaml"))
