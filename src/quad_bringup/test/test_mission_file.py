"""A mission from a file is the one of the command line, with its trajectory's parameters."""

import pytest

from quad_bringup.mission_file import read_mission
from quad_core.parameters import ParameterError

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
