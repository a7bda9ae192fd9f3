"""The lint of pure text: each rule finds its mistake, good text passes, and all that is installed is clean."""

import importlib.util
import sys

import pytest

from quad_core import plugins, purity

HEAD = """
import math
from enum import IntEnum
from numpy import zeros
from quad_core.types import Vec3
from quad_core.parameters import flatten

GAIN = 2.5
TABLE = {}
NAME = (1, 2)


class Form(IntEnum):
    ROUND = 0
    SQUARE = 1



def helper(x: float) -> float:
    return math.tanh(x)


def dirty(x: float) -> float:
    return max(x, 0.0)

"""


@pytest.fixture
def checked(tmp_path, monkeypatch):
    """Return a function that puts ``body`` into ``def pure(x: float, v: Vec3) -> float`` and lints it."""
    written = []

    def check(body, before_flight=False):
        name = f"made_up_{len(written)}"
        written.append(tmp_path / f"{name}.py")
        lines = "".join(f"    {line}\n" for line in body.splitlines())
        written[-1].write_text(f"{HEAD}\ndef pure(x: float, v: Vec3) -> float:\n{lines}", encoding="utf-8")
        spec = importlib.util.spec_from_file_location(name, written[-1])
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
        return purity.check([], [module.pure]) if before_flight else purity.check([module.pure])

    return check


@pytest.mark.parametrize(
    "body",
    [
        "return helper(x) * GAIN + math.sqrt(x * x)",
        "size = abs(x)\npower = 1.7 * GAIN\nreturn size**power",
        "if x > 1.0:\n    return 1.0\nreturn math.floor(x) * 1.0",
        "moved = Vec3(x, v.y, 0.0)\nreturn moved.x",
        "total = 0.0\nfor i in range(3):\n    total += v[i]\nreturn total",
        "if len(v) == Form.SQUARE:\n    return x\nreturn -x",
    ],
)
def test_good_text_passes(checked, body):
    assert checked(body) == []


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ("return x**2", "the power"),
        ("return x**0.5", "the power"),
        ("return abs(x) ** -1.0", "the power"),
        ("return abs(x) ** 1.7", "the constant exponent"),
        ("power = 1.7 * GAIN\nreturn x**power", "the base x"),
        ("return math.hypot(x, x)", "math.hypot"),
        ("return math.pow(x, GAIN)", "math.pow"),
        ("return max(x, 0.0)", "max"),
        ("return round(x)", "round"),
        ("return dirty(x)", "max"),
        ("return sum([x, x])", "sum"),
        ("return float(len([i for i in range(3)]))", "a comprehension"),
        ("try:\n    return x\nfinally:\n    helper(x)", "try"),
        ("print(x)\nreturn x", "print"),
        ("if Form(1) == 1:\n    return x\nreturn -x", "a call of Form"),
        ("TABLE[0] = x\nreturn x", "TABLE"),
        ("text = f'{x}'\nreturn x", "an f-string"),
        ("return 0", "an integer"),
        ("return helper(1)", "the integer 1 for x"),
        ("return Vec3(x).x", "1 fields of Vec3"),
        ("return Vec3(x, 0, x).x", "the integer 0 for y"),
        ("return v._asdict()", "a call of the method _asdict"),
        ("raise ValueError", "raise"),
        ("return", "a bare return"),
        ("return (lambda y: y)(x)", "a lambda"),
        ("assert x > 0.0\nreturn x", "assert"),
        ("import cmath\nreturn x", "an import inside a function"),
    ],
)
def test_each_rule_finds_its_mistake(checked, body, found):
    findings = checked(body)
    assert any(finding.found.startswith(found) for finding in findings), findings
    assert all("made_up_0.py:" in str(finding) for finding in findings)


def test_before_flight_an_error_of_constant_text_may_be_raised(checked):
    refusal = "if x < 0.0:\n    raise ValueError('x is negative')\nreturn x"
    assert checked(refusal, before_flight=True) == []
    assert [finding.found for finding in checked(refusal)][:1] == ["raise"]
    assert checked("raise ValueError(x)", before_flight=True) != []


def test_before_flight_a_table_may_be_made_and_a_text_be_read(checked):
    table = "table = zeros((2, 3))\ntable[1, 2] = x + ord(NAME[0])\nreturn float(table[1, 2])"
    assert checked(table, before_flight=True) == []
    assert {finding.found for finding in checked(table)} == {"zeros", "ord"}


def test_the_line_is_that_of_the_file(checked, tmp_path):
    (finding,) = checked("y = x\nreturn math.hypot(x, y)")
    lines = (tmp_path / "made_up_0.py").read_text(encoding="utf-8").splitlines()
    assert "math.hypot" in lines[finding.line - 1]


def test_all_that_is_installed_is_clean_but_the_plant_of_another_engine():
    if not plugins.names(plugins.PLANT):
        pytest.skip("plug-ins are not installed: run scripts/setup")
    assert [str(finding) for finding in purity.check_installed() if "quad_mujoco" not in finding.path] == []
