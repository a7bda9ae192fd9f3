"""RViz shows what a flight publishes."""

import yaml

from quad_flight_log.cli import main


def test_rviz_shows_vehicle_and_reference_in_a_namespace(tmp_path, capsys):
    assert main(["view", "--namespace", "/second/", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "flight.rviz")]
    displays = yaml.safe_load((tmp_path / "flight.rviz").read_text())["Visualization Manager"]["Displays"]
    topics = {display["Topic"]["Value"] for display in displays if "Topic" in display}
    assert topics == {"/second/pose", "/second/reference_pose", "/second/odom"}
