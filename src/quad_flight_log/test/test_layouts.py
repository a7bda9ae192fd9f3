"""The layouts of Foxglove and RViz show what a flight publishes."""

import json
import re

import yaml

from quad_flight_log.cli import main
from quad_flight_log.report.layouts import write_layouts
from quad_node import topics


def test_every_plotted_path_of_the_layout_is_a_number_of_its_message(tmp_path):
    panels = json.loads(write_layouts(tmp_path, "uav1")[0].read_text())["configById"]
    plotted = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    assert len(plotted) >= 14
    for text in plotted:
        topic, path = re.fullmatch(r"/uav1/([\w/]+)\.(.+)", text).groups()
        value = topics.TOPICS[topic].type()
        for name, index in re.findall(r"(\w+)(?:\[(\d)\])?", path):
            value = getattr(value, name)
            value = value[int(index)] if index else value
        assert float(value) == 0.0


def test_both_layouts_show_vehicle_and_reference_in_a_namespace(tmp_path, capsys):
    assert main(["view", "--namespace", "/second/", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "flight.json"), str(tmp_path / "flight.rviz")]
    layout = json.loads((tmp_path / "flight.json").read_text())
    displays = yaml.safe_load((tmp_path / "flight.rviz").read_text())["Visualization Manager"]["Displays"]
    expected = {"/second/pose", "/second/reference_pose", "/second/odom"}
    assert set(layout["configById"]["3D!space"]["topics"]) == expected
    assert {display["Topic"]["Value"] for display in displays if "Topic" in display} == expected
    placed = re.findall(r'"((?:Plot|3D)![^"]+)"', json.dumps(layout["layout"]))
    assert sorted(placed) == sorted(layout["configById"])
