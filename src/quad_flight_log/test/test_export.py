"""What other tools read from an export is what was recorded, digit for digit."""

import csv
import json
import tracemalloc

import flight_samples
import numpy as np
import pytest

from quad_flight_log import cli
from quad_flight_log.bag.export import ExportError, export
from quad_flight_log.bag.reader import open_flight
from quad_flight_log.bag.writer import BagWriter

TOPICS = ["truth", "wrench_setpoint", "attitude_controller/internals", "flight/parameters"]


def test_csv_keeps_every_digit(flown, flown_bag, tmp_path):
    paths = export(open_flight(flown_bag), tmp_path, "csv", TOPICS).paths
    assert [path.name for path in paths] == [
        "truth.csv", "wrench_setpoint.csv", "attitude_controller_internals.csv", "flight_parameters.csv",
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


def test_parquet_keeps_values_and_types(flown, flown_bag, tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    paths = export(open_flight(flown_bag), tmp_path, "parquet", TOPICS).paths
    truth = pq.read_table(paths[0])
    np.testing.assert_array_equal(truth["q_wb[3]"].to_numpy(), flown.result.topics["truth"]["q_wb"][:, 3])
    assert truth.schema.field("step").type == pa.uint64()
    inside = pq.read_table(paths[2])
    assert inside.schema.field("extra").type == pa.list_(pa.float64())
    assert inside.schema.field("torque_limited[1]").type == pa.bool_()


def test_the_verb_names_its_files_and_never_overwrites(flown_bag, tmp_path, capsys):
    arguments = ["export", str(flown_bag), "--topic", "reference", "--out", str(tmp_path)]
    assert cli.main(arguments) == 0
    assert capsys.readouterr().out == f"{tmp_path}/reference.csv\n"
    assert cli.main(arguments) == 2
    assert "never overwrites" in capsys.readouterr().err
    with pytest.raises(ExportError, match=r"reference\.csv"):
        export(open_flight(flown_bag), tmp_path, "csv", ["reference"])


def test_blocks_make_the_whole(flown_bag):
    flight = open_flight(flown_bag)
    blocks = list(flight.batches("truth", "attitude_controller/internals", limit=20_000))
    assert len(blocks) > 10
    for topic in ("truth", "attitude_controller/internals"):
        parts = [table for name, table in blocks if name == topic]
        whole = flight.array(topic)
        assert sum(len(part) for part in parts) == len(whole)
        for name in ("stamp_ns", "step"):
            np.testing.assert_array_equal(np.concatenate([part[name] for part in parts]), whole[name])


def test_reading_in_blocks_takes_bounded_memory(tmp_path, monkeypatch):
    monkeypatch.setattr("quad_flight_log.bag.reader.KEPT", 1000)
    bag = BagWriter(tmp_path / "bag")
    topic = bag.add_topic("/state", flight_samples.definition("quad_msgs/msg/VehicleState"))
    payload = flight_samples.encoded(flight_samples.state(1, np.random.default_rng(1)))
    for index in range(40_000):
        bag.write(topic, payload, index)
    path = bag.close().path
    size = 40_000 * len(payload)

    def peak(read) -> int:
        flight = open_flight(path)
        tracemalloc.start()
        read(flight)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    assert peak(lambda flight: [len(table) for _, table in flight.batches("state", limit=50_000)]) < size / 4
    assert peak(lambda flight: flight.array("state")) > size
    assert peak(lambda flight: sum(1 for _ in flight.messages())) < size / 4
