"""The files of a bag: split, compressed, SQLite, cut off, and what cannot be read."""

from functools import partial

import pytest
import zstandard
from other_recorders import in_one_file, listed, poses, rosbag, split, split_sqlite, sqlite
from rosbags.rosbag2 import CompressionMode

from quad_flight_log.errors import CorruptError, FlightLogError
from quad_flight_log.reader import open_flight
from quad_report import cli


def heights_of(path):
    return open_flight(path).array("pose")["pose"]["position"]["x"].tolist()


EXPECTED = [0.1 * index for index in range(20)]
FILE, MESSAGE = CompressionMode.FILE, CompressionMode.MESSAGE
READ = {
    "split in two": split,
    "split in twelve": partial(split, parts=12),
    "split, without metadata.yaml": partial(split, parts=11, metadata=False),
    "compressed as a file": partial(rosbag, mode=FILE),
    "compressed message by message": partial(rosbag, mode=MESSAGE),
    "SQLite": sqlite,
    "SQLite in two files": split_sqlite,
    "SQLite, compressed as a file": partial(sqlite, mode=FILE),
}


@pytest.mark.parametrize("kind", READ)
def test_bags_of_rosbag2_are_read(kind, tmp_path, capsys):
    bag = READ[kind](tmp_path / "bag", poses())
    assert heights_of(bag) == EXPECTED
    assert cli.main(["info", str(bag)]) == 0
    assert "/pose" in capsys.readouterr().out


def test_one_file_of_a_bag_is_read_by_itself(tmp_path):
    assert heights_of(split(tmp_path / "bag", poses()) / "bag_1.mcap") == EXPECTED[10:]
    assert heights_of(rosbag(tmp_path / "packed", poses(), mode=FILE) / "packed.mcap.zstd") == EXPECTED
    assert heights_of(sqlite(tmp_path / "base", poses()) / "base.db3") == EXPECTED


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_another_compression_is_named_with_what_to_do(mode, tmp_path):
    bag = split(tmp_path / "bag", poses())
    listed(bag, ["bag_0.mcap", "bag_1.mcap"], mode=mode, form="lz4")
    with pytest.raises(FlightLogError, match=f"'lz4'.*{mode}.*expected zstd or none.*ros2 bag convert"):
        open_flight(bag)


@pytest.mark.parametrize(("suffix", "name"), [("lz4", "lz4"), ("gz", "gzip"), ("xz", "xz")])
def test_a_file_packed_otherwise_is_named_with_what_to_do(suffix, name, tmp_path):
    path = in_one_file(tmp_path / f"bag_0.mcap.{suffix}", poses())
    with pytest.raises(FlightLogError, match=f"compressed with {name}, expected zstd or none: unpack"):
        open_flight(path)


def test_a_missing_part_of_a_split_bag_is_said(tmp_path, capsys):
    bag = split(tmp_path / "bag", poses(), 3)
    (bag / "bag_1.mcap").unlink()
    flight = open_flight(bag)
    assert (flight.truncated, flight.damage) == (True, "bag_1.mcap is missing")
    assert cli.main(["info", str(bag)]) == 0
    assert "truncated: bag_1.mcap is missing" in capsys.readouterr().out


@pytest.mark.parametrize("names", [("one_0.mcap", "other_0.mcap"), ("bag_0.mcap", "bag_0.mcap.part")])
def test_two_bags_in_a_directory_ask_for_one(names, tmp_path):
    for name in names:
        in_one_file(tmp_path / name, poses())
    with pytest.raises(FlightLogError, match="expected one bag, name the file"):
        open_flight(tmp_path)
    assert heights_of(tmp_path / names[0]) == EXPECTED
    (tmp_path / names[1]).rename(tmp_path / f"._{names[0]}")  # what a Mac leaves
    assert heights_of(tmp_path) == EXPECTED


def test_a_cut_compressed_file_gives_what_comes_before_or_an_error(tmp_path):
    bag = rosbag(tmp_path / "bag", poses(), mode=FILE)
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


@pytest.mark.parametrize("kept", [3000, 0])
def test_a_damaged_sqlite_bag_is_an_error_that_names_it(kept, tmp_path):
    (path,) = sqlite(tmp_path / "bag", poses()).glob("*.db3")
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(CorruptError, match="bag"):
        open_flight(path.parent)


def test_a_compressed_file_that_is_no_mcap_is_named(tmp_path):
    path = tmp_path / "bag_0.mcap.zstd"
    path.write_bytes(zstandard.compress(b"no bag at all"))
    with pytest.raises(FlightLogError, match=r"bag_0\.mcap\.zstd"):
        open_flight(path)
