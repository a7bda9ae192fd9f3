"""A whole flight read by three readers: equal counts and equal values on every topic."""

from pathlib import Path

import foreign_readers
import numpy as np
import pytest


@pytest.fixture(scope="module")
def seen(flown_bag) -> foreign_readers.Digests:
    return foreign_readers.ours(flown_bag)


def test_ours_has_every_message_that_was_sent(seen, flown):
    sent = foreign_readers.digests((f"/{topic.lstrip('/')}", sample) for topic, sample in flown.messages)
    assert seen == sent
    assert sum(count for count, _ in seen.values()) == len(flown.messages)


def test_rosbags_reads_the_same(seen, flown_bag):
    assert foreign_readers.by_rosbags(flown_bag) == seen


def test_mcap_ros2_support_reads_the_same(seen, flown_bag):
    assert foreign_readers.by_mcap_ros2(flown_bag) == seen


def test_evo_reads_the_trajectory(flown_bag, flown):
    from evo.tools import file_interface
    from rosbags.rosbag2 import Reader

    with Reader(Path(flown_bag)) as reader:
        path = file_interface.read_bag_trajectory(reader, "/odom")
    sent = [sample for topic, sample in flown.messages if topic == "odom"]
    assert path.num_poses == len(sent) > 10
    np.testing.assert_array_equal(path.positions_xyz[:, 2], [sample.pose.pose.position.z for sample in sent])
    np.testing.assert_array_equal(
        path.orientations_quat_wxyz[:, 0], [sample.pose.pose.orientation.w for sample in sent]
    )
    stamps = [sample.header.stamp.sec + sample.header.stamp.nanosec * 1e-9 for sample in sent]
    np.testing.assert_allclose(path.timestamps, stamps, atol=1e-9)
