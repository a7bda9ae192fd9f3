"""Parameter files are read strictly: each error names file and place."""

import math
import re
from pathlib import Path

import pytest
import yaml

from quad_core.parameter_files import check_reached, dump_yaml, overrides_for, reaches, read_parameter_file
from quad_core.parameters import ParameterError


def written(folder: Path, text: str) -> Path:
    path = folder / "flight.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_nested_and_dotted_names_mean_the_same(tmp_path):
    nested = "simulator:\n  ros__parameters:\n    vehicle: {mass: 0.6}\n    flight.seed: 3\n"
    assert read_parameter_file(written(tmp_path, nested)) == {"simulator": {"vehicle.mass": 0.6, "flight.seed": 3}}


@pytest.mark.parametrize(("text", "words"), [
    ("simulator:\n  ros__parameters:\n    a: 1\n    a: 2\n", ["line 4", "'a'", "twice"]),
    ("simulator:\n  ros__parameters:\n    a: {b: 1}\n    a.b: 2\n", ["a.b", "twice"]),
    ("simulater:\n  ros__parameters: {a: 1}\n", ["simulater", "simulator"]),
    ("simulator: {a: 1}\n", ["simulator", "ros__parameters"]),
    ("simulator:\n  ros__parameters: [1]\n", ["ros__parameters"]),
    ("simulator: [\n", ["line 2"]),
    ("- 1\n", ["list"]),
])  # fmt: skip
def test_what_rcl_would_swallow_is_an_error_with_a_place(tmp_path, text, words):
    with pytest.raises(ParameterError) as caught:
        read_parameter_file(written(tmp_path, text))
    assert all(word in str(caught.value) for word in ["flight.yaml", *words])


@pytest.mark.parametrize(("text", "words"), [
    ("simulator: " + "[" * 20_000, ["nested more than 40 deep"]),
    ("a: &x {b: 1}\nsimulator: *x\n", ["alias *x"]),
    ("#" * 2_000_000, ["2000000 characters"]),
])  # fmt: skip
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


TEXT = "/**:\n  ros__parameters:\n    # Größe\n    a: 1\n"


@pytest.mark.parametrize(("data", "words"), [
    (TEXT.encode("latin-1"), "line 3: found the byte 0xf6, as Latin-1 has it, expected UTF-8: save"),
    (TEXT.encode("utf-16"), "found UTF-16, expected UTF-8"),
    (TEXT.encode("utf-16-le"), "found UTF-16, expected UTF-8"),
    (TEXT.replace("    a", "\ta").encode(), "line 4: found a tab, expected blanks"),
    (TEXT.encode("utf-32"), "found UTF-32, expected UTF-8"),
    (TEXT.encode("utf-32-be"), "found UTF-32, expected UTF-8"),
    (TEXT.replace("  ros", "\tros").encode(), "line 2: found a tab, expected blanks"),
    (TEXT.replace("    a", "\xa0\xa0  a").encode(), "line 4: found the blank U+00A0, expected U+0020"),
    (TEXT.replace("  ros", " \u3000ros").encode(), "line 2: found the blank U+3000, expected U+0020"),
    (TEXT.replace("    a", "   \u200b a").encode(), "line 4: found the blank U+200B, expected U+0020"),
])  # fmt: skip
def test_an_encoding_or_an_indent_that_is_none_is_named_with_what_to_do(tmp_path, data, words):
    path = tmp_path / "flight.yaml"
    path.write_bytes(data)
    with pytest.raises(ParameterError, match=re.escape(f"{path}: {words}")):
        read_parameter_file(path)
    path.write_bytes(TEXT.encode("utf-8-sig"))
    assert read_parameter_file(path) == {"/**": {"a": 1}}


def test_an_empty_file_says_nothing(tmp_path):
    assert read_parameter_file(written(tmp_path, "")) == {}


def test_a_later_file_wins_within_a_section_and_a_later_section_over_an_earlier_one():
    first = {"/**": {"flight.seed": 1, "vehicle.mass": 0.5}, "/**/recorder": {"flight.seed": 2}}
    second = {"/one/recorder": {"vehicle.mass": 0.7}, "/two/recorder": {"vehicle.mass": 0.9}, "/**": {"flight.seed": 3}}
    assert overrides_for([first, second], "recorder", "/one") == {"flight.seed": 2, "vehicle.mass": 0.7}
    assert overrides_for([first, second], "simulator", "/one") == {"flight.seed": 3, "vehicle.mass": 0.5}


def test_what_is_written_is_what_pyyaml_writes_and_reads():
    content = {
        "/simulator": {"ros__parameters": {"a.b": 0.1, "c": "1e5", "d": True, "e": [], "f": "x: y\nz", "g": 1e-9}}
    }
    assert dump_yaml(content) == yaml.safe_dump(content, sort_keys=False)
    assert yaml.safe_load(dump_yaml(content)) == content


PLAIN = """/**:
  ros__parameters: {p0: 6e-1, p1: 017, p2: 0x1F, p3: '1', p4: 1e5, p5: yes, p6: 1_000, p7: .inf, p8: on, p9: 5.,
    q0: .5, q1: +3, q2: n, q3: -inf, q4: -6E+2, q5: 1d, q6: y, q7: 08, q8: ~, q9: null, y: 2026-11-25}
"""


def test_plain_scalars_are_what_rclpy_makes_of_them(tmp_path):
    """The right side was printed by a node of rclpy 7.1.6 with this file."""
    numbers = {"p0": 0.6, "p1": 15, "p2": 31, "p4": 1e5, "p7": math.inf, "p9": 5.0, "q0": 0.5, "q1": 3}
    more = {"q3": -math.inf, "q4": -600.0, "q7": 8.0, "p5": True, "p8": True, "q2": False, "q6": True}
    texts = {"p3": "1", "p6": "1_000", "q5": "1d", "q8": "~", "q9": "null", "y": "2026-11-25"}
    expected = {**numbers, **more, **texts}
    (found,) = read_parameter_file(written(tmp_path, PLAIN)).values()
    assert {name: (type(value), value) for name, value in found.items()} == {
        name: (type(value), value) for name, value in expected.items()
    }


def test_a_number_that_is_none_and_a_key_without_a_value(tmp_path):
    (found,) = read_parameter_file(written(tmp_path, "/**: {ros__parameters: {a: .nan}}")).values()
    assert math.isnan(found["a"])
    with pytest.raises(ParameterError, match=r"vehicle\.mass: found no value"):
        read_parameter_file(written(tmp_path, "/**:\n  ros__parameters:\n    vehicle:\n      mass:\n"))


def test_namespaces_may_be_keys_of_their_own(tmp_path):
    nested = "/uav1:\n  simulator:\n    ros__parameters: {vehicle: {mass: 0.6}}\n  recorder: {ros__parameters: {}}\n"
    path = written(tmp_path, nested)
    assert read_parameter_file(path) == {"/uav1/simulator": {"vehicle.mass": 0.6}, "/uav1/recorder": {}}


@pytest.mark.parametrize(("pattern", "namespace", "expected"), [
    ("simulator", "/", True),
    ("simulator", "/uav1", False),
    ("/**/simulator", "/", True),
    ("/**/simulator", "/a/uav1", True),
    ("/*/simulator", "/", False),
    ("/*/simulator", "/uav1", True),
    ("/uav1/**", "/uav1", True),
    ("/uav1/**", "/uav2", False),
    ("/*", "/", True),
    ("/*", "/uav1", False),
    ("/**", "/uav1", True),
    ("/uav1/simulator", "uav1", True),
    ("uav1/simulator", "/uav1", True),
    ("/**/recorder", "/", False),
])  # fmt: skip
def test_patterns_reach_the_nodes_that_rclpy_gives_them_to(pattern, namespace, expected):
    """As a node of rclpy 7.1.6 named ``simulator`` had them."""
    assert reaches(pattern, "simulator", namespace) == expected


def test_a_section_that_reaches_no_node_is_named(tmp_path):
    path = written(tmp_path, "/uav1/simulator: {ros__parameters: {a: 1}}")
    check_reached(path, ["simulator", "recorder"], "/uav1")
    with pytest.raises(
        ParameterError, match=r"flight\.yaml: section /uav1/simulator reaches .* expected /simulator or"
    ):
        check_reached(path, ["simulator", "recorder"])
    with pytest.raises(ParameterError, match="reaches no node of this flight; expected one of its nodes: recorder"):
        check_reached(written(tmp_path, "commander: {ros__parameters: {a: 1}}"), ["recorder"])
