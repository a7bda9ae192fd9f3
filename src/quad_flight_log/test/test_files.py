"""The files of a bag: split, compressed, SQLite, cut off, and what cannot be read."""

import other_recorders
import pytest
import zstandard

from quad_flight_log import cli
from quad_flight_log.bag.reader import open_flight
from quad_flight_log.errors import CorruptError, FlightLogError


def heights_of(path):
    return open_flight(path).array("pose")["pose"]["position"]["x"].tolist()


EXPECTED = [0.1 * index for index in range(20)]
READ = {
    "split in two": lambda where: other_recorders.split(where),
    "split in twelve": lambda where: other_recorders.split(where, 12),
    "split, without metadata.yaml": lambda where: other_recorders.split(where, 11, metadata=False),
    "compressed as a file": other_recorders.packed_file,
    "compressed message by message": other_recorders.packed_messages,
    "SQLite": other_recorders.sqlite,
    "SQLite in three files": lambda where: other_recorders.sqlite(where, 3),
    "SQLite, compressed as files": lambda where: other_recorders.sqlite(where, 2, packed=True),
}


@pytest.mark.parametrize("kind", READ)
def test_bags_of_rosbag2_are_read(kind, tmp_path, capsys):
    bag = READ[kind](tmp_path / "bag")
    assert heights_of(bag) == EXPECTED
    assert cli.main(["info", str(bag)]) == 0
    assert "/pose" in capsys.readouterr().out


def test_one_file_of_a_bag_is_read_by_itself(tmp_path):
    split = other_recorders.split(tmp_path / "bag")
    assert heights_of(split / "bag_1.mcap") == EXPECTED[10:]
    packed = other_recorders.packed_file(tmp_path / "packed")
    assert heights_of(packed / "packed_0.mcap.zstd") == EXPECTED
    assert heights_of(other_recorders.sqlite(tmp_path / "base") / "base_0.db3") == EXPECTED


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_another_compression_is_named_with_what_to_do(mode, tmp_path):
    bag = other_recorders.split(tmp_path / "bag")
    other_recorders.listed(bag, ["bag_0.mcap", "bag_1.mcap"], mode=mode, form="lz4")
    with pytest.raises(FlightLogError, match=f"'lz4'.*{mode}.*expected zstd or none.*ros2 bag convert"):
        open_flight(bag)


@pytest.mark.parametrize(("suffix", "name"), [("lz4", "lz4"), ("gz", "gzip"), ("xz", "xz")])
def test_a_file_packed_otherwise_is_named_with_what_to_do(suffix, name, tmp_path):
    path = other_recorders.mcap(tmp_path / f"bag_0.mcap.{suffix}")
    with pytest.raises(FlightLogError, match=f"compressed with {name}, expected zstd or none: unpack"):
        open_flight(path)


def test_a_missing_part_of_a_split_bag_is_said(tmp_path, capsys):
    bag = other_recorders.split(tmp_path / "bag", 3)
    (bag / "bag_1.mcap").unlink()
    flight = open_flight(bag)
    assert (flight.truncated, flight.damage) == (True, "bag_1.mcap is missing")
    assert cli.main(["info", str(bag)]) == 0
    assert "truncated: bag_1.mcap is missing" in capsys.readouterr().out


def test_two_bags_in_a_directory_ask_for_one(tmp_path):
    for name in ("one_0.mcap", "other_0.mcap"):
        other_recorders.mcap(tmp_path / name)
    with pytest.raises(FlightLogError, match=r"one_0\.mcap, other_0\.mcap; expected one bag, name the file"):
        open_flight(tmp_path)
    assert heights_of(tmp_path / "one_0.mcap") == EXPECTED
    (tmp_path / "other_0.mcap").rename(tmp_path / "._one_0.mcap")
    assert heights_of(tmp_path) == EXPECTED


def test_a_closed_and_an_unclosed_file_of_one_name_ask_for_one(tmp_path):
    path = other_recorders.mcap(tmp_path / "bag_0.mcap")
    (tmp_path / "bag_0.mcap.part").write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FlightLogError, match="name the file"):
        open_flight(tmp_path)


def test_a_cut_compressed_file_gives_what_comes_before_or_an_error(tmp_path):
    bag = other_recorders.packed_file(tmp_path / "bag")
    (path,) = bag.glob("*.zstd")
    data = path.read_bytes()
    for length in range(len(data)):
        path.write_bytes(data[:length])
        try:
            flight = open_flight(bag)
        except FlightLogError:
            continue
        assert flight.truncated
        rows = flight.array("pose")["pose"]["position"]["x"].tolist() if flight.has("pose") else []
        assert rows == EXPECTED[: len(rows)]


def test_a_damaged_sqlite_bag_is_an_error_that_names_it(tmp_path):
    bag = other_recorders.sqlite(tmp_path / "bag")
    (path,) = bag.glob("*.db3")
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(CorruptError, match="bag"):
        open_flight(bag)
    path.write_bytes(b"")
    with pytest.raises(CorruptError):
        open_flight(bag)


def test_a_compressed_file_that_is_no_mcap_is_named(tmp_path):
    path = tmp_path / "bag_0.mcap.zstd"
    path.write_bytes(zstandard.compress(b"no bag at all"))
    with pytest.raises(FlightLogError, match=r"bag_0\.mcap\.zstd"):
        open_flight(path)
