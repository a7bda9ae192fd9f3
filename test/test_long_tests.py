"""The table of tests for long runs names tests that there are, and what of the same kind is left for scripts/test."""

from pathlib import Path

import pytest

pytestmark = pytest.mark.unit

ROOT = Path(__file__).resolve().parents[1]
LINES = [line for line in (ROOT / "test/long_tests.txt").read_text().splitlines() if line and not line.startswith("#")]


@pytest.mark.parametrize("line", LINES)
def test_a_line_names_a_test_and_what_stands_for_it(line):
    name, _, reason = line.partition("#")
    file, _, test = name.strip().partition("::")
    assert f"def {test.partition('[')[0]}" in (ROOT / file).read_text(encoding="utf-8")
    assert reason.strip()


def test_no_test_is_named_twice():
    names = [line.partition("#")[0].strip() for line in LINES]
    assert [name for name in names if any(name.startswith(other) for other in names if other != name)] == []
    assert len(set(names)) == len(names)
