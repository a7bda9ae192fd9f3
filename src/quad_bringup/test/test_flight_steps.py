"""Which bags open a step: the one before, passed, with this vehicle and these gains."""

import os
from types import SimpleNamespace

import pytest
import yaml

from quad_bringup import steps
from quad_bringup.steps import Prints
from quad_core.parameters import ParameterError
from quad_flight.set_up import Request, resolve_flight
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import COMMAND

OURS = Prints("vehicle", "gains")


@pytest.fixture
def bags(tmp_path, monkeypatch):
    """Return what makes a bag in ``flights``, each newer than the last, by its notes and what the judge says of it."""
    folder, said = tmp_path / "flights", {}
    folder.mkdir()

    def opened(path):
        noted, verdict, changed = said[path]
        if verdict == "cut":
            raise FlightLogError(f"{path}: cut")
        return SimpleNamespace(metadata=noted, verdict=verdict, changes=(1,) * changed)

    def make(name, step="bench", vehicle="vehicle", gains="gains", verdict="good", changed=False):
        noted = {"step": step, "step_vehicle": vehicle, "step_gains": gains}
        path = folder / name
        path.mkdir()
        text = yaml.safe_dump({"rosbag2_bagfile_information": {"custom_data": noted}})
        (path / "metadata.yaml").write_text(text, encoding="utf-8")
        os.utime(path / "metadata.yaml", (len(said), len(said)))
        said[path] = (noted, verdict, changed)
        return path

    monkeypatch.setattr(steps, "open_flight", opened)
    monkeypatch.setattr(steps, "measured", lambda flight: None)
    judged = lambda flight, metrics: SimpleNamespace(verdict=flight.verdict, text=f"Failed: {flight.verdict}")  # noqa: E731
    monkeypatch.setattr(steps, "judgement", judged)
    monkeypatch.setattr(steps, "recorded_parameters", lambda flight: {"a": SimpleNamespace(changes=flight.changes)})
    make.folder = folder
    return make


def test_the_newest_bag_that_passed_opens_the_next_step(bags):
    (bags.folder / "other").mkdir()
    (bags.folder / "other" / "metadata.yaml").write_text("- no bag", encoding="utf-8")
    bags("bench-1-1")
    passed = bags("bench-1-2")
    bags("hop-1-1", step="hop")
    bags("bench-1-3", verdict="tilt")
    assert steps.opening_bag("hop", OURS, [bags.folder]) == passed
    assert steps.opening_bag("bench", OURS, [bags.folder]) is None


@pytest.mark.parametrize(("bag", "why"), [
    ({"vehicle": "x"}, "bench-1-1: another vehicle"),
    ({"gains": "x"}, "bench-1-1: other gains"),
    ({"verdict": "tilt"}, "bench-1-1: Failed: tilt"),
    ({"verdict": "cut"}, "bench-1-1: cut"),
    ({"changed": True}, "bench-1-1: gains were changed in flight"),
    ({"step": "hop"}, "no bag of step bench in"),
    ({"step": "hover"}, "no bag of step bench in"),
])  # fmt: skip
def test_no_other_bag_opens_it_and_the_command_that_does_is_named(bags, monkeypatch, bag, why):
    bags("bench-1-1", **bag)
    monkeypatch.setenv(COMMAND, "scripts/fly --step hop --mission takeoff,land --out 'a b' --vehicle mine.yaml")
    with pytest.raises(ParameterError) as refused:
        steps.opening_bag("hop", OURS, [bags.folder])
    assert why in str(refused.value)
    assert str(refused.value).endswith("What opens it: scripts/fly --step bench --vehicle mine.yaml")


def test_a_bag_whose_metadata_was_written_anew_opens_nothing(bags):
    path = bags("bench-1-1", gains="x")
    text = (path / "metadata.yaml").read_text(encoding="utf-8").replace("gains: x", "gains: gains")
    (path / "metadata.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError, match="not those of its metadata"):
        steps.opening_bag("hop", OURS, [bags.folder])


@pytest.mark.parametrize(("settings", "is_vehicle", "is_gains"), [
    ((), True, True),
    (("vehicle.mass=0.57",), False, True),
    (("position_controller.aibs.limits.tilt=0.5",), True, False),
    (("attitude_controller.law=pid",), True, False),
    (("flight.plant_period=1000000",), True, False),
    (("simulator.guard.step.box=2.0", "commander.references.horizontal.speed=0.2", "flight.seed=4"), True, True),
])  # fmt: skip
def test_the_hashes_are_those_of_the_vehicle_and_of_the_gains(settings, is_vehicle, is_gains):
    def found(*more):
        return steps.prints(resolve_flight(Request("hover", mission="takeoff,land", settings=more), {}), "")

    usual, other = found(), found(*settings)
    assert (usual.vehicle == other.vehicle, usual.gains == other.gains) == (is_vehicle, is_gains)


def test_a_file_in_another_encoding_is_refused_by_name(tmp_path):
    nodes, file = resolve_flight(Request("hover"), {}), tmp_path / "airframe.yaml"
    file.write_bytes(b"a: 1  # 30 \xb0\n")
    with pytest.raises(ParameterError, match=r"airframe\.yaml: found .* at byte 11, expected UTF-8"):
        steps.prints(nodes, f"px4={file}")


def test_the_file_of_a_vehicle_interface_is_part_of_the_vehicle(tmp_path):
    nodes, file = resolve_flight(Request("hover"), {}), tmp_path / "airframe.yaml"
    found = set()
    for text in ("a: 1", "a: 2"):
        file.write_text(text, encoding="utf-8")
        found |= {steps.prints(nodes, f"{name}={file}").vehicle for name in ("px4", "mavlink")}
    found.add(steps.prints(nodes, "").vehicle)
    assert len(found) == 5
