"""The table of faults: every row is there, and every test that it names exists."""

import sys

import pytest
from flying import ROOT

sys.path.insert(0, str(ROOT / "scripts" / "lib"))
import fault_pages

pytestmark = pytest.mark.unit


def test_every_row_is_there_and_every_test_that_it_names_exists():
    rows = fault_pages.fault_rows()
    assert len({row["fault"] for row in rows}) == len(rows) >= 71
    assert fault_pages.problems(rows) == []


def test_a_claim_without_its_test_is_found():
    row = {"fault": "f", "happens": "h", "state": "tested", "tests": ["test/test_house.py::none"], "outcome": "o"}
    found = fault_pages.problems([row, {**row, "tests": []}, {**row, "tests": ["accept none"], "state": "good"}])
    assert found == [
        "row 1: no test test/test_house.py::none",
        "row 2: tested by nothing",
        "row 3: state 'good', expected one of tested, reasoned, open",
        "row 3: no test accept none",
    ]
