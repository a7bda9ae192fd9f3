"""Tables of messages: their columns; test_foreign_readers compares all values."""

import flight_samples

from quad_flight_log.messages import flat_columns, message_type


def test_empty_tables_have_the_columns_of_the_type():
    name = "geometry_msgs/msg/WrenchStamped"
    kind = message_type(name, flight_samples.definition(name).text)
    assert [name for name, _ in flat_columns(kind.table([], [], "test"))] == [
        "log_ns", "stamp_ns", "header.stamp.sec", "header.stamp.nanosec", "header.frame_id",
        "wrench.force.x", "wrench.force.y", "wrench.force.z",
        "wrench.torque.x", "wrench.torque.y", "wrench.torque.z",
    ]  # fmt: skip
