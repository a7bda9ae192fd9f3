"""The hash of what a function is made of: a constant or an enum that it reads counts, wherever it was written."""

from enum import IntEnum

from quad_core.sources import source_hash

LIMIT = 2.0
Form = IntEnum("Form", {"ROUND": 0, "SQUARE": 1})


def chosen(form: int) -> float:
    """Return what depends on both."""
    return LIMIT if form == Form.SQUARE else 0.0


def test_a_constant_and_the_numbers_of_an_enum_count(monkeypatch):
    before = source_hash([chosen], [], "")
    assert source_hash([chosen], [], "") == before
    monkeypatch.setitem(globals(), "LIMIT", 3.0)
    other = source_hash([chosen], [], "")
    monkeypatch.undo()
    monkeypatch.setitem(globals(), "Form", IntEnum("Form", {"SQUARE": 0, "ROUND": 1}))
    turned = source_hash([chosen], [], "")
    assert len({before, other, turned}) == 3
