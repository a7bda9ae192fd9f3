"""What a bag says of itself: QoS, sealed records, where the flight came from."""

import subprocess

import pytest
import yaml

from quad_flight_log.bag.notes import Qos, opened_notes, qos_of, qos_text, sealed_notes
from quad_flight_log.recorder.provenance import flight_metadata, git_commit


def test_qos_is_written_as_rosbag2_writes_it_and_read_back():
    profile = Qos(3, "best_effort", "transient_local", "keep_all")
    (written,) = yaml.safe_load(qos_text(profile))
    assert written["reliability"] == "best_effort"
    assert written["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    assert set(written) == {
        "history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness",
        "liveliness_lease_duration", "avoid_ros_namespace_conventions",
    }  # fmt: skip
    assert qos_of(qos_text(profile)) == profile


@pytest.mark.parametrize("text", ["", "[]", "nonsense", "[1]", "- {depth: many}", "{", "- {history: keep_last}"])
def test_qos_that_cannot_be_read_is_the_default(text):
    assert qos_of(text) == Qos()


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


def test_a_flight_knows_commit_seed_and_versions(tmp_path):
    def git(*arguments):
        about = ("-c", "user.name=x", "-c", "user.email=x@example.org")
        subprocess.run(["git", "-C", str(tmp_path), *about, *arguments], check=True, capture_output=True)

    assert git_commit(tmp_path) == ""
    git("init", "-q")
    (tmp_path / "law.py").write_text("gain = 1\n")
    git("add", ".")
    git("commit", "-qm", "first")
    head = (tmp_path / ".git" / "HEAD").read_text().split()[1]
    commit = (tmp_path / ".git" / head).read_text().strip()
    assert git_commit(tmp_path) == commit
    (tmp_path / "law.py").write_text("gain = 2\n")
    assert git_commit(tmp_path) == f"{commit}-dirty"
    notes = flight_metadata({"seed": 7}, {"numpy": "2"})
    assert notes["seed"] == "7"
    assert notes["version.numpy"] == "2"
    assert notes["started"].endswith("+00:00")
