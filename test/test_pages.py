"""The pages keep their size: a README of a minute, lines that an editor shows whole, few decisions."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])

pytestmark = pytest.mark.unit


def words(path):
    return len(path.read_text(encoding="utf-8").split())


def test_the_readme_takes_a_minute():
    assert words(ROOT / "README.md") < 700


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_line_outside_a_table_is_longer_than_160_characters(page):
    lines = page.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if len(line) > 160 and "|" not in line] == []


def test_pages_that_are_read_in_order_stay_under_40_000_words():
    read = [path for path in ROOT.glob("docs/**/*.md") if not {"reference", "results"} & set(path.parts)]
    assert sum(map(words, read)) < 40_000


def test_at_most_20_decisions():
    assert len(list(ROOT.glob("docs/decisions/[0-9]*.md"))) <= 20


def test_the_glossary_is_in_order_and_names_each_word_once():
    text = (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8")
    terms = [term.lower() for term in re.findall(r"^\| ([^|]+) \|", text, re.MULTILINE)][1:]
    assert terms == sorted(terms)
    assert len(set(terms)) == len(terms)
