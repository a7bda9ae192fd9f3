"""The room on the disk that arming looks at is that of the recording, wherever the commander itself was started."""

import shutil
from collections import namedtuple

import pytest

from quad_commander import preflight
from quad_commander.parameters import CommanderParameters
from quad_core.flight_parameters import FlightParameters
from quad_core.types import Quat, Vec3, VehicleState
from quad_msgs.msg import NodeStatus
from quad_node.responder import Sample

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


SAMPLE = Sample(500, 1_000_000_000, VehicleState(Vec3(), Vec3(), Quat(), Vec3()), 0.01)


@pytest.fixture
def looked_at():
    return preflight.Preflight(FlightParameters(run_id="a1"), CommanderParameters())


def seen(looked_at):
    return looked_at.observed(SAMPLE, 100, lambda _topic: 1, 40.0, None)


def test_who_names_no_run_is_nobody(looked_at):
    looked_at.on_node(NodeStatus(node="/x", role="recorder", state=NodeStatus.FAULT, period_steps=5))
    found = seen(looked_at)
    assert (found.run_ids, found.interface_hashes, found.faulty_nodes) == (("a1",), (), ())


def test_a_node_without_a_period_has_no_rate(looked_at):
    looked_at.on_node(NodeStatus(node="/x", role="position_controller", run_id="a1"))
    assert [stream.expected_rate for stream in seen(looked_at).streams] == [0.0, 0.0]
