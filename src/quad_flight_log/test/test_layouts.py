"""Every path in the layouts leads to a number of the installed message: checked on message objects."""

import json
import re

import pytest
import yaml
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry

from quad_flight_log.cli import main
from quad_flight_log.errors import SchemaError
from quad_flight_log.report.layouts import layout_files, numbers, tabs
from quad_node.topics import TOPICS


def number_at(topic, path):
    """Return the number at ``path`` of a blank message of ``topic``."""
    value = TOPICS[topic].type()
    for word in re.split(r"[./]", path):
        name, _, index = word.partition("[")
        value = getattr(value, name)
        value = value[int(index.rstrip("]"))] if index else value
    return value


def longest_topic(text):
    """Return (topic, rest) of a full path, the topic as long as possible."""
    topic = max((name for name in TOPICS if text.lstrip("/").startswith(name)), key=len)
    return topic, text.lstrip("/")[len(topic) + 1 :]


def plotted():
    panels = json.loads(layout_files()["flight.json"])["configById"]
    return [path["value"] for panel in panels.values() for path in panel.get("paths", [])]


def test_every_path_leads_to_a_number():
    found = plotted()
    assert len(found) > 150
    for text in found:
        value = number_at(*longest_topic(text))
        assert float(value) == 0.0 or text.endswith(("q_wb[3]", "orientation.w"))
        assert not isinstance(value, str | Time)


def test_rviz_shows_what_the_markers_node_publishes():
    displays = yaml.safe_load(layout_files("uav1")["flight.rviz"])["Visualization Manager"]["Displays"]
    topics = {display["Topic"]["Value"] for display in displays if "Topic" in display}
    assert topics == {"/uav1/markers", "/uav1/pose", "/uav1/odom"}
    assert "rviz_default_plugins/TF" in {display["Class"] for display in displays}


def test_no_quantity_of_a_step_topic_is_missing():
    foxglove = plotted()
    for topic in TOPICS.values():
        if not topic.step or topic.name == "wrench_setpoint":
            continue
        for field, kind in topic.type.get_fields_and_field_types().items():
            plain = re.match(r"(?:double|boolean)(?:\[\d+\])?$", kind)
            if plain:
                assert any(re.match(rf"/{topic.name}\.{field}(\[|$)", path) for path in foxglove), (topic.name, field)


def test_every_panel_is_placed_once():
    layout = json.loads(layout_files()["flight.json"])
    placed = []

    def walk(node):
        if isinstance(node, str):
            placed.append(node)
            for tab in layout["configById"][node].get("tabs", []):
                walk(tab["layout"])
        else:
            walk(node["first"])
            walk(node["second"])

    walk(layout["layout"])
    assert sorted(placed) == sorted(layout["configById"])
    assert set(layout) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}


def test_a_namespace_is_in_front_of_every_topic(tmp_path, capsys):
    assert main(["layouts", "--namespace", "/second/", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "flight.json"), str(tmp_path / "flight.rviz")]
    panels = json.loads((tmp_path / "flight.json").read_text())["configById"]
    values = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    assert all(value.startswith("/second/") for value in values)
    assert set(panels["3D!space"]["topics"]) == {"/second/markers", "/second/pose", "/second/odom"}


def test_a_field_that_is_gone_is_named():
    with pytest.raises(SchemaError, match=r"reference.*p_w\[0\]"):
        tabs({"reference": Time})
    with pytest.raises(SchemaError, match="no topic 'reference'"):
        tabs({})


def test_numbers_of_nested_and_repeated_fields():
    found = {name: paths for name, paths, _ in numbers(Odometry)}
    assert found["twist"][:3] == ["twist.twist.linear.x", "twist.twist.linear.y", "twist.twist.linear.z"]
    assert len(found["pose"]) == 7 + 36
    assert "child_frame_id" not in found
