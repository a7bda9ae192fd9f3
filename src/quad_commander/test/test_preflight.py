"""The room on the disk that arming looks at is that of the recording, wherever the commander itself was started."""

import shutil
from collections import namedtuple

import pytest

from quad_commander import preflight

Usage = namedtuple("Usage", "free")


@pytest.fixture
def disks(monkeypatch, tmp_path):
    """Return a folder whose disk has 40 GB free; every other one has 0.5 GB."""
    card = tmp_path / "card"
    card.mkdir()
    monkeypatch.setattr(
        shutil, "disk_usage", lambda place: Usage(40_000_000_000 if card in (place, *place.parents) else 500_000_000)
    )
    monkeypatch.chdir(tmp_path)
    return card


def test_the_disk_of_the_recording_counts(disks):
    (disks / "flights").mkdir()
    assert preflight.free_space(str(disks / "flights")) == 40.0


def test_a_folder_that_is_still_to_be_made_lies_where_its_nearest_parent_does(disks):
    assert preflight.free_space(str(disks / "2026" / "bag")) == 40.0
    assert preflight.free_space("elsewhere/bag") == 0.5


def test_without_a_name_it_is_the_folder_in_which_the_node_runs(disks, monkeypatch):
    assert preflight.free_space("") == 0.5
    monkeypatch.chdir(disks)
    assert preflight.free_space("") == 40.0
