"""What a bag says of where it came from."""

import subprocess
from datetime import datetime

from quad_flight_log.notes import COMMAND, LIMITS, flight_metadata, git_commit


def test_the_command_is_noted_where_it_is_known(monkeypatch):
    monkeypatch.setenv(COMMAND, "scripts/fly case1 --seed 7")
    found = flight_metadata({"seed": 7}, {"stack": "1.2"})
    assert found["command"] == "scripts/fly case1 --seed 7"
    assert found["seed"] == "7"
    assert found["version.stack"] == "1.2"
    assert datetime.fromisoformat(found["started"]).utcoffset().total_seconds() == 0.0
    monkeypatch.delenv(COMMAND)
    assert "command" not in flight_metadata({}, {})


def test_the_limits_of_the_flight_are_noted(monkeypatch):
    monkeypatch.setenv(LIMITS, "position_rmse=0.02,settling_time=5.0")
    found = flight_metadata({}, {})
    assert (found["limit.position_rmse"], found["limit.settling_time"]) == ("0.02", "5.0")
    monkeypatch.setenv(LIMITS, "")
    assert not any(name.startswith("limit.") for name in flight_metadata({}, {}))


def test_the_commit_of_the_sources_is_noted(tmp_path):
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
