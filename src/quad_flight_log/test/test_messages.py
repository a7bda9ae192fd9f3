"""Tables of messages: their columns, and what of a payload is hashed; test_foreign_readers compares all values."""

import dataclasses

import flight_samples
import numpy as np
import pytest

from quad_flight_log.bag.messages import flat_columns, message_type


def test_empty_tables_have_the_columns_of_the_type():
    name = "geometry_msgs/msg/WrenchStamped"
    kind = message_type(name, flight_samples.definition(name).text)
    assert [name for name, _ in flat_columns(kind.table([], [], "test"))] == [
        "log_ns", "stamp_ns", "header.stamp.sec", "header.stamp.nanosec", "header.frame_id",
        "wrench.force.x", "wrench.force.y", "wrench.force.z",
        "wrench.torque.x", "wrench.torque.y", "wrench.torque.z",
    ]  # fmt: skip


@pytest.mark.parametrize("sample", [flight_samples.state, flight_samples.internals])
def test_the_number_of_the_run_is_masked_and_nothing_else(sample):
    rng = np.random.default_rng(4)
    one, other = sample(3, rng), sample(4, rng)
    name = one.__msgtype__
    kind = message_type(name, flight_samples.definition(name).text)
    same = dataclasses.replace(one, run=7)
    payloads = [flight_samples.encoded(message) for message in (one, same, other)]
    hashed = [kind.hashed(payload) for payload in payloads]
    assert hashed[0] == hashed[1] != hashed[2]
    assert payloads[0] != payloads[1]
    at = 4 + 8 + 8  # encapsulation, stamp, step
    assert hashed[1] == payloads[1][:at] + bytes(4) + payloads[1][at + 4 :]
