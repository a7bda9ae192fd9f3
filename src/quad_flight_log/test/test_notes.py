"""What a bag says of itself: QoS, sealed records."""

import pytest
import yaml

from quad_flight_log.bag.notes import Qos, as_yaml, opened_notes, sealed_notes


def test_qos_is_written_as_rosbag2_writes_it_and_read_back():
    profile = Qos(3, "best_effort", "transient_local", "keep_all")
    (written,) = yaml.safe_load(as_yaml([profile.as_dict()]))
    assert written["reliability"] == "best_effort"
    assert written["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    assert set(written) == {
        "history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness",
        "liveliness_lease_duration", "avoid_ros_namespace_conventions",
    }  # fmt: skip


def test_sealed_notes_notice_every_change():
    sealed = sealed_notes({"seed": "7", "run_id": "a"}, b"a: 1")
    assert opened_notes(sealed, b"a: 1", strict=True) == {"seed": "7", "run_id": "a"}
    for change in ({"seed": "8"}, {"more": "x"}, {"sha256": "0" * 64}):
        with pytest.raises(ValueError, match="digest"):
            opened_notes({**sealed, **change}, b"", strict=False)
    with pytest.raises(ValueError, match="attached parameters"):
        opened_notes(sealed, b"a: 2", strict=True)
    bare = {"seed": "7"}
    assert opened_notes(bare, b"", strict=False) == bare
    with pytest.raises(ValueError, match="digest"):
        opened_notes(bare, b"", strict=True)
