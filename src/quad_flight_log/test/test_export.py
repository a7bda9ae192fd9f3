"""What other tools read from an export is what was recorded, digit for digit."""

import csv
import json

import numpy as np
import pytest

from quad_flight_log import cli
from quad_flight_log.bag.export import export
from quad_flight_log.bag.reader import open_flight
from quad_flight_log.errors import FlightLogError

TOPICS = ["truth", "wrench_setpoint", "attitude_controller/internals", "flight/parameters"]


def test_csv_keeps_every_digit(flown, flown_bag, tmp_path):
    paths = export(open_flight(flown_bag), tmp_path, [*TOPICS, "/truth"])[0]
    assert [path.name for path in paths] == [
        "truth.csv", "wrench_setpoint.csv", "attitude_controller.internals.csv", "flight.parameters.csv",
    ]  # fmt: skip
    rows = list(csv.DictReader(paths[0].open()))
    truth = flown.result.topics["truth"]
    np.testing.assert_array_equal([float(row["p_w[2]"]) for row in rows], truth["p_w"][:, 2])
    np.testing.assert_array_equal([int(row["stamp_ns"]) for row in rows], truth["stamp_ns"])
    wrench = list(csv.DictReader(paths[1].open()))
    np.testing.assert_array_equal(
        [float(row["wrench.torque.y"]) for row in wrench], flown.result.topics["wrench_setpoint"]["torque_b"][:, 1]
    )
    assert {row["header.frame_id"] for row in wrench} == {"base_link"}
    inside = list(csv.DictReader(paths[2].open()))
    assert {row["torque_limited[0]"] for row in inside} <= {"True", "False"}
    assert {row["extra"] for row in inside} == {"[]"}
    said = list(csv.DictReader(paths[3].open()))
    assert [row["role"] for row in said] == list(flown.flight.resolved)
    assert json.loads(said[0]["internals_names"]) == []


def test_the_verb_names_its_files_and_never_overwrites(flown_bag, tmp_path, capsys):
    arguments = ["export", str(flown_bag), "--topic", "reference", "--out", str(tmp_path)]
    assert cli.main(arguments) == 0
    assert capsys.readouterr().out == f"{tmp_path}/reference.csv\n"
    assert cli.main(arguments) == 2
    assert "never overwrites" in capsys.readouterr().err
    with pytest.raises(FlightLogError, match=r"reference\.csv"):
        export(open_flight(flown_bag), tmp_path, ["reference"])
