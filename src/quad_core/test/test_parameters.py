"""Parameter sets: nested names, every kind of value, and errors that name the key, what was found and expected."""

import math
from enum import IntEnum
from typing import Annotated, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_core.parameters import Choice, Flag, ParameterError, Real, Text, Whole, build, fields, flatten


class Inner(NamedTuple):
    gain: Annotated[float, Real("1/s", "a gain", 0.5, 4.0, "Eq. 0")] = 1.0
    count: Annotated[int, Whole("steps", "a count", 1, 9)] = 3


class Outer(NamedTuple):
    x: Inner = Inner()
    y: Inner = Inner(gain=2.0)
    form: Annotated[int, Choice(("round", "square"), "a form")] = 1
    on: Annotated[bool, Flag("a switch")] = True
    name: Annotated[str, Text("a name")] = "n"


class Shade(IntEnum):
    LIGHT = 0
    VERY_DARK = 1


class Painted(NamedTuple):
    shade: Annotated[int, Choice(Shade, "a shade")] = Shade.VERY_DARK


def test_an_enum_gives_the_options_of_a_choice_and_the_numbers_that_a_law_compares_with():
    assert flatten(Painted) == {"shade": "very_dark"}
    assert [build(Painted, {"shade": name}).shade for name in ("light", "very_dark")] == [Shade.LIGHT, Shade.VERY_DARK]
    assert type(build(Painted, {}).shade) is int
    with pytest.raises(ParameterError, match=r"found 'dark', expected one of light, very_dark"):
        build(Painted, {"shade": "dark"})


def test_an_enum_whose_numbers_are_no_places_is_refused():
    with pytest.raises(TypeError, match=r"Odd.*numbered 0, 1"):
        _ = Choice(IntEnum("Odd", {"ONE": 1, "THREE": 3}), "odd").options


def test_leaves_are_named_by_their_path_and_keep_the_defaults_of_the_instance():
    assert flatten(Outer) == {
        "x.gain": 1.0,
        "x.count": 3,
        "y.gain": 2.0,
        "y.count": 3,
        "form": "square",
        "on": True,
        "name": "n",
    }
    assert [field.spec.meaning for field in fields(Outer, "a.") if field.name == "a.x.gain"] == ["a gain"]


def test_values_go_where_their_names_say_and_nothing_else_moves():
    built = build(Outer, {"y.gain": 2, "form": "round", "on": False, "name": "other", "x.count": 9})
    assert repr(built) == repr(Outer(Inner(1.0, 9), Inner(2.0, 3), 0, False, "other"))


def test_an_instance_gives_the_defaults():
    start = Outer(x=Inner(gain=3.5), form=0)
    assert build(start, {"x.count": 1}) == Outer(Inner(3.5, 1), Inner(2.0, 3), 0)


@given(gain=st.floats(0.5, 4.0), count=st.integers(1, 9), form=st.sampled_from(["round", "square"]), on=st.booleans())
def test_what_is_built_and_flattened_comes_back(gain, count, form, on):
    values = {"x.gain": gain, "x.count": count, "form": form, "on": on}
    assert {name: flatten(build(Outer, values))[name] for name in values} == values


@pytest.mark.parametrize(("values", "words"), [
    ({"x.gian": 1.0}, ["p.x.gian", "unknown", "x.gain"]),
    ({"x": 1.0}, ["p.x", "unknown"]),
    ({"x.gain": 4.0001}, ["p.x.gain", "4.0001", "[0.5, 4.0] 1/s"]),
    ({"x.gain": 0.4999}, ["p.x.gain", "0.4999"]),
    ({"x.gain": True}, ["p.x.gain", "True (bool)", "a number"]),
    ({"x.gain": "1.0"}, ["p.x.gain", "'1.0'", "a number"]),
    ({"x.gain": math.nan}, ["p.x.gain", "nan"]),
    ({"y.gain": math.inf}, ["p.y.gain", "inf"]),
    ({"x.count": 10}, ["p.x.count", "10", "an integer", "[1, 9] steps"]),
    ({"x.count": 3.0}, ["p.x.count", "3.0 (float)", "an integer"]),
    ({"x.count": True}, ["p.x.count", "True (bool)"]),
    ({"form": "oval"}, ["p.form", "'oval'", "round, square"]),
    ({"form": 1}, ["p.form", "1", "round, square"]),
    ({"on": 1}, ["p.on", "1", "true or false"]),
    ({"name": 7}, ["p.name", "7", "text"]),
])  # fmt: skip
def test_what_does_not_fit_is_refused_by_name(values, words):
    with pytest.raises(ParameterError) as caught:
        build(Outer, values, "p.")
    assert all(word in str(caught.value) for word in words), caught.value


def test_bounds_belong_to_the_range():
    assert build(Outer, {"x.gain": 0.5, "y.gain": 4.0, "x.count": 1, "y.count": 9})[:2] == ((0.5, 1), (4.0, 9))


def test_a_default_out_of_its_range_is_refused_too():
    with pytest.raises(ParameterError, match=r"x\.gain: found 9\.0"):
        build(Outer(x=Inner(gain=9.0)), {})


class Angles(NamedTuple):
    tilt: Annotated[float, Real("rad", "an angle", -7.0, 7.0)] = 0.5
    gain: Annotated[float, Real("1/s", "a gain", 0.0, 100.0)] = 1.0


@pytest.mark.parametrize(
    ("text", "angle"), [("90deg", math.pi / 2), ("-.5deg", -math.pi / 360), ("360.deg", 2 * math.pi)]
)
def test_an_angle_may_be_written_in_degrees(text, angle):
    assert build(Angles, {"tilt": text}).tilt == pytest.approx(angle, rel=1e-15)


@pytest.mark.parametrize("values", [{"tilt": "90"}, {"tilt": "90 deg"}, {"tilt": "500deg"}, {"gain": "90deg"}])
def test_degrees_are_read_only_with_their_unit_and_only_for_angles(values):
    with pytest.raises(ParameterError, match=r"(tilt|gain): found .*, expected a number in"):
        build(Angles, values)
