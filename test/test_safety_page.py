"""docs/safety.md holds the mode table as the code has it."""

from pathlib import Path

import pytest

from quad_commander import mode_pages

pytestmark = pytest.mark.unit
PAGE = Path(__file__).parents[1] / "docs" / "safety.md"


def test_the_page_is_up_to_date():
    text = PAGE.read_text(encoding="utf-8")
    assert mode_pages.renewed(text) == text, "run: python -m quad_commander.mode_pages docs/safety.md"
