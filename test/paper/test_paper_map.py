"""docs/reference/paper_map.md: nothing missing, every name exists, a mistake is declared for every function."""

import importlib

import pytest
from mutation_list import MUTATIONS
from paper_map import FIGURE, functions_in, rows

pytestmark = pytest.mark.unit

ROWS = rows()
EQUATIONS = [row for row in ROWS if row.equation]
MUTATED = {mutation.function for mutation in MUTATIONS}


def test_every_equation_table_and_figure_stands_there_once_and_in_order():
    assert [row.equation for row in EQUATIONS] == list(range(1, 69))
    assert [row.name for row in ROWS if row.name.startswith("Table")] == ["Table 1", "Table 2"]
    figures = [int(match[1]) for match in (FIGURE.match(row.name) for row in ROWS) if match]
    assert figures == list(range(1, 19))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_every_row_has_code_test_and_finding(row):
    assert row.code
    assert row.tests
    assert row.finding


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_every_name_exists(row):
    for link in row.code:
        module, _, name = link.text.rpartition(".")
        assert link.file.is_file(), link
        assert link.file.stem == module, link
        assert hasattr(importlib.import_module(link.dotted.rpartition(".")[0]), name), link
    for link in row.tests:
        assert link.file.is_file(), link
        assert link.text in functions_in(link.file), link


@pytest.mark.parametrize("row", EQUATIONS, ids=lambda row: row.name)
def test_a_mistake_is_declared_in_every_named_function(row):
    assert [link.dotted for link in row.code if link.dotted not in MUTATED] == []
