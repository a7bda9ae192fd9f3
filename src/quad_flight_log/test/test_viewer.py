"""The Rerun recording of a bag holds the flight's numbers, read back by Rerun's own reader."""

import sys

import drawn_flights
import numpy as np
import pytest
from drawn_flights import OFFSET

from quad_flight_log.cli import main
from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.rerun_command import viewer_command
from quad_flight_log.report.rerun_recording import TIMELINE, held_at, paced, write_recording
from quad_flight_log.report.run import run_from_tables
from quad_flight_log.report.vehicle_drawing import DISTURBANCE_SCALE, THRUST_SCALE, rgb

chunk = pytest.importorskip("rerun.chunk")


def columns(path):
    """Return {entity: {column: list}}, static parts merged in."""
    found = {}
    for part in chunk.RrdReader(str(path)).stream():
        batch = part.to_record_batch()
        names = [name for name in batch.schema.names if not name.startswith("rerun.controls")]
        found.setdefault(part.entity_path, {}).update({name: batch.column(name) for name in names})
    return found


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "flight.rrd"
    write_recording(drawn_flights.run("circle", steps=600), path, [(0.25, "/simulator: wind: gust")])
    return columns(path)


def values(column):
    return np.array(column.to_pylist(), dtype=float)


def seconds(column):
    return np.array([value.total_seconds() for value in column.to_pylist()])


def test_poses_are_those_of_the_flight_at_50_hz(recorded):
    vehicle = recorded["/world/vehicle"]
    assert seconds(vehicle[TIMELINE])[:3].tolist() == [0.0, 0.02, 0.04]
    expected = (drawn_flights.circle(600) + OFFSET)[::2]
    np.testing.assert_allclose(values(vehicle["Transform3D:translation"])[:, 0], expected, atol=1e-6)


def test_arrows_have_the_stated_lengths(recorded):
    thrust = values(recorded["/world/vehicle/thrust"]["Arrows3D:vectors"])[:, 0]
    np.testing.assert_allclose(thrust, [[0.0, 0.0, THRUST_SCALE * 5.25]] * 300, rtol=1e-6)
    wind = values(recorded["/world/disturbance"]["Arrows3D:vectors"])[:, 0]
    np.testing.assert_allclose(wind, [[DISTURBANCE_SCALE * 0.25] * 3] * 300, rtol=1e-6)


def test_curves_are_on_the_clock_of_the_flight(recorded):
    error = recorded["/error/y"]
    np.testing.assert_allclose(values(error["Scalars:scalars"])[:, 0], OFFSET[1], atol=1e-12)
    assert seconds(error[TIMELINE])[[0, -1]].tolist() == [0.0, 5.99]
    np.testing.assert_allclose(values(recorded["/attitude/yaw"]["Scalars:scalars"]), drawn_flights.YAW_ERROR)
    assert values(recorded["/thrust/commanded"]["Scalars:scalars"])[0, 0] == 5.5
    assert recorded["/events"]["TextLog:text"].to_pylist() == [["/simulator: wind: gust"]]


def test_a_bag_is_recorded_and_nothing_is_opened(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("subprocess.run", lambda *_, **__: pytest.fail("a viewer was started"))
    bag, path = drawn_flights.bag(tmp_path / "bag"), tmp_path / "out" / "a.rrd"
    assert main(["view", str(bag), "--save", str(path)]) == 0
    assert capsys.readouterr().out.strip() == str(path)
    assert columns(path)["/world/vehicle"][TIMELINE].to_pylist()[-1].total_seconds() == pytest.approx(1.18)


@pytest.mark.parametrize("arguments", [[], ["a", "b"], ["a", "--live"]])
def test_one_bag_or_live(arguments, capsys):
    assert main(["view", *arguments]) == 2
    assert "one BAG or --live" in capsys.readouterr().err


def test_without_ros_there_is_no_live_view(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "quad_flight_log.live.node", None)
    assert main(["view", "--live"]) == 2
    assert "--live needs ROS 2" in capsys.readouterr().err


def test_the_viewer_listens_to_this_machine_only():
    for web in (False, True):
        command = viewer_command("a.rrd", web=web)
        assert command[command.index("--bind") + 1] == "127.0.0.1"
        assert ("--web-viewer" in command) == web
        assert command[-1] == "a.rrd"


def test_without_truth_or_room_there_is_a_clear_error(tmp_path):
    with pytest.raises(FlightLogError, match="'truth'"):
        write_recording(run_from_tables("a", "", {}), tmp_path / "a.rrd")
    (tmp_path / "file").write_text("")
    with pytest.raises(FlightLogError, match="file"):
        write_recording(drawn_flights.run("a"), tmp_path / "file" / "a.rrd")


def test_rows_that_hold_at_an_instant():
    table = np.array([(10, 1.0), (20, 2.0)], [("stamp_ns", "i8"), ("value", "f8")])
    assert held_at(table, np.array([5, 10, 19, 20, 99]))["value"].tolist() == [1.0, 1.0, 1.0, 2.0, 2.0]
    assert paced(np.arange(0, 100, 7) * 1_000_000, 0.02).tolist() == [0, 3, 6, 9, 12]
    assert rgb("#0180ff") == (1, 128, 255)
