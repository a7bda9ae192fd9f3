"""What other tools read from an export is what was recorded, digit for digit."""

import csv
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from quad_flight_log.errors import FlightLogError
from quad_flight_log.export import export
from quad_flight_log.reader import open_flight
from quad_report import cli

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


PAGE = Path(__file__).parents[3] / "docs" / "how_to" / "figures_and_tables.md"


def test_parquet_holds_the_bag_to_the_bit(flown, flown_bag, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    paths = export(open_flight(flown_bag), tmp_path, TOPICS, parquet=True)[0]
    assert [path.suffix for path in paths] == [".parquet"] * 4
    truth = parquet.read_table(paths[0])
    assert truth["p_w[1]"].to_numpy().tobytes() == flown.result.topics["truth"]["p_w"][:, 1].tobytes()
    assert truth["stamp_ns"].to_pylist() == flown.result.topics["truth"]["stamp_ns"].tolist()
    assert truth["on_ground"].type == "bool"
    assert parquet.read_table(paths[3])["role"].to_pylist() == list(flown.flight.resolved)


@pytest.fixture(scope="module")
def one_table(flown_bag, tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    for more in ([], ["--parquet"]):
        assert cli.main(["export", str(flown_bag), "--one-table", "--out", str(folder / "tables"), *more]) == 0
    return folder


def test_one_table_holds_each_value_until_the_next_to_the_bit(flown, one_table):
    rows = list(csv.DictReader((one_table / "tables" / "flight.csv").open()))
    truth, reference = flown.result.topics["truth"], flown.result.topics["reference"]
    assert [float(row["truth.p_w[2]"]) for row in rows] == truth["p_w"][:, 2].tolist()
    assert [float(row["t"]) for row in rows] == (truth["stamp_ns"] * 1e-9).tolist()
    held = dict(zip(reference["stamp_ns"].tolist(), reference["p_w"][:, 0].tolist(), strict=True))
    newest = [held[max(stamp for stamp in held if stamp <= now)] for now in truth["stamp_ns"].tolist()]
    assert [float(row["reference.p_w[0]"]) for row in rows] == newest


def lines_of(language):
    """Return the code of a language on the page, in the folder that it names."""
    return re.search(rf"```{language}\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]


def test_the_lines_for_pandas_read_both_files(flown, one_table, monkeypatch):
    pandas = pytest.importorskip("pandas")
    monkeypatch.chdir(one_table)
    found = {}
    exec(lines_of("python"), found)
    truth, reference = flown.result.topics["truth"], flown.result.topics["reference"]
    at_references = np.isin(truth["stamp_ns"], reference["stamp_ns"])
    assert 1 < at_references.sum() == len(reference) < len(truth)
    assert found["z"].tolist() == (truth["p_w"][at_references, 2] - reference["p_w"][:, 2]).tolist()
    again = pandas.read_parquet("tables/flight.parquet").set_index("t")[at_references]
    pandas.testing.assert_frame_equal(found["d"].astype(float), again, check_exact=True)


@pytest.mark.skipif(shutil.which("octave") is None, reason="no Octave is installed")
def test_the_lines_for_octave_read_the_file(flown, one_table):
    code = lines_of("matlab") + 'printf("%d %.17g", rows(d), z(1))'
    done = subprocess.run(
        ["octave", "-q", "--norc", "--eval", code], cwd=one_table, capture_output=True, text=True, check=True
    )
    truth, reference = flown.result.topics["truth"], flown.result.topics["reference"]
    count, first = done.stdout.split()
    assert (int(count), float(first)) == (len(reference), truth["p_w"][0, 2] - reference["p_w"][0, 2])
