"""What goes into a bag comes out of it: through our reader and through two readers that we did not write."""

from pathlib import Path

import flight_samples
import numpy as np
import pytest
import yaml

from quad_flight_log.errors import FlightLogError, TopicError
from quad_flight_log.reader import open_flight

STEPS = 60


@pytest.fixture(scope="module")
def flown():
    return flight_samples.samples(STEPS)


@pytest.fixture(scope="module")
def bag(flown, tmp_path_factory) -> Path:
    return flight_samples.write_bag(tmp_path_factory.mktemp("bags") / "flight", flown, pause_every=40)


def by_topic(flown):
    found = {}
    for index, (topic, sample) in enumerate(flown):
        found.setdefault(topic, []).append((index, sample))
    return found


def test_a_notebook_shows_what_was_noted_and_the_path(bag):
    html = open_flight(bag.parent)._repr_html_()
    assert "<td>flight</td>" in html
    assert "<th>seed</th><td>7</td>" in html
    assert html.count("<polyline") == 4


def test_bytes_and_times_are_exact(bag, flown):
    flight = open_flight(bag.parent)
    assert not flight.truncated
    expected = by_topic(flown)
    assert set(flight.topics) == set(expected)
    for topic, items in expected.items():
        payloads, log_times = flight.payloads(topic)[topic]
        assert payloads == [flight_samples.encoded(sample) for _, sample in items]
        assert log_times == [index * 1000 for index, _ in items]
        assert flight.topics[topic].messages == len(items)


def test_rosbags_reads_hashes_and_profiles(bag):
    from rosbags.rosbag2 import Reader

    with Reader(bag.parent) as reader:
        for connection in reader.connections:
            assert connection.digest == flight_samples.typestore().hash_rihs01(connection.msgtype)
            assert connection.ext.offered_qos_profiles


def test_metadata_yaml_is_rosbag2_version_9(bag, flown):
    information = yaml.safe_load((bag.parent / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["message_count"] == len(flown)
    assert information["relative_file_paths"] == [bag.name]
    assert information["duration"]["nanoseconds"] == (len(flown) - 1) * 1000
    assert information["custom_data"]["seed"] == "7"
    assert all(isinstance(value, str) for value in information["custom_data"].values())
    topic = information["topics_with_message_count"][0]["topic_metadata"]
    assert topic["offered_qos_profiles"][0]["reliability"] == "reliable"
    assert topic["type_description_hash"].startswith("RIHS01_")


def test_mcap_library_finds_chunks_and_summary(bag):
    from mcap.reader import make_reader

    with bag.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        times = [(message.log_time, message.publish_time) for _, _, message in reader.iter_messages()]
        assert times == [(index * 1000, index * 1000 + 7) for index in range(len(times))]
        summary = reader.get_summary()
        assert summary.statistics.chunk_count >= 2
        assert {index.compression for index in summary.chunk_indexes} == {"zstd"}
        assert {item.name for item in reader.iter_metadata()} == {"quad", "quad_end"}


def test_empty_directory_may_be_used_and_empty_bag_reads(tmp_path):
    (tmp_path / "empty").mkdir()
    path = flight_samples.write_bag(tmp_path / "empty", [])
    flight = open_flight(path.parent)
    assert flight.topics == {}
    assert flight.metadata["messages"] == "0"


def test_a_topic_of_another_namespace_names_the_option(tmp_path):
    path = flight_samples.write_bag(
        tmp_path / "one", [("/uav1/wrench", flight_samples.wrench(0, np.random.default_rng(3)))]
    )
    with pytest.raises(
        TopicError, match="no topic 'wrench' in namespace /; --namespace names another; the bag has /uav1/"
    ):
        open_flight(path).array("wrench")
    assert open_flight(path, namespace="uav1").has("wrench")


def test_memory_limit_is_kept(bag, monkeypatch):
    monkeypatch.setattr("quad_flight_log.reader.MEMORY_LIMIT", 100)
    with pytest.raises(FlightLogError, match="too large: found more than 100 bytes of payload"):
        open_flight(bag)
