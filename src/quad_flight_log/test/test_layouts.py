"""The layouts for Foxglove, PlotJuggler and RViz name topics and fields that a flight has."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import yaml

from quad_flight_log.messages import flat_columns
from quad_flight_log.reader import open_flight

LAYOUTS = Path(__file__).parents[3] / "examples" / "layouts"


def test_every_curve_is_a_field_of_a_bag(flown_bag):
    panels = json.loads((LAYOUTS / "foxglove.json").read_text())["configById"].values()
    asked = {path["value"] for panel in panels for path in panel.get("paths", ())}
    curves = ElementTree.parse(LAYOUTS / "plotjuggler.xml").iter("curve")
    named = {curve.get("name") for curve in curves}
    assert {re.sub(r"(?<!^)/", ".", name) for name in named} == asked, "both show the same"
    flight = open_flight(flown_bag)
    for path in asked:
        topic, _, field = path.partition(".")
        assert field in dict(flat_columns(flight.array(topic))), path


def test_rviz_shows_vehicle_and_reference():
    displays = yaml.safe_load((LAYOUTS / "flight.rviz").read_text())["Visualization Manager"]["Displays"]
    topics = {display["Topic"]["Value"] for display in displays if "Topic" in display}
    assert topics == {"/pose", "/reference_pose", "/odom"}
