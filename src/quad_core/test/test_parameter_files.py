"""Parameter files are read strictly: each error names file and place."""

from pathlib import Path

import pytest
import yaml

from quad_core.parameter_files import dump_yaml, overrides_for, read_parameter_file
from quad_core.parameters import ParameterError


def written(folder: Path, text: str) -> Path:
    path = folder / "flight.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_nested_and_dotted_names_mean_the_same(tmp_path):
    nested = "simulator:\n  ros__parameters:\n    vehicle: {mass: 0.6}\n    flight.seed: 3\n"
    assert read_parameter_file(written(tmp_path, nested)) == {"simulator": {"vehicle.mass": 0.6, "flight.seed": 3}}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("simulator:\n  ros__parameters:\n    a: 1\n    a: 2\n", ["line 4", "'a'", "twice"]),
        ("simulator:\n  ros__parameters:\n    a: {b: 1}\n    a.b: 2\n", ["a.b", "twice"]),
        ("simulater:\n  ros__parameters: {a: 1}\n", ["simulater", "simulator"]),
        ("simulator: {a: 1}\n", ["simulator", "ros__parameters"]),
        ("simulator:\n  ros__parameters: [1]\n", ["ros__parameters"]),
        ("simulator: [\n", ["line 2"]),
        ("- 1\n", ["list"]),
    ],
)
def test_what_rcl_would_swallow_is_an_error_with_a_place(tmp_path, text, words):
    with pytest.raises(ParameterError) as caught:
        read_parameter_file(written(tmp_path, text))
    assert all(word in str(caught.value) for word in ["flight.yaml", *words])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("simulator: " + "[" * 20_000, ["nested more than 40 deep"]),
        ("a: &x {b: 1}\nsimulator: *x\n", ["alias *x"]),
        ("#" * 2_000_000, ["2000000 characters"]),
    ],
)
def test_what_would_take_stack_or_memory_is_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "large.yaml"
    path.write_text(text)
    with pytest.raises(ParameterError, match=r"large\.yaml") as raised:
        read_parameter_file(path)
    assert all(word in str(raised.value) for word in words)
    assert "\n" not in str(raised.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ParameterError, match=r"gone\.yaml.*cannot be read"):
        read_parameter_file(tmp_path / "gone.yaml")


def test_an_empty_file_says_nothing(tmp_path):
    assert read_parameter_file(written(tmp_path, "")) == {}


def test_named_sections_win_over_wildcards_and_later_files_over_earlier():
    first = {"/**": {"flight.seed": 1, "vehicle.mass": 0.5}, "recorder": {"flight.seed": 2}}
    second = {"/one/recorder": {"vehicle.mass": 0.7}, "/two/recorder": {"vehicle.mass": 0.9}}
    assert overrides_for([first, second], "recorder", "/one") == {"flight.seed": 2, "vehicle.mass": 0.7}
    assert overrides_for([first, second], "simulator", "/one") == {"flight.seed": 1, "vehicle.mass": 0.5}


def test_what_is_written_is_what_pyyaml_writes_and_reads():
    content = {
        "/simulator": {"ros__parameters": {"a.b": 0.1, "c": "1e5", "d": True, "e": [], "f": "x: y\nz", "g": 1e-9}}
    }
    assert dump_yaml(content) == yaml.safe_dump(content, sort_keys=False)
    assert yaml.safe_load(dump_yaml(content)) == content
